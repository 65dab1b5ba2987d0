#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""socketcan_test.py BUS_TESTS: the SocketCAN tests, on this machine where it has vcan0, else in user-mode-linux."""
import subprocess
import sys

from vcan import on_vcan0

sys.exit(
    subprocess.run(
        on_vcan0([sys.argv[1], "--gtest_filter=Socketcan.*", "--gtest_brief=1"], 120)
    ).returncode
)
