#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: scocan
"""scocan_vcan_test.py BUS_TESTS: two processes share a real SocketCAN interface by time slots, in user-mode-linux where the machine has no vcan0: the node
follows the SYNC, private and shared messages arrive, the SYNC node is killed and returns. It prints how evenly a thread sends: the spread of the
intervals between private messages, by the kernel's time stamps."""
import subprocess
import sys
import tempfile
from pathlib import Path

from vcan import on_vcan0

# Times of a guest on a busy machine, not of a bus: it may stall for a tenth of a second.
TABLE = """cycle 1s
slots 4
guard 20ms
idle 150ms
lost 5
node clock A sync
node motor A
mode 0 run
0 sync
1 private motor 0x10A
message position 0x10A fields a:s32,b:s32
message lamp 0x300 node clock period 2s fields on:u8
"""
NETLIST = """newthread bus 10000000 supervise=off
loadrt {component} link=can:vcan0 config=slow.scocan node={node}
addf {instance}.receive bus
{more}addf {instance}.transmit bus
start
"""
# The first interval is that of the start; the shortest and longest count from a reset on.
SPREAD = """loadrt minmax names=spread
net interval scocan-sync.0.position.interval => spread.in
addf spread bus
"""
SCRIPT = """set -e
hal=$1
is() { # VALUE NAME COMMAND...: waits until the machine answers it
    value=$1; name=$2; shift 2
    until [ "$("$hal" shell --name $name "$@" 2>/dev/null)" = "$value" ]; do sleep 0.5; done
    echo "$name $* $value"
}
clock() { "$hal" run clock.hal --name clock >clock.output 2>&1 & clock=$!; }
clock
"$hal" run motor.hal --name motor >motor.output 2>&1 & motor=$!
is TRUE motor getp scocan.0.running
"$hal" shell --name motor setp scocan.0.position.a -42
is -42 clock getp scocan-sync.0.position.a
"$hal" shell --name clock setp scocan-sync.0.lamp.on 1
is 1 motor getp scocan.0.lamp.on
"$hal" shell --name clock setp spread.reset TRUE
sleep 1
"$hal" shell --name clock setp spread.reset FALSE
sleep 12
echo "shortest interval $("$hal" shell --name clock getp spread.min) us, longest $("$hal" shell --name clock getp spread.max) us, nominal 1000000"
echo "own frames late: $("$hal" shell --name motor getp scocan.0.late), slots missed: $("$hal" shell --name motor getp scocan.0.missed)"
kill -9 $clock
is 2 motor getp scocan.0.state
is TRUE motor getp scocan.0.fault
clock
is 1 motor getp scocan.0.state
is -42 clock getp scocan-sync.0.position.a
kill -TERM $motor $clock
wait $motor $clock
echo ended
"""
EXPECTED = """motor getp scocan.0.running TRUE
clock getp scocan-sync.0.position.a -42
motor getp scocan.0.lamp.on 1
motor getp scocan.0.state 2
motor getp scocan.0.fault TRUE
motor getp scocan.0.state 1
clock getp scocan-sync.0.position.a -42
ended
"""


def main(hal):
    if not hal.exists():
        print(f"{hal} is not built")
        return 77  # skipped
    if b"__asan_init" in hal.read_bytes() or b"__tsan_init" in hal.read_bytes():
        print("a sanitizer inside user-mode-linux is too slow")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (
            ("slow.scocan", TABLE),
            ("script", SCRIPT),
            (
                "clock.hal",
                NETLIST.format(
                    component="scocan_sync", node="clock", instance="scocan-sync.0", more=SPREAD
                ),
            ),
            (
                "motor.hal",
                NETLIST.format(component="scocan", node="motor", instance="scocan.0", more=""),
            ),
        ):
            Path(folder, name).write_text(text)
        command = on_vcan0(
            [
                "env",
                f"HOME={folder}",
                f"XDG_RUNTIME_DIR={folder}",
                "TERM=dumb",
                "sh",
                "script",
                str(hal),
            ],
            280,
        )
        done = subprocess.run(command, cwd=folder, check=False, stdout=subprocess.PIPE, text=True)
        print(done.stdout)
        if done.returncode == 77:  # skipped; the last line printed is the reason
            return 77
        missing = [line for line in EXPECTED.splitlines() if line not in done.stdout.splitlines()]
        if done.returncode == 0 and not missing:
            return 0
        print("missing:", *missing, sep="\n")
        for output in ("clock.output", "motor.output"):
            print(
                f"--- {output}\n{Path(folder, output).read_text() if Path(folder, output).exists() else 'nothing'}"
            )
        return done.returncode or 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
