#!/bin/sh
# SPDX-License-Identifier: MIT
# npm canopen 6.2.1: a default value with $NODEID, which CiA 306-1 defines and nearly every EDS has, is read as 0, without a message.
#
# The same device description with the identifiers written out works. With the formulas 1014h and 1800h:1 are 0, the TPDO is not among
# those of the device, and a value that changes is not sent. PyPI canopen 2.4.1 adds the node ID. A TPDO of transmission type 255, the
# usual one, is not sent either, while one of type 254 is.
# Consequence: a device that is built from its manufacturer's EDS starts, answers SDOs, and sends no PDO.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix "$folder" canopen@6.2.1 >/dev/null 2>&1 || exit 2
python3 -m venv venv && venv/bin/pip install -q --disable-pip-version-check canopen==2.4.1 || exit 2

variable() { # INDEX NAME TYPE ACCESS DEFAULT MAPPABLE
    printf '[%s]\nParameterName=%s\nObjectType=0x7\nDataType=%s\nAccessType=%s\nDefaultValue=%s\nPDOMapping=%s\n\n' "$@"
}
record() { # INDEX NAME ENTRIES
    printf '[%s]\nParameterName=%s\nObjectType=0x9\nSubNumber=%s\n\n' "$@"
}
description() { # EMCY TPDO TYPE
    printf '[FileInfo]\nFileName=button.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n\n'
    printf '[DeviceInfo]\nVendorName=Example\nVendorNumber=0\nProductName=Button\nProductNumber=1\nRevisionNumber=1\nBaudRate_500=1\nNrOfRXPDO=0\nNrOfTXPDO=1\nLSS_Supported=0\n\n'
    printf '[MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n\n'
    printf '[OptionalObjects]\nSupportedObjects=3\n1=0x1014\n2=0x1800\n3=0x1A00\n\n'
    printf '[ManufacturerObjects]\nSupportedObjects=1\n1=0x2000\n\n'
    variable 1000 "Device type" 0x0007 ro 0x00030191 0
    variable 1001 "Error register" 0x0005 ro 0 0
    record 1018 Identity 2
    variable 1018sub0 "Highest sub-index supported" 0x0005 ro 1 0
    variable 1018sub1 Vendor-ID 0x0007 ro 0 0
    variable 1014 "COB-ID EMCY" 0x0007 rw "$1" 0
    record 1800 "TPDO 1" 3
    variable 1800sub0 "Highest sub-index supported" 0x0005 ro 2 0
    variable 1800sub1 COB-ID 0x0007 rw "$2" 0
    variable 1800sub2 "Transmission type" 0x0005 rw "$3" 0
    record 1A00 "TPDO 1 mapping" 2
    variable 1A00sub0 "Mapped objects" 0x0005 rw 1 0
    variable 1A00sub1 "Object 1" 0x0007 rw 0x20000010 0
    variable 2000 Button 0x0006 rw 0 1
}
# shellcheck disable=SC2016 # CiA 306's word, no variable
description '$NODEID+0x80' '$NODEID+0x180' 0xFE >formula.eds
description 0x85 0x185 0xFE >number.eds
description 0x85 0x185 0xFF >number-255.eds

cat >device.cjs <<'JS'
const {Device, Eds} = require('canopen');

/// Node 5 starts, and its button is pressed. Returns what the library has read and sent.
function press(file) {
    const eds = Eds.fromFile(file);
    const device = new Device({id: 5, eds});
    const sent = [];
    device.on('message', message => sent.push(message.id.toString(16)));
    device.pdo.start();
    eds.getEntry(0x2000).value = 1;
    return new Promise(resolve => setImmediate(() => {
        device.pdo.stop();
        resolve([eds.getEntry(0x1014).value, eds.getSubEntry(0x1800, 1).value, eds.getTransmitPdos().length, sent.join(' ')]);
    }));
}

(async () => {
    console.log('npm canopen', require('canopen/package.json').version);
    let unchanged = true;
    const files = {
        'number.eds': [0x85, 0x185, 1, '185'],
        'number-255.eds': [0x85, 0x185, 1, ''],
        'formula.eds': [0, 0, 0, ''],
    };
    for (const [file, expected] of Object.entries(files)) {
        const found = await press(file);
        console.log(`${file}: 1014h is ${found[0]}, 1800h:1 is ${found[1]}, ${found[2]} TPDO, sends: ${found[3] || 'nothing'}`);
        unchanged = unchanged && JSON.stringify(found) === JSON.stringify(expected);
    }
    process.exit(unchanged ? 0 : 1);
})();
JS
node device.cjs || exit 1
venv/bin/python - <<'PYTHON'
import importlib.metadata
import sys

import canopen

dictionary = canopen.import_od("formula.eds", node_id=5)
found = [dictionary[0x1014].default, dictionary[0x1800][1].default]
print("PyPI canopen", importlib.metadata.version("canopen"), "formula.eds: 1014h is", found[0], "and 1800h:1 is", found[1])
sys.exit(0 if found == [0x85, 0x185] else 1)
PYTHON
