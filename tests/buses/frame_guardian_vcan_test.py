#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""frame_guardian_vcan_test.py BUS_TESTS: the guardian of stop frames on a real SocketCAN interface, in user-mode-linux where the machine has no vcan0: a machine
that is killed, one whose device confirms, and one whose interface is down."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from vcan import on_vcan0

NETLIST = """newthread servo 10000000 supervise=off
loadrt frame_guardian names=guard link=can:vcan0 send="201#0000,000#0200" every_ms=100 heartbeat_ms=10000{more}
addf guard.update servo
start
"""
SCRIPT = """hal=$1
begin() { # NETLIST
    "$hal" run $1.hal --no-picture >$1.output 2>&1 & machine=$!
    until [ "$("$hal" shell getp guard.guarded 2>/dev/null)" = TRUE ]; do sleep 0.3; done
}
kill_it() { # NETLIST: what the guardian reports
    kill -9 $machine
    until grep -q ': guardian: ' $1.output; do sleep 0.3; done
    sed -n 's/.*: guardian: .*the process has ended/the process has ended/p' $1.output
}
candump -L vcan0 >heard & candump=$!
begin plain
kill_it plain
echo "frames: $(sed 's/.* //' heard | tr '\\n' ' ')"
begin confirmed
(while sleep 0.2; do cansend vcan0 701#7F; cansend vcan0 701#04; done) & device=$!
kill_it confirmed
kill $device
begin silent
kill_it silent
begin down
ip link set vcan0 down
kill_it down
ip link set vcan0 up
kill $candump 2>/dev/null || true  # it has ended with the interface
"""
EXPECTED = [
    r"the process has ended; the stop frames were sent 3 times; \d+\.\d ms",
    "frames: 201#0000 000#0200 201#0000 000#0200 201#0000 000#0200 ",
    r"the process has ended; the stop frames were sent [1-9]\d* times? and confirmed; \d+\.\d ms",
    r"the process has ended; the stop frames were sent 2 times and not confirmed; \d+\.\d ms",
    "the process has ended; the stop frames were not sent: can:vcan0 is down",
]


def main(hal):
    if not hal.exists():
        print(f"{hal} is not built")
        return 77  # skipped
    if not shutil.which("candump"):
        print("can-utils are not installed: apt install can-utils")
        return 77
    if b"__asan_init" in hal.read_bytes() or b"__tsan_init" in hal.read_bytes():
        print("a sanitizer inside user-mode-linux is too slow")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        confirm = ' confirm="701#04"'
        for name, more in (
            ("plain", ""),
            ("confirmed", confirm + " repeat=1000"),
            ("silent", confirm + " repeat=2"),
            ("down", ""),
        ):
            Path(folder, f"{name}.hal").write_text(NETLIST.format(more=more))
        Path(folder, "script").write_text(SCRIPT)
        home = ["env", f"HOME={folder}", f"XDG_RUNTIME_DIR={folder}", "TERM=dumb"]
        command = on_vcan0([*home, "sh", "script", str(hal)], 240)
        done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)
        print(done.stdout)
        lines = [line for line in done.stdout.splitlines() if line.startswith(("the ", "frames"))]
        matches = [re.fullmatch(*pair) is not None for pair in zip(EXPECTED, lines)]
        if len(lines) == len(EXPECTED) and all(matches):
            return done.returncode
        for output in sorted(Path(folder).glob("*.output")):
            print(f"--- {output.name}\n{output.read_text()}")
        return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
