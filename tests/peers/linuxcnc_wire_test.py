#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc ethercat
"""linuxcnc_wire_test.py HAL: LinuxCNC's own programs, as the Debian package linuxcnc-uspace installs them, move five axes over a wire with time
slots. Nine processes with real-time threads: on two CPUs they run beside no other test. 77: the package is not installed.
"""

import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(HERE.parent / "cli"))
from harness import HAL, SANITIZED, Case  # noqa: E402

MACHINE = HERE.parents[1] / "halfiles/linuxcnc-ethernet"
BUSY = "this computer is busy: "  # what bring-up reports when other programs take the CPUs of its stations


class Wire(Case):
    def bring_up(self):
        return subprocess.run(
            [MACHINE / "bring-up", self.write("empty.ngc", "M2\n")],
            cwd=self.folder,
            env={
                **self.environment,
                "HAL": str(HAL),
                "HAL_RTMOD_DIR": "/usr/lib/linuxcnc/modules",
                "PATH": f"{HAL.parent}:{self.environment['PATH']}",
            },
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=150,
        )

    def test_g_code_moves_five_axes_over_a_wire_with_time_slots(self):
        if os.geteuid() != 0:
            self.skipTest(
                "time slots need real-time priority, which a user namespace withholds; run this as root"
            )
        machine = self.bring_up()
        if machine.returncode == 77:
            self.skipTest(machine.stdout.strip())
        if machine.returncode != 0 and BUSY in machine.stdout:
            self.skipTest("other programs use the CPUs, so that the stations miss their slots")
        self.assertIn("homed; running empty.ngc\n", machine.stdout, machine.stderr)
        self.assertIn("tdma.0: ", machine.stdout + machine.stderr)


if __name__ == "__main__":
    if not shutil.which("milltask") or SANITIZED:
        print("LinuxCNC is not installed: sudo apt-get install linuxcnc-uspace")
        sys.exit(77)
    ran = unittest.main(argv=sys.argv[:1] + sys.argv[2:], exit=False).result
    if ran.skipped:
        print(ran.skipped[0][1])
        sys.exit(77)
    sys.exit(not ran.wasSuccessful())
