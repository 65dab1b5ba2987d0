#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_ethercrab_test.py HAL: the Rust crate ethercrab is master of `hal node ethercat` over a veth pair: SDO, mapping, distributed clocks, process
data in OP. The program is built here, in build/peers/ethercrab. 77: cargo, its registry or network namespaces are missing."""
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import ethercat_line  # noqa: E402
import ethercrab_program  # noqa: E402

HAL = sys.argv[1]
MASTER = ethercrab_program.build()
ethercat_line.network()
with ethercat_line.line(HAL, "servo\ndigital_out bits=8\ndigital_in bits=8\n") as node:
    master = subprocess.run(
        [MASTER, "m0"], capture_output=True, text=True, timeout=60
    )
    log = node.said()
print(master.stdout + master.stderr, end="")
checks = master.stdout.splitlines()
checks.append(
    "ok   outputs arrive"
    if "slave 1 (digital_out): outputs 10100101\n" in log
    else f"FAIL outputs arrive {log}"
)
checks.append(
    "ok   the line prints the state"
    if "slave 0 (servo): OP" in log
    else f"FAIL the line prints the state {log}"
)
print("\n".join(checks[-2:]))
print(f"{sum(c.startswith('ok ') for c in checks)} of {len(checks)} checks hold")
sys.exit(
    0
    if master.returncode == 0 and len(checks) == 13 and all(c.startswith("ok ") for c in checks)
    else 1
)
