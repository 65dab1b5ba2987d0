# SPDX-License-Identifier: MIT
"""The bench runs and prints its figures; the figures themselves are not checked."""
import subprocess
import unittest

from harness import HAL, Case

BENCH = HAL.parent / "hal-bench"


@unittest.skipUnless(BENCH.exists(), "hal-bench is not built here")
class Bench(Case):
    def run_bench(self, *words):
        return subprocess.run([BENCH, *words], capture_output=True, text=True, timeout=200)

    def test_the_cost_of_functions_has_a_row_for_each(self):
        done = self.run_bench("--quick", "dispatch")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertNotIn("ended early", done.stdout)
        for component in ("and2", "sum2", "mux2", "limit1", "pid"):
            self.assertRegex(done.stdout, rf"(?m)^ *{component}\b.* \d+\.\d")

    def test_a_section_that_loads_one_component_runs_it(self):
        done = self.run_bench("--quick", "estimation")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertRegex(done.stdout, r"kalman, 6 states, 3 measurements +[\d.]+ us|not measured: ")

    def test_a_wrong_word_lists_the_sections(self):
        done = self.run_bench("dispach")
        self.assertEqual(2, done.returncode)
        self.assertTrue(
            done.stderr.startswith("hal-bench: no section or option 'dispach'\n"), done.stderr
        )
        self.assertRegex(done.stderr, r"(?m)^  dispatch +cost of a function")


if __name__ == "__main__":
    unittest.main()
