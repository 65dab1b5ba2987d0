# SPDX-License-Identifier: MIT
"""The scope in the past: values around a cycle of a journal."""

import csv
import unittest

from harness import Case, wait_until

# `sum` counts cycles, so that each value states when it was.
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt integ names=sum
loadrt siggen
setp sum.in 1000
setp siggen.0.frequency 5
addf sum servo
addf siggen.0.update servo
net sine siggen.0.sine
start
loadrt and2 names=late
addf late servo
"""


class ReplayScope(Case):
    def setUp(self):
        super().setUp()
        machine = self.start("run", self.write("a.hal", NETLIST), "--journal", "run.mcap")
        wait_until(lambda: int(self.value("servo.threadbeat") or 0) >= 1000, "1000 cycles")
        self.end(machine)

    def past(self, *lines, status=0):
        done = self.run_program(
            "replay", "--exact", "run.mcap", "--shell", given="\n".join(lines) + "\n"
        )
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stdout

    def test_the_picture_is_around_the_present_cycle_which_stays(self):
        text = self.past("goto 0.5s", "scope sine sum.out --csv a.csv", "getp sum.out", "where")
        lines = text.splitlines()
        self.assertEqual("a.csv", lines[1])
        self.assertEqual([lines[0]] * 2, [lines[2], lines[4]])  # the cycle
        rows = list(csv.DictReader((self.folder / "a.csv").read_text().splitlines()))
        times = [float(row["time_s"]) for row in rows]
        # a busy computer misses periods, also at both ends
        self.assertLess(-0.06, times[0])
        self.assertLess(times[-1], 0.06)
        self.assertLessEqual(times[0], 0)
        self.assertLessEqual(0, times[-1])
        now = min(rows, key=lambda row: abs(float(row["time_s"])))
        self.assertAlmostEqual(float(lines[3]), float(now["sum.out"]), 5)
        values = [float(row["sum.out"]) for row in rows]
        self.assertEqual(sorted(values), values)
        self.assertGreater(len(set(values)), 10)

    def test_at_both_ends_of_the_journal(self):
        for place, names in [("goto 0", "sum.out"), ("continue", "sum.out late.in0")]:
            first, *picture, last = self.past(
                place, f"scope {names} --pre 10s --post 1s"
            ).splitlines()
            self.assertIn("sum.out", "".join(picture))
            self.assertIn(last, (first, "the journal has no further cycle"))
        done = self.past("goto 0.2s", "scope sin* --pre 100ms --post 0 --svg a.svg")
        self.assertIn("a.svg", done)
        self.assertIn("<svg", (self.folder / "a.svg").read_text())

    def test_a_file_name_may_have_spaces(self):
        text = self.past("goto 0.5s", 'scope sine --csv "my file.csv"', 'scope sum.out --svg "a b"')
        self.assertEqual(["my file.csv", "a b"], text.splitlines()[1:4:2])
        self.assertIn("sine", (self.folder / "my file.csv").read_text().splitlines()[0])
        self.assertIn("<svg", (self.folder / "a b").read_text())

    def test_what_is_wrong_is_named(self):
        usage = "scope NAME... [--pre 50ms] [--post 50ms] [--svg FILE] [--csv FILE]"
        no_folder = "scope: cannot write 'none/a': No such file or directory"
        for words, lines in [
            ("", [f"scope: write: {usage}"]),
            ("none", ["scope: no pin, parameter or signal matches 'none'"]),
            ("sine --pre often", ["scope: 'often' is not a valid time; write 20ms or 1s"]),
            ("sine --pre", ["scope: --pre needs a value"]),
            ("sine --colour red", ["scope: unknown option '--colour'"]),
            ("sine --pre 0 --post 0", ["scope: the time before and after is 0"]),
            ("*", ["scope: 35 values match; at most 16 are drawn"]),
            ("sine --svg none/a --csv b.csv", [no_folder]),
            ("sine --svg a.svg --csv none/a", ["a.svg", no_folder]),
        ]:
            text = self.past("goto 0.5s", f"scope {words}", status=1)
            self.assertEqual(lines, text.splitlines()[1 : 1 + len(lines)])
            self.assertFalse((self.folder / "b.csv").exists())

    def test_names_that_are_too_long_together(self):
        names = [f"{n:x}".rjust(160, "n") for n in range(15)]
        netlist = (
            "loadrt threads name1=servo period1=1000000\nloadrt sum2 count=15\naddf sum2.0 servo\n"
        )
        netlist += "".join(f"net {name} sum2.{n}.out\n" for n, name in enumerate(names)) + "start\n"
        machine = self.start("run", self.write("b.hal", netlist), "--journal", "run.mcap")
        wait_until(lambda: int(self.value("servo.threadbeat") or 0) >= 100, "100 cycles")
        self.end(machine)
        text = self.past("goto 50", "scope nn*", status=1)
        self.assertEqual("scope: the names are too long", text.splitlines()[1])


if __name__ == "__main__":
    unittest.main()
