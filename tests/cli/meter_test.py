# SPDX-License-Identifier: MIT
"""hal meter: one value of a running machine, large in a terminal, as lines elsewhere. And `watch` in hal shell."""
import fcntl
import re
import struct
import termios
import unittest

from harness import Case, Terminal

MACHINE = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=adder
loadrt and2 names=gate
addf adder servo
addf gate servo
setp adder.in0 12.5
net total adder.out
start
"""


class Meter(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", MACHINE))

    def live(self, *words, columns=100, rows=30):
        terminal = Terminal(self, "meter", *words)
        fcntl.ioctl(
            terminal.descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0)
        )
        return terminal

    def test_a_script_gets_one_line(self):
        self.assertEqual("12.5\n", self.good("meter", "total"))
        self.assertEqual("FALSE\n", self.good("meter", "gate.out"))
        self.assertEqual("1\n", self.good("meter", "adder.gain0"))

    def test_a_script_gets_lines_for_a_time(self):
        lines = self.good("meter", "total", "--for", "500ms").splitlines()
        self.assertTrue(2 <= len(lines) <= 5, lines)
        self.assertEqual({"12.5"}, set(lines))

    def test_one_value_at_a_time(self):
        self.assertRegex(
            self.bad("meter", "adder.*"),
            r"^hal meter: one value at a time, not \d+; several: hal watch adder\.\*\n$",
        )
        self.assertEqual(
            "hal meter: no pin, parameter or signal matches 'zz*'; to list them: hal shell show pin\n",
            self.bad("meter", "zz*"),
        )
        self.assertIn("did you mean 'total'?", self.bad("meter", "totla"))
        self.assertEqual(
            "hal meter: one value at a time, not 2; several: hal watch total gate.out\n",
            self.bad("meter", "total", "gate.out"),
        )

    def test_large_in_a_terminal_until_q(self):
        terminal = self.live("total")
        terminal.expect("█")
        terminal.expect("min 12.5  max 12.5")
        self.shell("setp", "adder.in0", "3")
        terminal.expect("min 3  max 12.5")
        terminal.send("r")
        terminal.expect("min 3  max 3")
        terminal.send("q")
        self.assertEqual(0, terminal.wait())
        self.assertIn("\x1b[?1049l", terminal.seen)

    def test_a_small_terminal_has_the_plain_value(self):
        terminal = self.live("total", columns=14, rows=5)
        terminal.expect("12.5")
        terminal.send("q")
        self.assertEqual(0, terminal.wait())

    def test_a_machine_that_ends_is_reported(self):
        terminal = self.live("total")
        terminal.expect("min 12.5")
        self.machine.kill()
        terminal.expect("hal meter: instance 'default' has ended")
        self.assertEqual(1, terminal.wait())


class ShellWatch(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", MACHINE))

    def test_a_command_prints_the_table(self):
        for words in (
            ("watch", "total", "gate.*"),
            ("-e", "watch total gate.*"),
            ("watch total gate.*",),
        ):
            out = self.good("shell", *words)
            self.assertRegex(out, r"(?m)^NAME +VALUE UNIT +MIN +MAX +RATE$")
            self.assertRegex(out, r"(?m)^total +12\.5 ")
            self.assertRegex(out, r"(?m)^gate\.out +FALSE ")
        self.assertIn("missing name; type: watch NAME", self.bad("shell", "watch"))
        self.assertIn("watch NAME…", self.good("shell", "help", "watch"))

    def test_a_pipe_has_it_among_other_commands(self):
        out = self.good("shell", given="setp adder.in0 4\nwatch total\ngets total\n")
        self.assertRegex(out, r"(?m)^total +4 ")
        self.assertTrue(out.endswith("\n4\n"), out)

    def test_live_from_the_prompt_and_back(self):
        terminal = Terminal(self, "shell")
        terminal.expect("hal> ")
        terminal.send("help\r")
        terminal.expect("watch NAME…")
        terminal.expect("hal> ")
        terminal.send("watch tot\t\r")
        terminal.expect("12.5")
        terminal.expect("q quit")
        terminal.send("q")
        terminal.expect("hal> ")
        terminal.send("gets total\r")
        terminal.expect("12.5")
        terminal.send("quit\r")
        self.assertEqual(0, terminal.wait())
        self.assertFalse(re.search("unknown", terminal.seen))

    def test_halcmd_does_not_have_it(self):
        self.assertIn("watch", self.run_program("watch", "total", name="halcmd").stderr)


if __name__ == "__main__":
    unittest.main()
