#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""master_test.py BUS_TESTS: halfiles/canopen-axis with its link on a real SocketCAN interface and `hal node drive` as the drive, in
user-mode-linux where the machine has no vcan0: boots, moves, the drive is killed and reconnects, the interface goes down and up, the end."""
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from vcan import on_vcan0

# In a guest every system call is a hundred times dearer, and the host may be busy: a set-point every 10 ms, slower strokes, longer timeouts.
SLOW = """setp x.max-following-error 50
setp x-trajectory.maxv 40
"""
SCRIPT = """set -e
hal=$1
is() { # VALUE COMMAND...: waits until the machine answers it
    value=$1; shift
    until [ "$("$hal" shell "$@" 2>/dev/null)" = "$value" ]; do sleep 0.1; done
    echo "$* $value"
}
drive() {
    "$hal" node drive --link can:vcan0 --id 2 >drive.output & drive=$!
    until grep -q pre-operational drive.output; do sleep 0.1; done
}
drive
"$hal" run axis.hal slow.hal >machine.output 2>&1 & machine=$!
is TRUE getp canopen.0.x.operational
is TRUE gets x-active
until grep -q "operation enabled" drive.output; do sleep 0.1; done
until "$hal" shell gets x-position | grep -Eq '^-?[1-9]'; do sleep 0.1; done
echo it moves
kill -9 $drive
is TRUE getp canopen.0.x.fault
is FALSE gets x-active
is TRUE getp x.fault
until "$hal" shell show fault | grep -q "no heartbeat"; do sleep 0.1; done
drive
is TRUE getp canopen.0.x.operational
"$hal" shell sets x-on FALSE
"$hal" shell setp x.reset TRUE
is FALSE getp x.fault
"$hal" shell sets x-on TRUE
is TRUE gets x-active
ip link set vcan0 down
is TRUE getp canopen.0.bus-off
is FALSE getp canopen.0.x.operational
ip link set vcan0 up
is FALSE getp canopen.0.bus-off
is TRUE getp canopen.0.x.operational
"$hal" shell show fault
kill -TERM $machine
wait $machine
echo machine ended
until tail -n 4 drive.output | grep -q "pre-operational"; do sleep 0.1; done
kill -INT $drive
wait $drive
echo drive ended
"""
SENTENCES = [  # of `show fault`, with # for what differs
    "canopen.0: node 2 (x): no heartbeat for # s (timeout 1 s) at cycle #; outputs set to safe values; see: show pin canopen.0",
    "x: run: drive lost: node no longer operational at cycle #; it may not receive the command to stop; see: show pin x",
    "canopen.0: bus down: the interface is off or was removed at cycle #; the master retries; see: show pin canopen.0",
]
EXPECTED = [
    "it moves",
    "getp canopen.0.x.fault TRUE",
    "getp canopen.0.bus-off TRUE",
    "getp canopen.0.bus-off FALSE",
    "machine ended",
    "drive ended",
]


def main(hal):
    if not hal.exists():
        print(f"{hal} is not built")
        return 77  # skipped
    if b"__asan_init" in hal.read_bytes() or b"__tsan_init" in hal.read_bytes():
        print("a sanitizer inside user-mode-linux is too slow")
        return 77
    source = Path(__file__).resolve().parents[2] / "halfiles" / "canopen-axis"
    with tempfile.TemporaryDirectory() as folder:
        axis = (source / "axis.hal").read_text().replace("period1=1000000", "period1=10000000")
        config = (
            (source / "axis.canopen")
            .read_text()
            .replace("sim:axis", "can:vcan0")
            .replace("period-value = 1", "period-value = 10")
        )
        config = config.replace("sync    = cycle", "sync    = cycle\nheartbeat = 400ms").replace(
            "heartbeat = 50ms", "heartbeat = 400ms"
        )
        if (
            "10000000" not in axis
            or "can:vcan0" not in config
            or "period-value = 10" not in config
            or config.count("400ms") != 2
        ):
            print("the halfile is not as this test knows it")
            return 1
        for name, text in (
            ("axis.hal", axis),
            ("axis.canopen", config),
            ("slow.hal", SLOW),
            ("script", SCRIPT),
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
            200,
        )
        began = time.monotonic()
        done = subprocess.run(command, cwd=folder, check=False, stdout=subprocess.PIPE, text=True)
        print(done.stdout)
        if done.returncode == 77:  # skipped; the last line printed is the reason
            return 77
        print(f"{time.monotonic() - began:.1f} s")
        if done.returncode != 0:
            for output in ("machine.output", "drive.output"):
                print(
                    f"--- {output}\n{Path(folder, output).read_text() if Path(folder, output).exists() else 'nothing'}"
                )
            return done.returncode
        lines = done.stdout.splitlines()
        faults = {
            re.sub(
                r"(cycle|for) [\d.]+( \d{3})*", r"\1 #", re.split(r" ago(?: \(lasts\))?  ", line)[1]
            )
            for line in lines
            if re.search(r" ago(?: \(lasts\))?  ", line)
        }
        if missing := [line for line in EXPECTED if line not in lines] + [
            line for line in SENTENCES if line not in faults
        ]:
            print("missing:", *missing, sep="\n")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
