# SPDX-License-Identifier: MIT
"""hal watch: values of a running machine, with extremes over every cycle."""
import re
import unittest

from harness import Case, Terminal

MACHINE = """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
loadrt sum2 names=adder
loadrt charge_pump names=pump
setp wave.frequency 20
setp wave.amplitude 2
addf wave.update servo
addf adder servo
addf pump servo
net sine wave.sine
net clock wave.clock
net total adder.out
net each-cycle pump.out
start
"""


class Watch(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", MACHINE))

    def rows(self, text):
        return {line.split()[0]: line.split()[1:] for line in text.splitlines()[1:]}

    def test_extremes_hold_every_cycle_and_rates_are_per_second(self):
        out = self.good("watch", "sine", "clock", "each-cycle", "--for", "1500ms")
        self.assertEqual(
            ["NAME", "VALUE", "UNIT", "MIN", "MAX", "RATE"], out.splitlines()[0].split()
        )
        rows = self.rows(out)
        value, least, most = rows["sine"][:3]
        self.assertAlmostEqual(-2, float(least), delta=0.01)
        self.assertAlmostEqual(2, float(most), delta=0.01)
        self.assertLessEqual(abs(float(value)), 2)
        self.assertEqual(["FALSE", "TRUE"], rows["clock"][1:3])
        # 1000 edges per second, fewer where the host is busy and cycles are left out
        cycles = float(rows["each-cycle"][3])
        self.assertLess(cycles, 1020)
        self.assertAlmostEqual(
            0.04, float(rows["clock"][3]) / cycles, delta=0.003
        )  # edges of 20 Hz
        self.assertEqual("edges/s", rows["clock"][4])

    def test_patterns_name_pins_parameters_and_signals(self):
        rows = self.rows(self.good("watch", "adder.*", "to*", "--for", "200ms"))
        self.assertLessEqual({"adder.in0", "adder.out", "total"}, set(rows))
        self.assertNotIn("wave.sine", rows)

    def test_unknown_names_are_rejected(self):
        self.assertIn("'adder.ot'", self.bad("watch", "adder.ot"))

    def test_live_in_a_terminal(self):
        terminal = Terminal(self, "watch", "adder.in0", "total")
        terminal.expect("RATE")
        terminal.expect("q quit")
        self.shell("setp", "adder.in0", "7")
        terminal.expect(" 7 ")
        self.shell("setp", "adder.in0", "3")
        terminal.expect(" 3 ")
        terminal.send("r")
        terminal.send("q")
        self.assertEqual(0, terminal.wait())
        self.assertIn("\x1b[?1049l", terminal.seen)
        self.assertFalse(re.search(r"lost", terminal.seen))


if __name__ == "__main__":
    unittest.main()
