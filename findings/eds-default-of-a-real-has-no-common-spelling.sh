#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI canopen 2.4.1 and dcf-tools 2.4.2: no spelling of the default value of a REAL32 object is read by both.
#
# canopen reads a decimal number (1.5). The bits in hexadecimal (0x3FC00000) give no default value, without a message. dcf-tools, which
# writes the configuration of lely-core's and ros2_canopen's masters, reads only the bits; the decimal number raises ValueError.
# Consequence: an EDS that is corrected so that dcfgen accepts it has no defaults of its gains and limits in Python programs.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check canopen==2.4.1 dcf-tools==2.4.2 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import sys
import warnings

import canopen
import dcf.device

EDS = """[FileInfo]
FileName=gain.eds
FileVersion=1
FileRevision=1
EDSVersion=4.0
[DeviceInfo]
VendorName=Example
VendorNumber=1
ProductName=Gain
ProductNumber=1
Granularity=8
NrOfRXPDO=0
NrOfTXPDO=0
LSS_Supported=0
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0
PDOMapping=0
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=0
PDOMapping=0
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
PDOMapping=0
[1018sub1]
ParameterName=Vendor
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=1
PDOMapping=0
[OptionalObjects]
SupportedObjects=0
[ManufacturerObjects]
SupportedObjects=1
1=0x2000
[2000]
ParameterName=Gain
ObjectType=0x7
DataType=0x0008
AccessType=rw
DefaultValue={}
PDOMapping=0
"""


def by_canopen(path):
    return canopen.import_od(path)[0x2000].default


def by_dcf_tools(path):
    try:
        with warnings.catch_warnings(action="ignore"):
            return dcf.device.Device.from_dcf(path)[0x2000][0].parse_value()
    except ValueError:
        return "ValueError"


print("canopen", importlib.metadata.version("canopen"), "and dcf-tools", importlib.metadata.version("dcf-tools"))
read = []
for spelling in ("1.5", "0x3FC00000"):
    path = f"{sys.argv[1]}/gain.eds"
    with open(path, "w") as file:
        file.write(EDS.format(spelling))
    read.append((by_canopen(path), by_dcf_tools(path)))
    print(f"DefaultValue={spelling}: canopen {read[-1][0]}, dcf-tools {read[-1][1]}")
sys.exit(0 if read == [(1.5, "ValueError"), (None, 1.5)] else 1)
PYTHON
