# SPDX-License-Identifier: MIT
"""hal scope: records of a running machine as files, and the scope on a terminal."""
import csv
import io
import re
import shutil
import signal
import unittest

from harness import Case, Terminal, wait_until

# A square wave of 50 Hz and a step that a bit triggers.
MACHINE = """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
loadrt sum2 names=adder
loadrt limit3 names=step
loadrt comp names=above
setp wave.frequency 50
setp wave.amplitude 2
setp step.maxv 100
addf wave.update servo
addf adder servo
addf step servo
addf above servo
net square wave.square
net sine wave.sine => above.in1
net high above.out
net command adder.out => step.in
net position step.out
start
"""


class Files(Case):
    def setUp(self):
        super().setUp()
        self.start("run", self.write("a.hal", MACHINE))

    def table(self, *words):
        """The record as (names, rows)."""
        rows = list(csv.reader(io.StringIO(self.good("scope", *words, "--csv", "-"))))
        return rows[0], [[float(value) if value else None for value in row] for row in rows[1:]]

    def test_a_record_lies_around_the_rising_edge(self):
        names, rows = self.table(
            "square", "sine", "--trigger", "square > 0", "--pre", "5ms", "--post", "10ms"
        )
        self.assertEqual(["time_s", "square", "sine"], names)
        self.assertEqual(15, len(rows))
        before = [row[1] for row in rows if row[0] < 0]
        self.assertEqual([-2] * 5, before)
        self.assertEqual(2, next(row[1] for row in rows if row[0] > 0))
        times = [row[0] for row in rows]
        self.assertTrue(
            all(abs(b - a - 0.001) < 1e-9 for a, b in zip(times, times[1:])), "no sample is missing"
        )

    def test_falling_magnitude_bit_and_level_triggers(self):
        for trigger, check in (
            ("square < 0", lambda before, after: before > 0 > after),
            ("|sine| > 1.5", lambda before, after: abs(before) < 1.5 <= abs(after)),
            ("high", lambda before, after: (before, after) == (0, 1)),
            ("!high", lambda before, after: (before, after) == (1, 0)),
            ("level sine > 1", lambda before, after: after >= 1),
        ):
            source = re.search(r"square|sine|high", trigger)[0]
            _, rows = self.table(source, "--trigger", trigger, "--pre", "5ms", "--post", "5ms")
            before = [row[1] for row in rows if row[0] < 0][-1]
            after = next(row[1] for row in rows if row[0] >= 0)
            self.assertTrue(check(before, after), (trigger, before, after))

    def test_the_source_is_recorded_when_it_is_no_channel(self):
        names, _ = self.table("sine", "--trigger", "high")
        self.assertEqual(["time_s", "sine", "high"], names)

    def test_every_takes_each_nth_cycle(self):
        _, rows = self.table("sine", "--pre", "0ms", "--post", "50ms", "--every", "10")
        self.assertEqual(5, len(rows))

    def test_measurements_and_picture(self):
        out = self.good(
            "scope",
            "square",
            "sine",
            "--trigger",
            "sine > 0",
            "--pre",
            "50ms",
            "--post",
            "150ms",
            "--svg",
            "wave.svg",
        )
        row = next(line.split() for line in out.splitlines()[1:] if line.startswith("sine"))
        self.assertEqual("sine > 0", out.splitlines()[0])
        self.assertAlmostEqual(50, float(row[6]), delta=2.5)  # Hz; a busy host takes cycles from it
        self.assertAlmostEqual(2**0.5, float(row[5]), delta=0.02)  # rms
        picture = (self.folder / "wave.svg").read_text()
        for text in (
            ">sine > 0<".replace("> 0", "&gt; 0"),
            ">square<",
            "time [ms], 0: trigger",
            "frequency",
        ):
            self.assertIn(text, picture)

    @unittest.skipUnless(shutil.which("rsvg-convert"), "librsvg2-bin is not installed")
    def test_png(self):
        self.good("scope", "sine", "--png", "wave.png")
        self.assertEqual(b"\x89PNG\r\n\x1a\n", (self.folder / "wave.png").read_bytes()[:8])

    def test_png_without_rsvg_names_the_package(self):
        error = self.bad(
            "scope", "sine", "--png", "wave.png", environment={"PATH": str(self.folder)}
        )
        self.assertEqual(
            "hal scope: cannot draw 'wave.png': cannot find the program rsvg-convert; type: sudo apt install librsvg2-bin "
            "(or write a .svg file: --svg FILE)\n",
            error,
        )

    def test_without_a_file_the_picture_is_printed(self):
        out = self.good("scope", "sine", "--trigger", "sine > 0", "--post", "30ms")
        self.assertIn("trigger sine > 0", out)
        self.assertIn("min -2  max 2", out)
        self.assertGreater(sum(out.count(chr(0x2800 + i)) for i in range(1, 256)), 100)

    def test_no_trigger_names_the_range_of_the_source(self):
        error = self.bad(
            "scope", "sine", "--trigger", "sine > 5", "--timeout", "300ms", "--csv", "x.csv"
        )
        self.assertRegex(
            error,
            r"^hal scope: no trigger 'sine > 5' in 300 ms: sine was between -2 and 2; type another level, or a longer --timeout\n$",
        )
        self.assertFalse((self.folder / "x.csv").exists())

    def test_errors(self):
        self.assertIn("'nothing'", self.bad("scope", "nothing"))
        self.assertIn(
            "'much' is not a number", self.bad("scope", "sine", "--trigger", "sine > much")
        )
        self.assertEqual(
            "hal scope: 'sine' is not a bit: the trigger needs a level; type: --trigger 'sine > 0'\n",
            self.bad("scope", "sine", "--trigger", "sine"),
        )
        self.assertEqual(
            "hal scope: invalid --mode 'some'; type: --mode auto, normal, single or roll\n",
            self.bad("scope", "sine", "--mode", "some"),
        )
        self.assertEqual(
            "hal scope: --mode is for the terminal: a file gets the first record; leave --mode out\n",
            self.bad("scope", "sine", "--mode", "roll", "--csv", "-"),
        )

    def test_nothing_running_is_reported(self):
        self.shell("stop")
        error = self.bad("scope", "sine", "--trigger", "sine > 0", "--timeout", "200ms")
        self.assertRegex(error, r"no (sample|trigger)")


