#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""socketcan_test.py BUS_TESTS: the SocketCAN tests, on this machine where it has vcan0, else in user-mode-linux."""
import subprocess
import sys
from pathlib import Path

command = [sys.argv[1], "--gtest_filter=Socketcan.*", "--gtest_brief=1"]
if not Path("/sys/class/net/vcan0").exists():
    print("this machine has no vcan0: running in user-mode-linux", flush=True)
    command = [str(Path(__file__).parent / "uml" / "run"), "-t", "120", *command]
sys.exit(subprocess.run(command).returncode)
