#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI canopen 2.4.1: the values that a DCF states for an array in compact storage (CiA 306) are not read.
#
# An array with CompactSubObj=3 has no sections for its sub-indices; the section [1016Value] of a DCF lists what the user has configured.
# canopen reads the names of such a section ([1016Name]) and ignores the values: each entry has the value None. dcf-tools 2.4.2 reads them.
# With a section of its own for each sub-index (ParameterValue), canopen reads the same values.
# Consequence: node.load_configuration() of such a DCF leaves the consumer heartbeat times of a device as they were, without a message.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check canopen==2.4.1 dcf-tools==2.4.2 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import sys

import canopen
import dcf.device

DCF = """[FileInfo]
FileName=io.dcf
FileVersion=1
FileRevision=1
EDSVersion=4.0
[DeviceInfo]
VendorName=Example
VendorNumber=1
ProductName=Inputs
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
SupportedObjects=1
1=0x1016
[ManufacturerObjects]
SupportedObjects=0
[1016]
ParameterName=Consumer heartbeat time
ObjectType=0x8
"""

COMPACT = """DataType=0x0007
AccessType=rw
PDOMapping=0
CompactSubObj=3
[1016Value]
NrOfEntries=2
1=0x000203E8
3=0x000403E8
"""

ENTRY = """[1016sub{}]
ParameterName=Entry {}
ObjectType=0x7
DataType=0x000{}
AccessType=rw
DefaultValue={}
ParameterValue={}
PDOMapping=0
"""

SECTIONS = "SubNumber=4\n" + "".join(
    ENTRY.format(sub, sub, 7 if sub else 5, 0 if sub else 3, value)
    for sub, value in enumerate(("3", "0x000203E8", "0", "0x000403E8"))
)


def by_canopen(path):
    times = canopen.import_od(path, node_id=1)[0x1016]
    return [times[1].value, times[3].value]


def by_dcf_tools(path):
    times = dcf.device.Device.from_dcf(path)[0x1016]
    return [times[1].parse_value(), times[3].parse_value()]


print("canopen", importlib.metadata.version("canopen"), "and dcf-tools", importlib.metadata.version("dcf-tools"))
read = []
for name, storage in (("compact storage", COMPACT), ("a section for each", SECTIONS)):
    path = f"{sys.argv[1]}/io.dcf"
    with open(path, "w") as file:
        file.write(DCF + storage)
    read += [by_canopen(path), by_dcf_tools(path)]
    print(f"{name}: canopen {read[-2]}, dcf-tools {read[-1]}")
right = [0x203E8, 0x403E8]
sys.exit(0 if read == [[None, None], right, right, right] else 1)
PYTHON
