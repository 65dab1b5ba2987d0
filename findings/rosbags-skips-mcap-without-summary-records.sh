#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI rosbags 0.11.9: AnyReader opens a valid MCAP file without a word and gives none of its messages, depending on which optional records the
# summary has.
#
# The file has three ROS 2 messages. Statistics, and the copies of channels in the summary, are optional in MCAP, and the writer of the package
# mcap (1.6.0) can leave them out. Without the copies the bag has no connections, although its message count is 3; with chunk indexes
# but without statistics it has a connection and gives 0 messages. Neither case raises an error or prints a warning.
# Consequence: who writes MCAP for rosbags writes statistics and repeats channels; who reads compares the number of messages with another reader.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check mcap==1.6.0 rosbags==0.11.9 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import pathlib
import struct
import sys
import warnings

from mcap.writer import IndexType, Writer
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def write(path, **options):
    with open(path, "wb") as stream:
        writer = Writer(stream, **options)
        writer.start("ros2", "example")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data\n")
        channel = writer.register_channel("/example", "cdr", schema)
        for second in range(3):
            writer.add_message(channel, second * 10**9, b"\0\1\0\0" + struct.pack("<d", second), second * 10**9)
        writer.finish()


def read(path):
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        with AnyReader([pathlib.Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            return len(reader.connections), reader.message_count, len(list(reader.messages())), len(warned)


cases = {
    "all records": {},
    "repeat_channels=False": {"repeat_channels": False},
    "use_statistics=False, index_types=CHUNK": {"use_statistics": False, "index_types": IndexType.CHUNK},
}
seen = {}
for name, options in cases.items():
    path = f"{sys.argv[1]}/example.mcap"
    write(path, **options)
    seen[name] = read(path)
print(*(f"{package} {importlib.metadata.version(package)}" for package in ("mcap", "rosbags")))
for name, (connections, count, messages, warned) in seen.items():
    print(f"{name}: {connections} connections, message_count {count}, {messages} messages read, {warned} warnings")
full, no_channels, no_statistics = seen.values()
same = full[0] == 1 and full[2] == 3 and no_channels[0] == 0 and no_channels[2] == 0 and no_statistics[2] == 0
sys.exit(0 if same and no_channels[3] == no_statistics[3] == 0 else 1)
PYTHON
