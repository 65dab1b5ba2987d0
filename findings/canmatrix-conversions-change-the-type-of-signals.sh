#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI canmatrix 1.3.3: converted from DBC to another format and read again by the same library, the same bytes of a drive decode to
# other numbers, without a message.
#
# SYM (PCAN): the 32-bit float (SIG_VALTYPE_ 1) is written as `signed`, although the format has `float`: 12.5 Nm becomes 1095237632 Nm.
# ARXML: signed signals are read back as unsigned, and the factor 0.001 as 1: -100 rpm becomes 32668 rpm, -255 mm becomes 4294717291 mm.
# The base types are written without their encoding, and PyPI cantools 45.1.0 rejects the file for that reason.
# XLS: floats and signs are lost, and the offset is lost too: -255 mm becomes 4294717.296 mm. KCD and JSON keep all three values.
# Consequence: a description that has gone through one of these formats turns a small negative speed into full speed forward.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check \
    canmatrix==1.3.3 cantools==45.1.0 lxml==6.1.3 xlwt==1.3.0 xlrd==2.0.2 || exit 2
cd "$folder"
cat >drive.dbc <<'DBC'
VERSION ""

NS_ :

BS_:

BU_: Master Drive

BO_ 384 Status: 8 Drive
 SG_ Torque : 0|32@1- (1,0) [-100|100] "Nm" Master
 SG_ Position : 32|32@1- (0.001,-5) [-1000|1000] "mm" Master
BO_ 385 Motion: 8 Drive
 SG_ Speed : 0|16@1- (0.5,0) [-1000|1000] "rpm" Master
SIG_VALTYPE_ 384 Torque : 1;
DBC
venv/bin/python - <<'PYTHON'
import importlib.metadata
import logging
import struct
import sys

import canmatrix.formats
import cantools

logging.disable()
FRAMES = {384: struct.pack("<fi", 12.5, -250000), 385: struct.pack("<h6x", -200)}
EXPECTED = {
    "dbc": [12.5, -255.0, -100.0],
    "kcd": [12.5, -255.0, -100.0],
    "json": [12.5, -255.0, -100.0],
    "sym": [1095237632.0, -255.0, -100.0],
    "arxml": [12.5, 4294717291.0, 32668.0],
    "xls": [1095237632.0, 4294717.296, 32668.0],
}


def values(path):
    (matrix,) = canmatrix.formats.loadp(path).values()
    found = []
    for frame in sorted(matrix.frames, key=lambda frame: frame.arbitration_id.id):
        decoded = frame.decode(FRAMES[frame.arbitration_id.id])
        found += [round(float(decoded[name].phys_value), 6) for name in sorted(decoded, reverse=True)]
    return found


(matrix,) = canmatrix.formats.loadp("drive.dbc").values()
print("canmatrix", importlib.metadata.version("canmatrix"))
print("torque (Nm), position (mm) and speed (rpm) of the same bytes, by the format that the description went through:")
unchanged = True
for form, expected in EXPECTED.items():
    path = "drive." + form
    if form != "dbc":
        canmatrix.formats.dumpp({"": matrix}, path)
    found = values(path)
    print(f"{form:6}", *found)
    unchanged = unchanged and found == expected
try:
    cantools.database.load_file("drive.arxml")
    unchanged = False
except cantools.database.UnsupportedDatabaseFormatError as error:
    print("cantools", importlib.metadata.version("cantools"), "about the ARXML file:", error)
sys.exit(0 if unchanged else 1)
PYTHON
