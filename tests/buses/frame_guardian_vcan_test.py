#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""frame_guardian_vcan_test.py BUS_TESTS: the guardian of stop frames on a real SocketCAN interface, in user-mode-linux where the machine has no vcan0: a machine
that is killed, one whose device confirms, and interfaces that are down, full, listen-only, or have old frames in their queue.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from vcan import on_vcan0

NETLIST = """newthread servo 10000000 supervise=off
loadrt frame_guardian names=guard link=can:vcan0{link} send="{send}" every_ms=100 heartbeat_ms=10000{more}
addf guard.update servo
start
"""
SCRIPT = """hal=$1
begin() { # NETLIST
    "$hal" run $1.hal --no-picture >$1.output 2>&1 & machine=$!
    until [ "$("$hal" shell getp guard.guarded 2>/dev/null)" = TRUE ]; do sleep 0.3; done
}
report() { # NETLIST
    until grep -q ': guardian: ' $1.output; do sleep 0.3; done
    sed -n 's/.*: guardian: .*the process has ended/the process has ended/p' $1.output
}
kill_it() { # NETLIST: what the guardian reports
    kill -9 $machine
    report $1
}
rejected() { # NETLIST
    "$hal" run $1.hal --no-picture 2>&1 | sed -n 's/.*: error: /error: /p'
}
candump -L vcan0 >heard & candump=$!
begin plain
kill_it plain
n=0
until [ $(wc -l <heard) -ge 6 ] || [ $n -eq 50 ]; do n=$((n + 1)); sleep 0.1; done
echo "frames: $(sed 's/.* //' heard | tr '\\n' ' ')"
begin confirmed
(while sleep 0.2; do cansend vcan0 701#7F; cansend vcan0 701#04; done) & device=$!
kill_it confirmed
kill $device
begin silent
kill_it silent
begin full
tc qdisc add dev vcan0 root pfifo limit 0  # ENOBUFS
kill -9 $machine
sleep 1
if grep -q ': guardian: ' full.output; then echo "the report came too early"; fi
tc qdisc del dev vcan0 root
report full
begin down
ip link set vcan0 down
kill_it down
rejected down
ip link set vcan0 up
rejected listening
ip link set vcan0 down
ip link set vcan0 mtu 16
ip link set vcan0 up
rejected long
kill $candump 2>/dev/null || true  # it has ended with the interface
modules=/usr/lib/uml/modules/$(uname -r)/kernel
[ -d $modules ] || exit 0
# the driver's echo, and an interface that sends 30 frames a second
busybox rmmod vcan
busybox insmod $modules/drivers/net/can/vcan.ko echo=1
busybox insmod $modules/net/sched/sch_tbf.ko
busybox insmod $modules/net/sched/sch_prio.ko
ip link add vcan0 type vcan
ip link set vcan0 up
tc qdisc add dev vcan0 root handle 1: tbf rate 4kbit burst 32 limit 100000
tc qdisc add dev vcan0 parent 1:1 handle 2: prio
candump -L vcan0 >slow & candump=$!
begin queued
cangen vcan0 -g 0 -I 201 -L 2 -D 1027 -n 100  # they wait for 3 s
kill_it queued
n=0
until tail -n 1 slow | grep -q ' 000#0200$' || [ $n -eq 50 ]; do n=$((n + 1)); sleep 0.1; done
kill $candump
echo "frames: $(sed 's/.* //' slow | uniq | tr '\\n' ' ')"
"""
SENT = r"the process has ended; the stop frames were sent"
EXPECTED = [
    SENT + r" 3 times; \d+\.\d ms",
    "frames: 201#0000 000#0200 201#0000 000#0200 201#0000 000#0200 ",
    SENT + r" [1-9]\d* times? and confirmed; \d+\.\d ms",
    SENT + r" 2 times and not confirmed; \d+\.\d ms",
    SENT + r" 3 times; \d{4}\.\d ms",
    r"the process has ended; the stop frames were not sent on can:vcan0: 201#0000 and 1 more: the interface is down",
    "error: .*the interface is down; type: .*",
    "error: .*can:vcan0.* is listen-only, so no stop frame is sent; remove `listen` from the address, or type: "
    "sudo ip link set vcan0 type can listen-only off.*",
    "error: .*the interface is not set up for CAN FD; .*",
]
IN_A_GUEST = [
    SENT + r" 3 times; \d+\.\d ms",
    # ahead of the commands that wait, and behind them
    r"frames: 201#1027 (201#0000 000#0200 )+201#1027 .*201#0000 000#0200 201#0000 000#0200 201#0000 000#0200 ",
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
        frames = "201#0000,000#0200"
        for name, link, send, more in (
            ("plain", "", frames, ""),
            ("confirmed", "", frames, confirm + " repeat=600"),
            ("silent", "", frames, confirm + " repeat=2"),
            ("full", "", frames, ""),
            ("down", "", frames, ""),
            ("listening", "?listen", frames, ""),
            ("long", "", "201##0112233445566778899AABBCC", ""),
            ("queued", "", frames, ""),
        ):
            text = NETLIST.format(link=link, send=send, more=more)
            Path(folder, f"{name}.hal").write_text(text)
        Path(folder, "script").write_text(SCRIPT)
        home = ["env", f"HOME={folder}", f"XDG_RUNTIME_DIR={folder}", "TERM=dumb"]
        command = on_vcan0([*home, "sh", "script", str(hal)], 280)
        is_guest = command[0] != "env"
        done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)
        print(done.stdout)
        expected = EXPECTED + (IN_A_GUEST if is_guest else [])
        lines = [
            line
            for line in done.stdout.splitlines()
            if line.startswith(("the ", "frames", "error"))
        ]
        matches = [re.fullmatch(*pair) is not None for pair in zip(expected, lines)]
        if len(lines) == len(expected) and all(matches):
            return done.returncode
        print([line for line, is_right in zip(lines, matches) if not is_right])
        for output in sorted(Path(folder).glob("*.output")):
            print(f"--- {output.name}\n{output.read_text()}")
        return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