class Screen(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", MACHINE))

    def scope(self, *words):
        return Terminal(self, "scope", *words)

    def test_keys_change_what_is_shown_and_the_terminal_is_restored(self):
        terminal = self.scope("sine", "position", "--trigger", "sine > 0")
        terminal.expect("\x1b[?1049h")
        terminal.expect("auto")
        terminal.expect("trigger sine > 0")
        terminal.expect("min -2")
        terminal.send("n")
        terminal.expect("normal")
        terminal.send("t")
        terminal.expect("trigger sine < 0")
        terminal.send("]")
        terminal.expect("20 ms/div")
        terminal.send("c\x1b[C")
        terminal.expect("cursors: t1")
        terminal.send("?")
        terminal.expect("trigger on this channel")
        terminal.send("x")
        terminal.send("w")
        terminal.expect("wrote scope-")
        wait_until(lambda: list(self.folder.glob("scope-*.csv")), "the table is written")
        terminal.send("q")
        self.assertEqual(0, terminal.wait())
        self.assertIn("\x1b[?1049l", terminal.seen)
        self.assertIn("\x1b[?25h", terminal.seen)

    def test_single_stops_after_one_record(self):
        terminal = self.scope("sine", "--trigger", "sine > 0", "--mode", "single")
        terminal.expect("single stopped")
        self.end_with(terminal, "q")

    def end_with(self, terminal, key):
        terminal.send(key)
        self.assertEqual(0, terminal.wait())

    def test_a_signal_restores_the_terminal(self):
        terminal = self.scope("sine")
        terminal.expect("min -2")
        terminal.send("\x03")
        self.assertEqual(0, terminal.wait())
        self.assertIn("\x1b[?1049l", terminal.seen)

    def test_the_end_of_the_machine_is_reported(self):
        terminal = self.scope("sine")
        terminal.expect("min -2")
        self.end(self.machine, signal.SIGKILL)
        self.assertEqual(1, terminal.wait())
        self.assertIn("hal scope: instance 'default' has ended", terminal.seen)


if __name__ == "__main__":
    unittest.main()
