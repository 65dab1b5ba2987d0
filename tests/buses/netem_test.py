#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""netem_test.py BUS_TESTS: raw Ethernet over a bad line and under a clock that is set, in user-mode-linux, whose kernel has netem."""
import subprocess
import sys
from pathlib import Path

tests = Path(sys.argv[1]).with_name("ethernet_tests")
command = [
    "env",
    "HALCYON_MAY_SET_CLOCK=1",
    str(tests),
    "--gtest_filter=Raw.lost*:Raw.stamps*",
    "--gtest_brief=1",
]
sys.exit(
    subprocess.run([str(Path(__file__).parent / "uml" / "run"), "-t", "120", *command]).returncode
)
