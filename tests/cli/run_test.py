# SPDX-License-Identifier: MIT
"""hal run: loading, the summary and the report, the ends a run can come to, several instances."""

import os
import signal
import unittest

from harness import SANITIZED, SERVO, Case, Terminal, wait_until
from virtual_terminal import ShownTerminal

FURUTA_SIGNALS = """loadrt threads name1=servo period1=1000000
loadrt siggen
addf siggen.0.update servo
net arm-angle siggen.0.sine
net pendulum-angle siggen.0.cosine
"""


class Run(Case):
    def test_prints_the_loaded_instances_and_the_report(self):
        done = self.run_program("run", self.write("a.hal", SERVO), "--for", "200ms")
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertRegex(done.stdout, r"(?m)^1 instance of 1 component, 1 signal, 1 thread$")
        self.assertRegex(done.stdout, r"(?m)^  sum2 +adder$")
        self.assertRegex(done.stdout, r"(?m)^  servo +every 1 ms: adder$")
        self.assertRegex(done.stdout, r"(?m)^thread .*cycles .*missed .*wake-up")
        self.assertRegex(done.stdout, r"(?m)^servo +1 ms +\d+ ")
        self.assertRegex(done.stdout, r"(?m)^slowest functions: adder ")
        self.assertNotIn("\033", done.stdout)

    def test_starts_the_threads(self):
        self.start("run", self.write("a.hal", SERVO))
        wait_until(lambda: self.shell("gets", "total").stdout == "5\n", "the sum is there")

    def test_bad_netlist_ends_it(self):
        error = self.bad("run", self.write("a.hal", "loadrt summ2\n"))
        self.assertIn("a.hal:1:8: error", error)

    def test_keep_going_runs_in_spite_of_errors(self):
        machine = self.start("run", "-k", self.write("a.hal", "loadrt summ2\n" + SERVO))
        self.assertEqual("3", self.value("adder.in1"))
        self.end(machine)
        self.assertEqual(1, machine.returncode)

    def test_missing_file_and_missing_word(self):
        self.assertIn("nowhere.hal", self.bad("run", "nowhere.hal"))
        self.assertIn("type: hal run FILE.hal", self.bad("run"))

    def test_ini_file_lists_netlists(self):
        self.write("one.hal", SERVO)
        self.write("two.hal", "setp adder.in0 [VALUES]IN0\n")
        ini = self.write(
            "machine.ini",
            "[HAL]\nHALFILE = one.hal\nHALFILE = two.hal\nHALCMD = setp adder.in1 1\n[VALUES]\nIN0 = 20\n",
        )
        self.start("run", ini)
        wait_until(lambda: self.shell("gets", "total").stdout == "21\n", "the sum is there")

    def test_arguments(self):
        self.start("run", self.write("a.hal", SERVO + "setp adder.in0 $1\n"), "--", "30")
        wait_until(lambda: self.shell("gets", "total").stdout == "33\n", "the sum is there")


class End(Case):
    WITNESS = "loadrt threads name1=servo period1=1000000\nloadrt witness file=end.txt\naddf witness.0 servo\n"

    def ended_by(self, end, status=0):
        machine = self.start("run", self.write("a.hal", self.WITNESS))
        wait_until(lambda: self.value("witness.0.out") == "5", "the output is 5")
        end(machine)
        out, err = self.end(machine)
        self.assertEqual((status, ""), (machine.returncode, err))
        self.assertRegex(out, r"(?m)^servo +1 ms +\d+ ")
        text = (self.folder / "end.txt").read_text()
        self.assertIn("emergency\n", text)
        self.assertTrue(text.endswith("stop out=-1\n"), text)
        self.assertEqual(
            [], [p.name for p in (self.folder / "halcyon").iterdir() if p.suffix == ".sock"]
        )

    def test_interrupt_leaves_outputs_safe(self):
        self.ended_by(lambda machine: machine.send_signal(signal.SIGINT))

    def test_terminate_leaves_outputs_safe(self):
        self.ended_by(lambda machine: machine.send_signal(signal.SIGTERM))

    def test_hangup_leaves_outputs_safe(self):
        self.ended_by(lambda machine: machine.send_signal(signal.SIGHUP))

    def test_two_interrupts_are_one(self):
        def twice(machine):
            machine.send_signal(signal.SIGINT)
            machine.send_signal(signal.SIGINT)

        self.ended_by(twice)

    def test_halrun_u_ends_it(self):
        self.ended_by(lambda machine: self.good("-U", name="halrun"))

    def test_reader_of_its_output_leaves(self):
        machine = self.start("run", self.write("a.hal", self.WITNESS))
        machine.stdout.close()
        machine.send_signal(signal.SIGINT)
        wait_until(lambda: machine.poll() is not None, "it ends")
        self.assertTrue((self.folder / "end.txt").read_text().endswith("stop out=-1\n"))
        machine.stdout = open(os.devnull)

    @unittest.skipIf(SANITIZED, "a sanitizer reports crashes itself")
    def test_crash_makes_outputs_safe_and_names_the_function(self):
        machine = self.start("run", self.write("a.hal", self.WITNESS))
        self.shell("setp", "witness.0.crash", "1")
        out, err = machine.communicate(timeout=60)
        self.assertEqual(-signal.SIGSEGV, machine.returncode, err)
        self.assertIn("witness.0", err)
        self.assertIn("emergency\n", (self.folder / "end.txt").read_text())


