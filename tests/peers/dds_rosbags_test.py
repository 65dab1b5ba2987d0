#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The Python package rosbags decodes our messages of ROS 2 and encodes them again, byte for byte: dds_rosbags_test.py PROGRAM, which prints
a type and a sample in hexadecimal digits on each line."""
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

package("rosbags")
from rosbags.typesys import Stores, get_typestore  # noqa: E402

store = get_typestore(Stores.ROS2_HUMBLE)
lines = subprocess.run(
    [sys.argv[1]], stdout=subprocess.PIPE, text=True, check=True
).stdout.splitlines()
failed = len(lines) < 8
for line in lines:
    ros, digits = line.split()
    name, ours = ros.replace("/", "/msg/"), bytes.fromhex(digits)
    message = store.deserialize_cdr(ours, name)
    theirs = bytes(store.serialize_cdr(message, name))
    same = theirs == ours
    failed |= not same
    print(
        f"{ros}: {len(ours)} bytes "
        + ("are the same" if same else f"differ:\n  ours   {ours.hex()}\n  theirs {theirs.hex()}")
    )
sys.exit(failed)
