# SPDX-License-Identifier: MIT
"""hal top on a terminal: keys, width and height; and without one."""

import os
import shutil
import subprocess
import unittest

from harness import HAL, SERVO, Case
from virtual_terminal import ShownTerminal


class WithoutDds(Case):
    def test_names_the_package_that_other_computers_need(self):
        alone = self.folder / "bin/hal"
        alone.parent.mkdir()
        for program in ("hal", "hal-tools"):
            shutil.copy(HAL.with_name(program), alone.with_name(program))
        plain = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
        done = subprocess.run(
            [alone, "top", "--dds", "domain=3"], capture_output=True, text=True, env=plain
        )
        self.assertEqual(
            (
                1,
                "hal top: cannot load libhalcyon_dds.so; with Halcyon's Debian packages, type: "
                "sudo apt install halcyon-dds; in the source tree: sudo apt install "
                "libfastrtps-dev && ./hal build\n",
            ),
            (done.returncode, done.stderr),
        )

    def test_an_option_in_the_place_of_the_settings_is_named(self):
        done = subprocess.run([HAL, "top", "--dds", "--once"], capture_output=True, text=True)
        self.assertEqual(
            "hal top: --dds takes settings KEY=VALUE before --once; without any, leave out --dds\n",
            done.stderr,
        )


class Top(Case):
    def setUp(self):
        super().setUp()
        threads = "loadrt threads name1=servo period1=1000000 name2=slow period2=2000000\n"
        self.start("run", "--name", "lathe", self.write("a.hal", threads), instance="lathe")
        self.start("run", "--name", "mill", self.write("b.hal", SERVO), instance="mill")

    def top(self, *words, **size):
        shown = ShownTerminal(self, "top", *words, **size)
        shown.wait_for(lambda rows: any("lathe" in row for row in rows), "the machine is listed")
        return shown

    def test_q_ends_it_and_the_terminal_is_restored(self):
        shown = self.top()
        shown.wait_for(lambda rows: "q quit" in rows, "the keys")
        shown.terminal.send("q")
        self.assertEqual(0, shown.terminal.wait())
        self.assertIn("\x1b[?1049l", shown.terminal.seen)
        self.assertIn("\x1b[?25h", shown.terminal.seen)

    def test_control_c_and_a_duration_end_it(self):
        shown = self.top()
        shown.terminal.send("\x03")
        self.assertEqual(0, shown.terminal.wait())
        self.assertIn("\x1b[?1049l", shown.terminal.seen)
        shown = ShownTerminal(self, "top", "--for", "1s")
        self.assertEqual(0, shown.terminal.wait())

    def test_the_table_is_as_wide_as_the_terminal(self):
        shown = self.top(columns=120)
        shown.wait_for(lambda rows: "HOST" in rows[0] and "NODE" in rows[0], "all columns")
        for columns in (80, 60):
            shown.resize_both(columns, 24)
            shown.wait_for(lambda rows: rows and "HOST" not in rows[0], "fewer columns")
            shown.wait_for(lambda rows: any("FAULTS" in row for row in rows), "the last column")
            self.assertTrue(all(len(row) <= columns for row in shown.screen()), shown.screen())
            self.assertTrue(any(row.startswith("mill") for row in shown.screen()))
        shown.resize_both(20, 24)
        shown.wait_for(lambda rows: rows and rows[0] == rows[0][:20], "lines are cut")
        self.assertTrue(all(len(row) <= 20 for row in shown.screen()), shown.screen())

    def test_more_rows_than_the_terminal_has_are_scrolled(self):
        shown = self.top(columns=110, rows=4)
        shown.wait_for(lambda rows: "q quit  up down scroll" in rows, "the keys")
        self.assertLessEqual(len(shown.screen()), 4)
        self.assertFalse(any("mill" in row for row in shown.screen()))
        for _ in range(4):
            shown.terminal.send("\x1b[B")
        shown.wait_for(lambda rows: any("mill" in row for row in rows), "the last machine")
        self.assertIn("INSTANCE", shown.screen()[0])

    def test_without_a_terminal_the_table_is_printed_once(self):
        lines = self.good("top").splitlines()
        self.assertRegex(lines[0], "^INSTANCE +HOST +NODE +THREAD +PERIOD +CYCLES +MISSED +FAULTS$")
        self.assertEqual(3, len([line for line in lines if " ms " in line]), lines)


if __name__ == "__main__":
    unittest.main()