class Instances(Case):
    def test_rejects_a_second_instance_of_the_same_name(self):
        path = self.write("a.hal", SERVO)
        self.start("run", path)
        error = self.bad("run", path)
        self.assertIn("default", error)
        self.assertIn("--name", error)
        self.assertEqual("3", self.value("adder.in1"))

    def test_two_names_live_side_by_side(self):
        path = self.write("a.hal", SERVO)
        self.start("run", path, "--name", "left", instance="left")
        self.start("run", path, "--name", "right", instance="right")
        self.shell("setp", "adder.in0", "100", instance="left")
        wait_until(lambda: self.value("adder.out", "left") == "103", "left has the new sum")
        self.assertEqual("5", self.value("adder.out", "right"))

    def test_rejects_an_invalid_name(self):
        path = self.write("a.hal", SERVO)
        for name in ("a/b", "..", "a b", "x" * 65):
            error = self.bad("run", path, "--name", name)
            self.assertIn("invalid instance name ", error)

    def test_name_of_a_killed_one_is_free(self):
        path = self.write("a.hal", SERVO)
        machine = self.start("run", path)
        machine.kill()
        machine.wait()
        self.start("run", path)


class Picture(Case):
    def test_furuta_is_drawn_on_a_terminal(self):
        terminal = Terminal(self, "run", self.write("a.hal", FURUTA_SIGNALS))
        terminal.expect("arm, from above")
        terminal.expect("⠀")
        for _ in range(3):  # it is redrawn in place
            frame = terminal.expect("missed")
        self.assertRegex(frame, r"\033\[\d+A")
        self.assertRegex(frame, r"arm +-?\d+\.\d deg +pendulum +-?\d+\.\d deg")
        os.kill(terminal.process, signal.SIGINT)
        self.assertEqual(0, terminal.wait())
        self.assertIn("slowest functions", terminal.seen)
        self.assertNotIn("\033[?25l", terminal.seen)

    def shown(self, reflow=False, **size):
        netlist = FURUTA_SIGNALS + "loadrt stall\naddf stall.0 servo\n"
        path = self.write("a.hal", netlist)
        shown = ShownTerminal(self, "run", "--name", "drawn", path, reflow=reflow, **size)
        shown.wait_for(lambda rows: self.pictures(rows) == 1, "a picture")
        return shown

    def pictures(self, rows):
        return sum("arm, from above" in row for row in rows)

    def frames(self, shown, count=3):
        """Waits until the picture was drawn again."""
        for _ in range(count):
            before = shown.screen()
            shown.wait_for(lambda rows: rows != before, "the picture is drawn again")

    def test_a_fault_is_printed_above_the_picture(self):
        shown = self.shown()
        for mode in (4, 3):
            self.good("shell", "--name", "drawn", "setp stall.0.ms 60")
            self.good("shell", "--name", "drawn", f"setp stall.0.mode {mode}")
            shown.wait_for(
                lambda rows: any(row.startswith("  faults ") for row in rows), "a line of faults"
            )
            self.frames(shown)
        rows = shown.everything()
        self.assertEqual(1, self.pictures(rows), rows)
        fault = next(i for i, row in enumerate(rows) if row.startswith("fault: "))
        picture = next(i for i, row in enumerate(rows) if "arm, from above" in row)
        self.assertLess(fault, picture)
        self.assertFalse(any(row.startswith("fault: ") for row in rows[picture:]), rows)
        self.assertTrue(all(len(row) < 80 for row in rows[picture:]), rows)
        self.assertEqual(set(), shown.unknown)

    def test_the_picture_follows_the_size_of_the_terminal(self):
        for reflow in (False, True):
            with self.subTest(reflow=reflow):
                shown = self.shown(reflow)
                sizes = [(60, 24), (100, 30), (75, 20), (80, 24)]
                if not reflow:  # it would scroll the wrapped picture out of the screen
                    sizes.insert(2, (40, 20))
                for columns, rows in sizes:
                    shown.resize_both(columns, rows)
                    self.frames(shown)
                    self.assertEqual(1, self.pictures(shown.screen()), shown.screen())
                shown.resize_both(70, 10)  # lower than the picture: its last lines
                self.frames(shown)
                drawn = [row for row in shown.screen() if "wake-up latency" in row]
                self.assertEqual(1, len(drawn), shown.screen())
                os.kill(shown.terminal.process, signal.SIGINT)
                shown.terminal.wait()

    def test_axis_is_drawn(self):
        terminal = Terminal(
            self, "run", self.write("a.hal", FURUTA_SIGNALS.replace("arm-angle", "axis-position"))
        )
        terminal.expect("position ")
        os.kill(terminal.process, signal.SIGTERM)
        self.assertEqual(0, terminal.wait())

    def test_not_without_unicode(self):
        terminal = Terminal(
            self, "run", self.write("a.hal", FURUTA_SIGNALS), environment={"LC_ALL": "C"}
        )
        frame = terminal.expect("missed")
        self.assertIn("arm, from above", frame)
        self.assertNotIn("⠀", frame)

    def test_disabled_by_option(self):
        terminal = Terminal(
            self, "run", "--no-picture", "--for", "100ms", self.write("a.hal", FURUTA_SIGNALS)
        )
        self.assertEqual(0, terminal.wait())
        self.assertNotIn("from above", terminal.seen)

    def test_not_in_a_pipe(self):
        done = self.run_program("run", "--for", "100ms", self.write("a.hal", FURUTA_SIGNALS))
        self.assertNotIn("from above", done.stdout)


if __name__ == "__main__":
    unittest.main()
