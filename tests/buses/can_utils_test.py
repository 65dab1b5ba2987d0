#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""can_utils_test.py BUS_TESTS: hal can, from the same folder, beside the stock candump and cansend on a real SocketCAN interface, in user-mode-linux where the machine
has no vcan0."""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from vcan import on_vcan0

SCRIPT = """set -e
candump -L vcan0 >heard-by-candump & candump=$!
candump -L -x vcan0 >x.log & candump="$candump $!"
candump -ta vcan0 >ta.log & candump="$candump $!"
candump -tz -a vcan0 >tz.log & candump="$candump $!"
candump -tA -x vcan0 >tA.log & candump="$candump $!"
candump -ta -c -c vcan0 >colours.log & candump="$candump $!"
candump vcan0 >none.log & candump="$candump $!"
candump -ta -i vcan0 >binary.log & candump="$candump $!"
"$1" can dump can:vcan0 --count 9 >heard-by-hal 2>listening & dump=$!
until grep -q listening listening && test "$(grep -c vcan0 /proc/net/can/rcvlist_all)" -ge 8; do sleep 0.05; done
cansend vcan0 123#1122AABB; cansend vcan0 18FF0001#00; cansend vcan0 321#R4; cansend vcan0 123##1AABB
"$1" can send can:vcan0 181#0102 18FF0002#03 322#R2 124##0CC
"$1" can nmt can:vcan0 start 5
wait $dump
kill $candump
for name in x ta tz tA colours none binary; do "$1" can dump replay:$name.log >$name.dump 2>&1 || true; done
"""
SENT = [
    "123#1122AABB",
    "18FF0001#00",
    "321#R4",
    "123##1AABB",
    "181#0102",
    "18FF0002#03",
    "322#R2",
    "124##0CC",
    "000#0105",
]
MEANT = [
    ("123", "11 22 AA BB"),
    ("18FF0001", "00"),
    ("321", "remote request, 4 bytes"),
    ("123", "AA BB"),
    ("181", "01 02"),
    ("18FF0002", "03"),
    ("322", "remote request, 2 bytes"),
    ("124", "CC"),
    ("000", "01 05"),
]


def seen(file):
    """The identifiers and bytes that hal can dump printed."""
    lines = [
        re.match(r" *[\d.]+  rx +(\w+)  \[\d\](?: FD\+?)? (.*?)(?:  |$)", line)
        for line in file.read_text().splitlines()
    ]
    return [line.groups() for line in lines if line]


def main(hal):
    if not hal.exists():
        print(f"{hal} is not built")
        return 77  # skipped
    if not shutil.which("cansend"):
        print("can-utils are not installed: apt install can-utils")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "script").write_text(SCRIPT)
        command = on_vcan0(["sh", "script", str(hal)], 100)
        status = subprocess.run(command, cwd=folder, check=False).returncode
        if status != 0:
            return status
        # candump of some versions has the mark of FD, 4, among the flags.
        flags = lambda line: re.sub(
            r"##(\w)", lambda m: f"##{int(m[1], 16) & 3:X}", line.split()[2]
        )
        candump = [
            flags(line) for line in Path(folder, "heard-by-candump").read_text().splitlines()
        ]
        ours = seen(Path(folder, "heard-by-hal"))
        for what, expected, got in (("candump", SENT, candump), ("hal can dump", MEANT, ours)):
            if expected != got:
                print(f"{what} heard {got}\n  instead of {expected}")
                return 1
        # What candump printed, read by hal can dump. The terminal format has the flags of FD with -x only.
        for name in ("x", "ta", "tz", "tA", "colours"):
            read = seen(Path(folder, name + ".dump"))
            if read != MEANT:
                print(f"{name}.log of candump is read as {read}\n  instead of {MEANT}")
                return 1
        for name, reason in (
            ("none", "terminal format of candump, without times"),
            ("binary", "terminal format of candump, not with plain hexadecimal bytes"),
        ):
            text = Path(folder, name + ".dump").read_text()
            if reason not in text:
                print(f"{name}.log of candump is not named: {text}")
                return 1
    print(f"{len(SENT)} frames seen alike by candump and hal can dump")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
