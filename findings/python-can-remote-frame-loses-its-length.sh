#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI python-can 4.6.1: a remote frame that CanutilsLogWriter has written is read with length 0; candump's own spelling of its length is rejected.
#
# A remote frame has a data length code without data. can-utils write it behind the R: 123#R4. python-can's writer writes 123#R whatever the
# length, so its reader returns 0 for a frame that had 4. The reader takes 123#R4, and raises ValueError for the raw DLC that candump of
# Debian 12 appends with -8 (123#1122334455667788_E).
# Consequence: a log of python-can with remote frames does not replay what was on the bus: CANopen node guarding is such traffic.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check python-can==4.6.1 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import sys

import can

path = f"{sys.argv[1]}/example.log"
with can.CanutilsLogWriter(path) as writer:
    writer(can.Message(timestamp=1.0, arbitration_id=0x705, is_extended_id=False, is_remote_frame=True, dlc=1, channel="can0"))
    writer(can.Message(timestamp=2.0, arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=4, channel="can0"))
with open(path) as file:
    lines = file.read().splitlines()
with can.CanutilsLogReader(path) as reader:
    lengths = [message.dlc for message in reader]


def length_of(line):
    with open(path, "w") as file:
        file.write(line + "\n")
    with can.CanutilsLogReader(path) as reader:
        try:
            return [message.dlc for message in reader][0]
        except ValueError as problem:
            return f"{type(problem).__name__}: {problem}"


stated = length_of("(1.000000) can0 123#R4")
raw = length_of("(1.000000) can0 123#1122334455667788_E")
print("python-can", importlib.metadata.version("python-can"))
print("written, of length 1 and 4:", *lines, sep="\n    ")
print("read again:", lengths)
print("123#R4:", stated)
print("123#1122334455667788_E:", raw)
same = lengths == [0, 0] and stated == 4 and str(raw).startswith("ValueError")
sys.exit(0 if same else 1)
PYTHON
