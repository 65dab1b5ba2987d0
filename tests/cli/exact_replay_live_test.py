# SPDX-License-Identifier: MIT
# packages: canopen
"""A short run of tests/replay_live.py: machines under load, edits and stops, executed again without a difference."""

import re
import subprocess
import sys
import unittest

from harness import HAL, ROOT, SANITIZED, Case


@unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock and of files")
class ExactReplayLive(Case):
    def test_machines_and_random_netlists_have_no_differing_bit(self):
        words = ["--seconds", "2", "--random", "2", "--edits", "80", "--setp", "200"]
        done = subprocess.run(
            [sys.executable, ROOT / "tests/replay_live.py", HAL, *words, "canopen-axis/axis.hal"],
            capture_output=True,
            text=True,
        )
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        self.assertIn("3 machines executed again, 0 differ, 0 do not start here\n", done.stdout)
        counts = re.findall(
            r"(?m): (\d+) cycles, (\d+) edits, .*\b(\d+) values compared, 0 bits differ$",
            done.stdout,
        )
        self.assertEqual(3, len(counts), done.stdout)
        for cycles, edits, values in counts:
            self.assertGreater(int(cycles), 500)
            self.assertGreater(int(edits), 150)
            self.assertGreater(int(values), 10000)


if __name__ == "__main__":
    unittest.main()
