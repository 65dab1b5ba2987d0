#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI mcap 1.6.0: its reader cannot read a file that its own writer makes with repeat_channels=False or repeat_schemas=False.
#
# The MCAP specification makes the copies of channels and schemas in the summary section optional. The package's Writer has a switch for each. Its
# seeking reader takes channels and schemas from the summary alone, as soon as there is a summary: iter_messages() raises KeyError with the
# number of the channel, or a McapError about the missing schema. The file is valid: the stream reader of the same package reads it.
# Consequence: a file without these copies is read by streaming, or written with them.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check mcap==1.6.0 || exit 2
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import importlib.metadata
import sys

from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import Writer


def write(path, **options):
    with open(path, "wb") as stream:
        writer = Writer(stream, **options)
        writer.start()
        schema = writer.register_schema("Example", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/example", "json", schema)
        for second in range(3):
            writer.add_message(channel, second * 10**9, b'{"value": 1}', second * 10**9)
        writer.finish()


def seeking(path):
    with open(path, "rb") as stream:
        try:
            return f"{len(list(make_reader(stream).iter_messages()))} messages"
        except Exception as problem:
            return f"{type(problem).__name__}: {problem}"


def streaming(path):
    with open(path, "rb") as stream:
        return f"{sum(isinstance(record, Message) for record in StreamReader(stream).records)} messages"


seen = {}
for options in ({}, {"repeat_channels": False}, {"repeat_schemas": False}):
    path = f"{sys.argv[1]}/example.mcap"
    write(path, **options)
    seen[str(options)] = (seeking(path), streaming(path))
print("mcap", importlib.metadata.version("mcap"))
for options, (by_index, in_order) in seen.items():
    print(f"Writer({options}): make_reader: {by_index}; StreamReader: {in_order}")
same = all(in_order == "3 messages" for _, in_order in seen.values())
same = same and seen["{}"][0] == "3 messages"
same = same and all(not by_index.endswith("messages") for options, (by_index, _) in seen.items() if options != "{}")
sys.exit(0 if same else 1)
PYTHON
