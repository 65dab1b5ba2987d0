# SPDX-License-Identifier: MIT
"""A function that loops at real-time priority: alone, because it takes the CPU from the machines of other tests."""
import unittest

from hung_case import HungCase


class Loop(HungCase):
    def test_endless_loop_at_real_time_priority_frees_the_cpu(self):
        machine = self.machine()
        if "SCHED_FIFO" not in self.shell("show", "timing").stdout:
            self.skipTest("no real-time scheduling here")
        fault = self.hang(2)
        self.assertIn("real-time priority was taken away", fault)
        self.assertRegex(self.shell("show", "timing").stdout, r"(?m)^servo .*SCHED_OTHER \(hung")
        self.check_hung(machine, fault, "uses CPU time")


if __name__ == "__main__":
    unittest.main()
