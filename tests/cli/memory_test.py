# SPDX-License-Identifier: MIT
"""A machine with all its memory locked fits on a small board."""
import re
import unittest
from pathlib import Path

from harness import SANITIZED, Case

HANG = Path(__file__).parents[2] / "halfiles/furuta/hang.hal"
MOST_KB = 24 * 1024


@unittest.skipIf(SANITIZED, "a sanitizer's own memory is what would be measured")
class Memory(Case):
    def test_the_furuta_machine_is_small(self):
        machine = self.start("run", "--no-picture", HANG, loaded=False)
        self.assertTrue(any("running" in line for line in iter(machine.stdout.readline, "")), "it does not run")
        resident = int(re.search(r"VmRSS:\s*(\d+) kB", Path(f"/proc/{machine.pid}/status").read_text())[1])
        print(f"{resident} kB resident")
        self.assertLess(resident, MOST_KB)


if __name__ == "__main__":
    unittest.main()
