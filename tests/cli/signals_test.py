# SPDX-License-Identifier: MIT
"""Every signal there is, sent to the programs that run for long: none ends one without a report, crashes make outputs safe first."""
import os
import signal
import subprocess
import unittest

from harness import HAL, SANITIZED, SERVO, Case, Terminal, needs_package, wait_until

ENDING = [
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGHUP,
    signal.SIGQUIT,
    signal.SIGXCPU,
    signal.SIGPWR,
]
CRASHES = [
    signal.SIGSEGV,
    signal.SIGBUS,
    signal.SIGFPE,
    signal.SIGILL,
    signal.SIGABRT,
    signal.SIGSYS,
    signal.SIGTRAP,
]
NOT_TO_CATCH = [signal.SIGKILL, signal.SIGSTOP]
IGNORED = [
    number for number in signal.valid_signals() if number not in (*ENDING, *CRASHES, *NOT_TO_CATCH)
]

WITNESS = "loadrt threads name1=servo period1=1000000\nloadrt witness file=end.txt\naddf witness.0 servo\n"


class Machine(Case):
    def machine(self):
        machine = self.start("run", self.write("a.hal", WITNESS))
        wait_until(lambda: self.value("witness.0.out") == "5", "the output is 5")
        return machine

    def test_signals_without_a_meaning_change_nothing(self):
        machine = self.machine()
        for number in IGNORED:
            machine.send_signal(number)
            beat = self.value("servo.threadbeat")
            self.assertIsNone(machine.poll(), f"signal {number} ended it")
            wait_until(
                lambda: self.value("servo.threadbeat") != beat,
                f"the thread goes on after signal {number}",
            )
        self.assertEqual("5", self.value("witness.0.out"))
        self.end(machine)
        self.assertEqual(0, machine.returncode)

    def test_signals_that_end_it_are_named_in_the_report(self):
        for number in ENDING:
            (self.folder / "end.txt").unlink(missing_ok=True)
            machine = self.machine()
            out, err = self.end(machine, number)
            self.assertEqual((0, ""), (machine.returncode, err), number)
            self.assertRegex(out, r"(?m)^servo +1 ms +\d+ ")
            text = (self.folder / "end.txt").read_text()
            self.assertIn("emergency\n", text)
            self.assertTrue(text.endswith("stop out=-1\n"), text)
            if number != signal.SIGINT:
                self.assertRegex(out, rf"(?m)^ended by {number.name}$")

    @unittest.skipIf(SANITIZED, "a sanitizer reports crashes itself")
    def test_crash_signals_make_outputs_safe_first(self):
        for number in CRASHES:
            (self.folder / "end.txt").unlink(missing_ok=True)
            machine = self.machine()
            _, err = self.end(machine, number)
            self.assertEqual(-number, machine.returncode, err)
            self.assertIn("; outputs were set to their safe values; the process ends", err)
            self.assertIn("emergency\n", (self.folder / "end.txt").read_text())

    def test_closed_standard_streams_are_not_taken_by_other_files(self):
        hal = subprocess.Popen(
            ["sh", "-c", f"exec {HAL} run {self.write('a.hal', WITNESS)} <&- >&- 2>&-"],
            cwd=self.folder,
            env=self.environment,
        )
        self.addCleanup(hal.wait)
        self.addCleanup(hal.kill)
        wait_until(lambda: self.value("witness.0.out") == "5", "the output is 5")
        self.assertEqual(
            ["/dev/null"] * 3, [os.readlink(f"/proc/{hal.pid}/fd/{number}") for number in range(3)]
        )
        hal.terminate()
        self.assertEqual(0, hal.wait(60))

    def test_programs_that_it_starts_get_the_default_actions(self):
        self.write("ignored.sh", "grep SigIgn /proc/self/status >ignored.txt\n")
        machine = self.start("run", self.write("a.hal", SERVO + "loadusr -w sh ignored.sh\n"))
        self.end(machine)
        ignored = int((self.folder / "ignored.txt").read_text().split()[1], 16)
        self.assertEqual(set(), {n for n in signal.valid_signals() if ignored >> (n - 1) & 1})

    def test_ctrl_z_in_its_terminal_does_not_stop_the_threads(self):
        terminal = Terminal(self, "run", "--no-picture", self.write("a.hal", WITNESS))
        terminal.expect("running until Ctrl-C")
        wait_until(lambda: self.value("witness.0.out") == "5", "the output is 5")
        terminal.send("\x1a")
        beat = self.value("servo.threadbeat")
        wait_until(lambda: self.value("servo.threadbeat") != beat, "the thread goes on")
        terminal.send("\x03")
        self.assertEqual(0, terminal.wait())


class Others(Case):
    """Programs that only watch."""

    def check(self, *words, wait, status=0):
        for number in IGNORED:
            if number in (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU):
                continue  # job control stops them, as it does any program
            self.survives(number, *words, wait=wait)
        self.running.kill()  # one process reads a stream
        self.running.communicate()
        for number in ENDING:
            program = self.program(*words)
            wait(program)
            program.send_signal(number)
            out, err = program.communicate(timeout=60)
            self.assertEqual(status, program.returncode, f"{number.name}: {out}{err}")

    def program(self, *words):
        program = subprocess.Popen(
            ["hal", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, program)
        return program

    def survives(self, number, *words, wait):
        if not hasattr(self, "running"):
            self.running = self.program(*words)
            wait(self.running)
        self.running.send_signal(number)
        self.assertIsNone(self.running.poll(), f"signal {number} ended it")

    def first_line(self, program):
        self.assertNotEqual("", program.stdout.readline())

    def test_record(self):
        self.start(
            "run",
            self.write(
                "a.hal",
                SERVO
                + "loadrt sampler cfg=f depth=100\nnet total => sampler.0.pin.0\naddf sampler.0 servo\n",
            ),
        )
        self.check("record", wait=self.first_line)

    @needs_package("canopen")
    def test_node(self):
        self.check(
            "node", "io", "--link", "udp:239.74.163.2:43113", "--id", "5", wait=self.first_line
        )


if __name__ == "__main__":
    unittest.main()
