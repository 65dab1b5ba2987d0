#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI python-can 4.6.1: each time a log is written as TRC (PCAN-View) and read again, its channel is one higher.
#
# The writer counts the buses of a file from 1 and adds 1 to the channel of a message. The reader returns the bus of the file as it is.
# Its reader and writer of ASC, the other format that counts from 1, undo each other.
# Consequence: a log of channel 0 is replayed on channel 1, and after another conversion on channel 2; a machine with two networks sends
# the frames of one to the other.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check python-can==4.6.1 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import sys

import can


def channels(writer, reader, name):
    message = can.Message(timestamp=1.0, arbitration_id=0x181, is_extended_id=False, data=[1], channel=0)
    found = [message.channel]
    for number in range(3):
        path = f"{sys.argv[1]}/{number}.{name}"
        with writer(path) as log:
            log(message)
        with reader(path) as log:
            (message,) = list(log)
        found.append(message.channel)
    return found


trc = channels(can.TRCWriter, can.TRCReader, "trc")
asc = channels(can.ASCWriter, can.ASCReader, "asc")
print("python-can", importlib.metadata.version("python-can"))
print("channel, written and read again three times as TRC:", *trc)
print("channel, written and read again three times as ASC:", *asc)
sys.exit(0 if trc == [0, 1, 2, 3] and asc == [0, 0, 0, 0] else 1)
PYTHON
