# SPDX-License-Identifier: MIT
"""The shell on a terminal: prompt, completion, history, interrupts."""
import os
import signal
import unittest

from harness import SERVO, Case, Terminal, wait_until


def children(process):
    """The names of its child processes."""
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        try:
            with open(f"/proc/{entry}/stat", "rb") as file:
                stat = file.read()
        except OSError:
            continue
        if int(stat.rsplit(b")", 1)[1].split()[1]) == process:
            yield stat.split(b"(", 1)[1]


class Shell(Case):
    words, prompt = ("shell",), "hal> "

    def setUp(self):
        super().setUp()
        self.machine = self.start(
            "run",
            self.write(
                "a.hal",
                SERVO + "loadrt and2 names=gate\nloadrt or2 names=either\nnewsig flag bit\n",
            ),
        )
        self.terminal = self.open()

    def open(self):
        terminal = Terminal(self, *self.words)
        terminal.expect(self.prompt)
        return terminal

    def type(self, line):
        """Types a line; what it prints."""
        self.terminal.send(line + "\r")
        return self.terminal.expect(self.prompt)

    def test_commands_and_quit(self):
        self.assertIn("\n2\r\n", self.type("getp adder.in0"))
        self.type("setp adder.in0 8")
        wait_until(
            lambda: self.value("adder.in0") == "8",
            "the line editor may draw its prompt twice, before and after the command",
        )
        self.terminal.send("quit\r")
        self.assertEqual(0, self.terminal.wait())

    def test_end_of_input(self):
        self.terminal.send("\x04")
        self.assertEqual(0, self.terminal.wait())

    def test_did_you_mean(self):
        self.assertIn("did you mean 'adder.out'?", self.type("getp adder.ot"))
        self.assertIn("did you mean 'getp'?", self.type("gtp adder.out"))

    def test_errors_do_not_change_the_exit_status(self):
        self.type("getp nothing")
        self.terminal.send("exit\r")
        self.assertEqual(0, self.terminal.wait())

    def test_tab_completes_a_unique_name(self):
        self.terminal.send("getp adder.ou\t")
        self.terminal.expect("t ")
        self.terminal.send("\r")
        self.assertIn("5", self.terminal.expect(self.prompt))

    def test_tab_completes_a_command(self):
        self.terminal.send("unloadu\t")
        self.terminal.expect("sr ")

    def test_tab_lists_candidates_with_hints(self):
        self.terminal.send("getp adder.in\t")
        listed = self.terminal.expect("adder.in1")
        self.assertIn("adder.in0", listed)
        self.assertIn("float IN", self.terminal.expect(self.prompt))
        self.terminal.send("1\r")
        self.assertIn("\n3\r\n", self.terminal.expect(self.prompt))

    def test_tab_offers_only_what_fits(self):
        self.terminal.send("net flag \t")
        listed = self.terminal.expect("gate.out")
        self.assertIn("either.in0", listed)
        self.assertNotIn("adder.in0", listed)  # a float
        self.terminal.send("\x03")
        self.terminal.expect(self.prompt)

    def test_history_goes_back_and_survives(self):
        self.type("getp adder.in0")
        self.type("getp adder.in1")
        self.terminal.send("\x1b[A\x1b[A\r")
        self.assertIn("\n2\r\n", self.terminal.expect(self.prompt))
        self.terminal.send("quit\r")
        self.assertEqual(0, self.terminal.wait())
        self.assertEqual(0o600, os.stat(self.folder / "state/halcyon/history").st_mode & 0o777)
        self.terminal = self.open()
        self.terminal.send("\x1b[A\x1b[A\r")  # quit is the newest
        self.terminal.expect(self.prompt)
        self.assertEqual(
            "getp adder.in0\ngetp adder.in1\ngetp adder.in0\nquit\ngetp adder.in0\n",
            (self.folder / "state/halcyon/history").read_text(),
        )

    def test_interrupt_drops_the_line_only(self):
        self.terminal.send("setp adder.in0 99\x03")
        self.terminal.expect("^C")
        self.terminal.expect(self.prompt)
        self.assertIn("\n2\r\n", self.type("getp adder.in0"))

    def test_continuation(self):
        self.terminal.send("setp adder.in0 \\\r")
        self.terminal.expect("+")
        self.type("12")
        self.assertEqual("12", self.value("adder.in0"))

    def test_begin_and_commit(self):
        self.terminal.send("begin\r")
        self.terminal.expect("hal+> ")
        self.terminal.send("setp adder.in0 40\r")
        self.terminal.expect("hal+> ")
        self.assertEqual("2", self.value("adder.in0"))
        self.type("commit")
        self.assertEqual("40", self.value("adder.in0"))

    def test_colours_only_when_wanted(self):
        self.assertIn(
            "\033[",
            self.type("getp adder.ot").split("getp", 1)[1].split("\n", 1)[1].rsplit("\r\n", 1)[0],
        )
        plain = Terminal(self, *self.words, environment={"NO_COLOR": "1"})
        plain.expect(self.prompt)
        plain.send("getp adder.ot\r")
        plain.expect("\n")
        self.assertNotIn("\033[", plain.expect("did you mean"))

    def test_interrupt_ends_a_command_that_waits(self):
        self.terminal.send("loadusr -w sleep 1000\r")
        wait_until(lambda: b"sleep" in b"".join(children(self.machine.pid)), "the program runs")
        self.terminal.send("\x03")
        self.assertIn("interrupted", self.terminal.expect(self.prompt))
        self.assertIn("\n2\r\n", self.type("getp adder.in0"))

    def test_instance_that_ends(self):
        self.end(self.machine)
        self.terminal.send("getp adder.in0\r")
        self.assertEqual(1, self.terminal.wait())
        self.assertIn("has ended", self.terminal.seen)


class RunInteractively(Case):
    def setUp(self):
        super().setUp()
        self.terminal = Terminal(self, "run", "-I", self.write("a.hal", SERVO))
        self.terminal.expect("hal> ")

    def test_shell_on_the_machine_itself(self):
        self.terminal.send("getp adder.in1\r")
        self.assertIn("\n3\r\n", self.terminal.expect("hal> "))
        self.terminal.send("getp adder.i\t\t")
        self.terminal.expect("adder.in1")
        self.terminal.send("\x03")
        self.terminal.expect("hal> ")
        self.terminal.send("quit\r")
        self.assertEqual(0, self.terminal.wait())
        self.assertIn("wake-up p50", self.terminal.seen)

    def test_others_may_talk_to_it(self):
        self.shell("setp", "adder.in0", "6")
        self.terminal.send("getp adder.in0\r")
        self.assertIn("\n6\r\n", self.terminal.expect("hal> "))

    def test_interrupt_ends_a_command_that_waits(self):
        self.terminal.send("loadusr -w sleep 1000\r")
        wait_until(
            lambda: b"sleep" in b"".join(children(self.terminal.process)), "the program runs"
        )
        self.terminal.send("\x03")
        self.terminal.expect("hal> ")
        self.terminal.send("getp adder.in0\r")
        self.assertIn("\n2\r\n", self.terminal.expect("hal> "))

    def test_terminate_while_a_line_is_edited(self):
        self.terminal.send("setp adder.in0")
        self.terminal.expect("adder.in0")
        os.kill(self.terminal.process, signal.SIGTERM)
        self.assertEqual(0, self.terminal.wait())
        self.assertIn("wake-up p50", self.terminal.seen)


if __name__ == "__main__":
    unittest.main()
