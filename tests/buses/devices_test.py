#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""devices_test.py BUS_TESTS: the devices of hal node, from the same folder, on a real SocketCAN interface, in user-mode-linux where the
machine has no vcan0: found by a scan, started, read and written."""
import subprocess
import sys
import tempfile
from pathlib import Path

from vcan import on_vcan0

SCRIPT = """set -e
for device in "io 5" "jr3 80" "bootloader 4" "drive 2"; do
    set -- "$1" $device
    "$1" node $2 --link can:vcan0 --id $3 --heartbeat 100 >said-$2 & pids="$pids $!"
    until grep -q pre-operational said-$2; do sleep 0.05; done
done
"$1" can scan can:vcan0 --for 2s
"$1" can nmt can:vcan0 start all
for device in io jr3 bootloader drive; do until grep -q " operational" said-$device; do sleep 0.05; done; done
"$1" can send can:vcan0 205#0300000000000000
until grep -q "outputs 11000000" said-io; do sleep 0.05; done
"$1" can sdo write can:vcan0 2 6040 6 --type u16
until grep -q "ready to switch on" said-drive; do sleep 0.05; done
"$1" can sdo read can:vcan0 4 100a --type visible_string
"$1" can sdo read can:vcan0 80 1018:2 --type u32
kill -INT $pids
wait $pids
"""
EXPECTED = [
    "2 pre-operational 0x00020192",
    "4 pre-operational 0x00000000",
    "5 pre-operational 0x000F0191",
    "80 pre-operational 0x00040194",
]


def main(hal):
    if not hal.exists():
        print(f"{hal} is not built")
        return 77  # skipped
    if b"__asan_init" in hal.read_bytes() or b"__tsan_init" in hal.read_bytes():
        print("a sanitizer inside user-mode-linux is too slow")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "script").write_text(SCRIPT)
        command = on_vcan0(["sh", "script", str(hal)], 100)
        done = subprocess.run(command, cwd=folder, check=False, stdout=subprocess.PIPE, text=True)
        print(done.stdout)
        if done.returncode != 0:
            return done.returncode
        rows = [
            " ".join(line.split()[:3])
            for line in done.stdout.splitlines()
            if "pre-operational" in line
        ]
        if rows != EXPECTED or "1.0" not in done.stdout or "1028" not in done.stdout:
            print(f"found {rows}\ninstead of {EXPECTED}, program 1.0 and product 1028 (0x404)")
            return 1
    print("four devices found, started, read and written")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve().parent / "hal"))
