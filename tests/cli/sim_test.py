# SPDX-License-Identifier: MIT
"""hal sim: the virtual clock from outside."""

import re
import signal
import unittest

from harness import HAL, SERVO, Case, Terminal, wait_until


class Sim(Case):
    def test_prints_only_what_commands_print(self):
        path = self.write("a.hal", SERVO + "start\nadvance 3 cycles\ngets total\n")
        self.assertEqual("5\n", self.good("sim", path))

    def test_for_advances_the_clock(self):
        counter = self.write(
            "a.hal", "loadrt threads name1=servo period1=1000000\nloadrt time\naddf time.0 servo\n"
        )
        self.assertEqual("", self.good("sim", "--quiet", counter, "--for", "2s"))
        report = self.run_program("sim", counter, "--for", "2s", "--report")
        self.assertEqual("", report.stdout)
        self.assertRegex(report.stderr, r"(?m)^servo +1 ms +2000 +0 ")

    def test_keep_going_runs_what_could_be_loaded(self):
        path = self.write("a.hal", "setp nowhere 1\n" + SERVO)
        done = self.run_program(
            "sim", "-k", path, "--for", "1s", "--record", "a.csv", "-e", "gets total"
        )
        self.assertEqual((1, "5\n"), (done.returncode, done.stdout), done.stderr)
        self.assertIn("a.hal:1:6: error: unknown pin 'nowhere' [no-such-pin]", done.stderr)
        self.assertGreater(len((self.folder / "a.csv").read_text().splitlines()), 1000)
        self.bad("sim", path, "--for", "1s")

    def test_a_recording_begins_with_the_values_that_no_thread_has(self):
        path = self.write("a.hal", SERVO + "newsig free float\nsets free 4.5\n")
        self.good("sim", "-q", path, "--for", "10ms", "--record", "a.csv", "--values", "free")
        rows = (self.folder / "a.csv").read_text().splitlines()
        self.assertEqual(["time_s,free", "0.000000000,4.5"], rows)

    def test_a_summary_ends_a_run_that_printed_nothing(self):
        path = self.write("a.hal", SERVO)
        done = self.run_program("sim", path, "--for", "2s")
        self.assertEqual((0, ""), (done.returncode, done.stdout))
        self.assertRegex(
            done.stderr,
            r"^simulated 2 s in [\d.]+ \ws, [\d.e+]+ times as fast as real time; servo 2000 cycles; no faults\n$",
        )
        self.assertEqual(
            "no time simulated: add --for 10s, or advance in the netlist; servo 0 cycles; no faults\n",
            self.run_program("sim", path).stderr,
        )
        self.assertEqual(
            "5\n", self.good("sim", path, "--for", "2s", "-e", "gets total")
        )  # its own output is enough
        terminal = Terminal(self, "sim", path, "--for", "2s", "-e", "gets total")
        terminal.expect("5\r\nsimulated 2 s in ")
        self.assertEqual(0, terminal.wait())
        terminal = Terminal(self, "sim", "-q", path, "--for", "2s", "-e", "gets total")
        self.assertEqual((0, "5\r\n"), (terminal.wait(), terminal.seen))

    def test_a_summary_names_the_faults(self):
        path = self.write(
            "a.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt test_faulty\naddf test-faulty.0.run servo\n"
            "setp test-faulty.0.throws TRUE\n",
        )
        done = self.run_program(
            "sim",
            path,
            "--for",
            "2s",
            environment={"HALCYON_PLUGIN_PATH": str(HAL.parent.parent / "tests/plugins")},
        )
        self.assertEqual(1, done.returncode)
        self.assertRegex(
            done.stderr,
            r"(?m)^simulated 2 s in .*; servo 2000 cycles, stopped by a fault; 1 fault:\n"
            r"  servo: function 'test-faulty.0.run' \(test-faulty\) threw an exception at cycle 0",
        )

    def test_show_prints_values_at_the_end(self):
        path = self.write("a.hal", SERVO)
        self.assertEqual(
            "total      5\nadder.in0  2\nadder.in1  3\n",
            self.good("sim", path, "--for", "1s", "--show", "total,adder.in?"),
        )
        self.assertEqual(
            "hal sim: --show: unknown pin, parameter or signal 'totl'; did you mean 'total'?\n",
            self.bad("sim", "-q", path, "--for", "1s", "--show", "totl"),
        )

    def test_cycles_advance_the_clock(self):
        path = self.write("a.hal", SERVO)
        self.assertRegex(
            self.run_program("sim", path, "--cycles", "1234", "--report").stderr,
            r"(?m)^servo +1 ms +1234 +0 ",
        )

    def test_an_advance_that_is_too_large_is_named(self):
        path = self.write("a.hal", SERVO)
        for amount in ("9223372036854775808ms", "99999999999999999999 cycles"):
            self.assertIn(
                f"'{amount.split()[0]}' is too large [bad-duration]",
                self.run_program("sim", path, "-e", "advance " + amount).stderr,
            )

    def test_for_and_cycles_exclude_each_other(self):
        self.assertIn(
            "exclude each other", self.bad("sim", "x.hal", "--for", "1s", "--cycles", "1")
        )

    def test_twice_the_same(self):
        path = self.write(
            "a.hal",
            "loadrt threads name1=base period1=50000 name2=servo period2=1000000\nloadrt siggen\nloadrt sampler cfg=ff\n"
            "addf siggen.0.update base\naddf sampler.0 servo\nnet s siggen.0.sine => sampler.0.pin.0\nstart\nadvance 5000 cycles\n"
            "gets s\nshow thread\nshow pin siggen\nsave\n",
        )
        self.assertEqual(self.good("sim", path), self.good("sim", path))

    def test_error_ends_it_before_the_clock(self):
        path = self.write("a.hal", "loadrt threads name1=servo period1=1000000\nnet a b.c\n")
        done = self.run_program("sim", path, "--for", "1s", "--report")
        self.assertEqual(1, done.returncode)
        self.assertIn("a.hal:2", done.stderr)
        self.assertNotIn("cycles", done.stderr)

    def test_arguments_are_variables(self):
        path = self.write(
            "a.hal",
            SERVO
            + "setp adder.in0 $1\nsetp adder.in1 $OFFSET\nstart\nadvance 2 cycles\ngets total\n",
        )
        self.assertEqual("42\n", self.good("sim", path, "--", "40", "OFFSET=2"))

    def test_programs_it_starts_reach_it(self):
        path = self.write(
            "a.hal",
            SERVO
            + "start\nadvance 2 cycles\nloadusr -w halcmd setp adder.in0 10\nadvance 2 cycles\ngets total\n",
        )
        self.assertEqual("13\n", self.good("sim", path))

    SAMPLER = (
        "loadrt threads name1=servo period1=1000000\n"
        "loadrt sampler depth=100 cfg=u\naddf sampler.0 servo\n"
        "net alive servo.threadbeat => sampler.0.pin.0\n"
    )

    def sampled(self, file):
        return [int(line) for line in (self.folder / file).read_text().split()]

    def test_time_passes_as_far_as_a_program_needs_it_that_a_command_waits_for(self):
        """A sampler is read, a streamer is fed, in a program of the program's, and with waitusr."""
        self.write("twice.sh", "halsampler -n 250 | cat >b.txt\n")
        self.write("in.txt", "".join(f"{i}\n" for i in range(300)))
        for name, commands, end in (
            ("one program", "loadusr -w halsampler -n 250 a.txt\n", 250),
            ("its program", "loadusr -w sh twice.sh\n", 250),
            ("waitusr", "loadusr -Wn s halsampler -N s -n 250 a.txt\nwaitusr s\n", 250),
        ):
            with self.subTest(name):
                path = self.write(
                    "a.hal", self.SAMPLER + "start\n" + commands + "getp servo.threadbeat\n"
                )
                for _ in range(2):
                    (self.folder / "a.txt").unlink(missing_ok=True)
                    self.assertEqual(f"{end}\n", self.good("sim", path))
                    values = self.sampled("b.txt" if name == "its program" else "a.txt")
                    self.assertEqual(list(range(values[0], values[0] + 250)), values)
        path = self.write(
            "a.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt streamer depth=16 cfg=u\n"
            "addf streamer.0 servo\nnet s streamer.0.pin.0\nstart\nloadusr -w halstreamer in.txt\n"
            "gets s\nadvance 20 cycles\ngets s\n",
        )
        self.assertEqual("284\n299\n", self.good("sim", path))

    def test_time_stands_for_a_program_that_a_command_does_not_wait_for(self):
        path = self.write(
            "a.hal",
            self.SAMPLER + "start\nloadusr halsampler -n 50 a.txt\nloadusr -w sleep 0.3\n"
            "getp servo.threadbeat\n",
        )
        done = self.run_program("sim", path)  # the program may report that the machine has ended
        self.assertEqual((0, "0\n"), (done.returncode, done.stdout), done.stderr)

    def test_the_wait_for_a_program_that_gets_no_samples_is_reported_and_limited(self):
        path = self.write(
            "a.hal", self.SAMPLER + "loadusr -w halsampler -n 20 a.txt\nprint not executed\n"
        )
        done = self.run_program("sim", path, "--cycle-limit", "1200ms")
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertEqual(
            "loadusr: waiting for 'halsampler' (process N) to end; time passes only while it reads "
            "a sampler or feeds a streamer (1 s)\n"
            f"{path}:5:1: error: 'halsampler' did not end within 1.20 s [program-timeout]\n"
            "    5 | loadusr -w halsampler -n 20 a.txt\n"
            "      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
            "      = help: the program was terminated\n\n"
            "1 error; lines 1 to 4 took effect; line 6 had no effect\n",
            re.sub(r"process \d+", "process N", done.stderr.partition("halsampler: ")[0]),
        )

    def test_can_be_interrupted(self):
        path = self.write("a.hal", SERVO)
        machine = self.start("sim", path, "--for", "100000000s", "--name", "long", loaded=False)
        wait_until(
            lambda: self.shell("getp", "servo.threadbeat", instance="long").stdout.strip()
            not in ("", "0"),
            "it runs",
        )
        out, err = self.end(machine, signal.SIGINT)
        self.assertEqual((1, ""), (machine.returncode, out))
        self.assertRegex(err, r"^simulated [\d.]+ m?s in .*; no faults\n$")


if __name__ == "__main__":
    unittest.main()
