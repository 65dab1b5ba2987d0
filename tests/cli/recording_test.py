# SPDX-License-Identifier: MIT
"""Recordings of values: hal record FILE NAMES, hal sim --record, hal plot, hal replay, and the flight recorder."""

import collections
import csv
import os
import re
import resource
import shutil
import signal
import subprocess
import unittest

from harness import HAL, SERVO, TIMEOUT, Case, needs_package, wait_until

NETLIST = """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
loadrt comp names=above
loadrt sum2 names=offset
setp wave.frequency 5
setp offset.in1 10
addf wave.update servo
addf above servo
addf offset servo
net sine wave.sine => above.in1 offset.in0
net high above.out
net shifted offset.out
"""

# The control of a plant, and the same without the plant: its feedback comes from the recording.
CONTROL = """loadrt pid names=loop
setp loop.Pgain $(GAIN)
setp loop.enable TRUE
net feedback => loop.feedback
net effort loop.output
addf loop.do-pid-calcs servo
"""
PLANT = """loadrt integ names=plant
setp plant.gain 20
net effort => plant.in
net feedback plant.out
addf plant servo
"""


class Simulated(Case):
    def sim(self, text, *words):
        return self.good("sim", self.write("a.hal", text), "-q", *words)

    def rows(self, name="run.csv"):
        with open(self.folder / name, newline="") as file:
            return list(csv.reader(file))

    def test_a_machine_without_values_cannot_be_recorded(self):
        path = self.write("empty.hal", "# nothing\n")
        self.assertEqual(
            "hal sim: --record: the machine has no values to record\n",
            self.bad("sim", "-q", path, "--for", "5ms", "--record", "run.csv"),
        )

    def test_every_cycle_is_in_the_table(self):
        self.sim(NETLIST, "--for", "50ms", "--record", "run.csv", "--values", "sine,high")
        rows = self.rows()
        self.assertEqual(["time_s", "high", "sine"], rows[0])
        self.assertEqual(50, len(rows) - 1)
        for row in rows[1:]:
            self.assertEqual(row[1], "1" if float(row[2]) > 0 else "0")

    def test_every_cycle_of_slow_threads_is_in_the_table(self):
        slow = "newthread slow 1000000000\nnewthread slower 3000000000\nloadrt siggen names=g,h\naddf g.update slow\naddf h.update slower\n"
        self.sim(slow, "--cycles", "1000", "--record", "run.csv", "--values", "g.sine,h.sine")
        self.assertEqual(1000, sum(row[1] != "" for row in self.rows()) - 1)
        self.assertEqual(333, sum(row[2] != "" for row in self.rows()) - 1)

    def test_many_values_of_a_fast_thread_need_little_memory(self):
        self.sim(
            "newthread fast 20000\nloadrt siggen names=g\nloadrt mux16 count=120\naddf g.update fast\n",
            "--for",
            "300ms",
            "--record",
            "run.mcap",
            "--values",
            "mux16.*",
        )

    def test_the_same_netlist_gives_the_same_file(self):
        self.sim(NETLIST, "--for", "3s", "--record", "b.mcap", "--name", "x")
        self.sim(NETLIST, "--for", "3s", "--record", "c.mcap", "--name", "x")
        self.assertEqual(
            (self.folder / "b.mcap").read_bytes(), (self.folder / "c.mcap").read_bytes()
        )

    @needs_package("canopen")
    def test_messages_of_a_bus_are_in_the_recording(self):
        self.write(
            "a.canopen",
            "[bus]\nlink = sim:bus\nbitrate = 1M\nsync = 10ms\n[node 3 io]\ndevice = cia401\nheartbeat = 20ms\n",
        )
        netlist = self.write(
            "a.hal",
            """loadrt threads name1=bus period1=1000000
loadrt canopen config=a.canopen
loadrt canopen_io names=io link=sim:bus id=3 faults=emcy-storm
addf canopen.0.receive bus
addf canopen.0.transmit bus
addf io.update bus
setp io.fault-emcy-storm-ms 500
setp io.fault-emcy-storm 1
""",
        )
        done = self.run_program(
            "sim",
            netlist,
            "-q",
            "--for",
            "2s",
            "--record",
            "run.mcap",
            "--values",
            "canopen.0.operational",
        )
        self.assertEqual(0, done.returncode, done.stderr)
        self.good("plot", "run.mcap", "canopen.0.operational")
        titles = re.findall("<title>(.*?)</title>", (self.folder / "run.svg").read_text())
        self.assertIn(
            "message: canopen.0: node 3 (io): emergency 0xFF00 (device specific), error register 0x81",
            titles,
        )

    def test_words(self):
        self.write("a.hal", NETLIST)
        self.assertIn("--record needs --for TIME", self.bad("sim", "a.hal", "--record", "x.mcap"))
        self.assertIn(
            "name the file .mcap or .csv",
            self.bad("sim", "a.hal", "--for", "1s", "--record", "x.bag"),
        )
        self.assertIn(
            "No such file", self.bad("sim", "a.hal", "--for", "1s", "--record", "nowhere/x.mcap")
        )
        (self.folder / "folder.mcap").mkdir()
        self.assertEqual(
            "hal sim: cannot write 'folder.mcap': it is a folder; name a file in it\n",
            self.bad("sim", "a.hal", "--for", "1s", "--record", "folder.mcap"),
        )
        for name in ("sine,sin", "sin"):
            self.assertEqual(
                "hal sim: --values: no pin, parameter or signal matches 'sin'; did you mean 'sine'?\n",
                self.bad(
                    "sim", "a.hal", "-q", "--for", "1s", "--record", "x.mcap", "--values", name
                ),
            )
        self.assertFalse((self.folder / "x.mcap").exists())
        self.assertIn("cannot read 'x.mcap': No such file", self.bad("plot", "x.mcap"))
        self.assertIn("missing netlist", self.bad("replay", "x.mcap"))

    def test_values_that_cannot_be_recorded_are_rejected_before_anything_runs(self):
        self.write("a.hal", NETLIST + "loadrt sum2 count=500\nstart\nprint started\n")
        record = {"sim": ("--for", "1s", "--record", "x.mcap"), "run": ("--journal", "x.mcap")}
        for command, options in record.items():
            for name, reason in (
                (
                    "sum2.*",
                    "4500 values are more than the 4096 that a probe can sample; name fewer",
                ),
                ("sin", "no pin, parameter or signal matches 'sin'; did you mean 'sine'?"),
            ):
                self.assertEqual(
                    f"hal {command}: --values: {reason}\n",
                    self.bad(command, "a.hal", *options, "--values", name),
                )
                self.assertEqual(["a.hal"], sorted(os.listdir(self.folder)))

    def test_more_values_than_a_probe_has_are_rejected_before_anything_runs(self):
        self.write("a.hal", NETLIST + "loadrt sum2 count=900\nstart\nprint started\n")
        self.assertRegex(
            self.bad("sim", "a.hal", "--for", "1s", "--record", "x.mcap"),
            r"^hal sim: --record: \d+ values are more than the 4096 that a probe can sample; name fewer\n$",
        )

    def test_values_that_need_too_much_memory_name_the_option(self):
        executed = "".join(f"addf sum2.{i} fast\n" for i in range(100))
        self.write("a.hal", f"newthread fast 50000\nloadrt sum2 count=100\n{executed}start\n")
        self.assertRegex(
            self.bad("run", "a.hal", "--journal", "x.mcap", "--values", "sum2.*"),
            r"^hal run: --values: the probe needs up to 550 MiB of memory, more than 64; choose "
            r"fewer with --values\nx\.mcap: \d+ cycles\n$",
        )

    def test_a_netlist_that_can_be_read_only_once_is_recorded(self):
        for values in (["--values", "sine"], []):
            record = ["--for", "10ms", "-q", "--record", "x.csv", *values]
            self.good("sim", "/dev/stdin", *record, given=NETLIST)
            self.assertEqual(11, len(self.rows("x.csv")))

    def test_a_plot_has_the_values_it_was_asked_for(self):
        self.sim(NETLIST, "--for", "1s", "--record", "run.mcap")
        self.assertEqual("run.svg\n", self.good("plot", "run.mcap", "sine", "high"))
        svg = (self.folder / "run.svg").read_text()
        self.assertIn(">sine</text>", svg)
        self.assertIn(">high</text>", svg)
        self.assertNotIn("shifted", svg)
        self.assertLess(len(svg), 200_000)
        self.assertIn("did you mean 'sine'?", self.bad("plot", "run.mcap", "sin"))
        self.assertIn(
            "--from is after the end", self.bad("plot", "run.mcap", "sine", "--from", "5s")
        )
        self.assertIn(
            "<svg",
            self.good("plot", "run.mcap", "sine", "-o", "-", "--from", "200ms", "--for", "100ms"),
        )

    def test_a_replay_of_the_same_control_is_equal(self):
        whole = "loadrt threads name1=servo period1=1000000\n" + PLANT + CONTROL
        self.write("whole.hal", whole + "setp loop.command 1\n")
        self.write(
            "control.hal",
            "loadrt threads name1=servo period1=1000000\n" + CONTROL + "setp loop.command 1\n",
        )
        self.good(
            "sim",
            "whole.hal",
            "-q",
            "--for",
            "500ms",
            "--record",
            "run.mcap",
            "--values",
            "effort,feedback",
            "--",
            "GAIN=1",
        )
        out = self.good("replay", "run.mcap", "control.hal", "--tolerance", "1e-9", "--", "GAIN=1")
        self.assertRegex(
            out,
            r"effort  equal in 500 rows\n0\.499 s of recording: 1 input driven, 1 value compared, none differs\n",
        )
        out = self.bad_output(
            "replay", "run.mcap", "control.hal", "--tolerance", "1e-9", "--", "GAIN=2"
        )
        self.assertRegex(out, r"effort  differs by up to 1: 2 instead of 1 at 0\.\d+ s\n")
        self.assertIn("1 differs by more than 1e-09", out)
        self.assertIn(
            "nothing of the recording is an input",
            self.bad("replay", "run.mcap", "whole.hal", "--", "GAIN=1"),
        )

    def test_a_replay_of_two_threads_is_equal(self):
        threads = "loadrt threads name1=fast period1=1000000 name2=slow period2=10000000\n"
        control = (
            CONTROL.replace("servo", "fast").replace("$(GAIN)", "20")
            + "loadrt lowpass names=filter\nsetp filter.gain 0.1\n"
            "net command => loop.command\nnet feedback => filter.in\nnet slowly filter.out\naddf filter slow\n"
        )
        source = (
            "loadrt siggen names=target\nsetp target.frequency 2\nnet command target.sine\n"
            "addf target.update slow\n"
        )
        self.write("whole.hal", threads + PLANT.replace("servo", "fast") + source + control)
        self.write("control.hal", threads + control)
        self.write("late.hal", threads + control + "start\nadvance 3ms\n")
        for ending in "csv", "mcap":
            run = f"run.{ending}"
            values = "command,effort,feedback,slowly"
            self.good("sim", "whole.hal", "-q", "--for", "1s", "--record", run, "--values", values)
            for netlist in "control.hal", "late.hal":
                self.assertRegex(
                    self.good("replay", run, netlist, "--tolerance", "1e-9"),
                    r"effort +equal in \d+ rows\n(.|\n)*: 2 inputs driven, 2 values compared, none differs\n$",
                )
                self.assertRegex(self.good("replay", run, netlist), r"slowly +equal in \d+ rows\n")
        # a recording that began between two cycles of the slow thread
        rows = (self.folder / "run.csv").read_text().splitlines(keepends=True)
        (self.folder / "later.csv").write_text("".join([rows[0], *rows[25:]]))
        out = self.good("replay", "later.csv", "control.hal")
        self.assertNotIn("no row at the same time", out)

    def test_a_replay_of_two_threads_of_equal_period_is_equal(self):
        threads = "newthread one 1000000\nnewthread two 1000000\n"
        plant = (
            "loadrt integ names=early,late\nnet command early.in late.in\nnet first early.out\n"
            "net second late.out\naddf early one\naddf late two\n"
        )
        source = (
            "loadrt siggen names=target\nnet command target.sine\naddf target.update two\n"
            "net other target.cosine\n"
        )
        self.write("whole.hal", threads + source + plant)
        self.write("plant.hal", threads + plant)
        for ending in "csv", "mcap":
            # the thread of `command` computes a value of the netlist, or the other thread does
            for values in "command,first,second", "command,first":
                run = f"run.{ending}"
                self.good(
                    "sim", "whole.hal", "-q", "--for", "1s", "--record", run, "--values", values
                )
                out = self.good("replay", run, "plant.hal", "--tolerance", "1e-9")
                self.assertIn("first   equal" if "second" in values else "first  equal", out)
        self.good(
            "sim", "whole.hal", "-q", "--for", "1s", "--record", "run.csv", "--values", "command"
        )
        guess = self.run_program("replay", "run.csv", "plant.hal")
        self.assertIn(
            "the recording does not name the thread of 'command', and several have the period of "
            "its rows; it is played in 'one'. To choose another thread, type: --thread NAME",
            guess.stderr,
        )
        chosen = self.run_program("replay", "run.csv", "plant.hal", "--thread", "two")
        self.assertEqual(chosen.stderr, "")

    def test_what_is_missing_of_a_recording_is_reported(self):
        threads = "loadrt threads name1=servo period1=1000000\n"
        self.write("whole.hal", threads + PLANT + CONTROL + "setp loop.command 1\n")
        self.write("control.hal", threads + CONTROL + "setp loop.command 1\n")
        for ending in "csv", "mcap":
            self.good(
                "sim",
                "whole.hal",
                "-q",
                "--for",
                "3s",
                "--record",
                f"whole.{ending}",
                "--values",
                "effort,feedback",
                "--",
                "GAIN=1",
            )
        whole = (self.folder / "whole.csv").read_bytes()
        rows = whole.splitlines(keepends=True)
        (self.folder / "cut.csv").write_bytes(b"".join(rows[:101]) + rows[101][:8])
        whole = (self.folder / "whole.mcap").read_bytes()
        (self.folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
        sentences = {
            "cut.csv": r"'cut\.csv', line 102: the line is cut off; rows after 0\.099 s are missing, of effort, feedback",
            "cut.mcap": r"'cut\.mcap' ends without a summary; rows after 0\.999 s are missing, of '/hal/servo' \(effort, feedback\)",
        }
        for name, sentence in sentences.items():
            done = self.run_program("replay", name, "control.hal", "--", "GAIN=1")
            self.assertEqual(0, done.returncode)
            self.assertRegex(done.stderr, rf"^hal replay: {sentence}\n$")
            self.assertRegex(
                done.stdout, r" equal in \d+ rows\n0\.\d+ s of an incomplete recording: "
            )
            self.write(
                "play.hal", threads + f"loadrt playback file={name}\naddf playback.0.update servo\n"
            )
            for words in ("check", "play.hal"), ("sim", "play.hal", "--for", "1ms"):
                done = self.run_program(*words)
                self.assertEqual(0, done.returncode)
                self.assertRegex(
                    done.stderr,
                    rf"^play\.hal:2:8: warning: {sentence} \[incomplete-recording\]\n",
                )
                self.assertIn("help: what it has is played\n", done.stderr)
            self.assertRegex(self.run_program("plot", name).stderr, sentence)

    def test_two_runs_of_one_netlist_give_the_same_file(self):
        self.write("a.hal", SERVO + "start\n")
        contents = []
        for ending in ("mcap", "csv"):
            for name in ("one", "two"):
                self.good("sim", "a.hal", "--for", "100ms", "-q", "--record", f"{name}.{ending}")
                contents.append((self.folder / f"{name}.{ending}").read_bytes())
            self.assertEqual(*contents[-2:])

    def test_a_replay_of_a_table_has_the_types_of_the_netlist(self):
        logic = "loadrt threads name1=servo period1=1000000\nloadrt and2 names=both\nloadrt conv_s32_float names=to\naddf both servo\naddf to servo\nnet a => both.in0\nnet b => both.in1\nnet y both.out\nnet n => to.in\nnet x to.out\n"
        self.write("logic.hal", logic)
        self.write(
            "run.csv",
            "time_s,a,b,y,n,x\n"
            + "".join(
                f"{0.001 * i:.3f},{i & 1},{i >> 1 & 1},{int(i & 3 == 3)},{-i},{-i}\n"
                for i in range(1, 101)
            ),
        )
        out = self.good("replay", "run.csv", "logic.hal", "--tolerance", "0")
        self.assertRegex(
            out,
            r"^y  equal in 100 rows\nx  equal in 100 rows\n0\.099 s of recording: 3 inputs driven, 2 values compared, none differs\n$",
        )
        self.write("bad.csv", "time_s,a,b\n0.001,0,0\n0.002,0.5,0\n")
        self.assertEqual(
            "hal replay: 'bad.csv', line 3: '0.5' of 'a' is not a value of type bit\n",
            self.bad("replay", "bad.csv", "logic.hal"),
        )

    def test_a_gap_in_the_recording_is_reported_before_it_is_replayed(self):
        self.write("gap.hal", "loadrt threads name1=servo period1=1000000\nnewsig a float\n")
        self.write("gap.csv", "time_s,a\n0,1\n0.001,2\n1000000000,3\n")
        replay = subprocess.Popen(
            [str(HAL), "replay", "gap.csv", "gap.hal"],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, replay)
        self.assertEqual(
            "hal replay: the recording has no row between 0.001 s and 1e+09 s, and the netlist runs "
            "all that time; to end before the gap, type: --for 0.001000s\n",
            replay.stderr.readline(),
        )
        self.assertRegex(
            replay.stderr.readline(),
            r"^hal replay: \S+ s of 1e\+09 s replayed; Ctrl-C ends it with a report\n$",
        )
        replay.send_signal(signal.SIGINT)
        out, _ = replay.communicate(timeout=60)
        self.assertEqual(1, replay.returncode)
        self.assertIn("interrupted after", out)
        done = self.run_program("replay", "gap.csv", "gap.hal", "--for", "0.001000s")
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)

    def test_a_test_that_tests_nothing_fails(self):
        self.write(
            "control.hal",
            "loadrt threads name1=servo period1=1000000\nsetp loop.command 1\n".replace(
                "setp", CONTROL + "setp"
            ),
        )
        self.write("run.csv", "time_s,feedback,effort\n0.001,0,nan\n0.002,0,1\n0.003,0,1\n")
        words = ("replay", "run.csv", "control.hal")
        self.assertIn(
            "--tolerance: nan is not a finite number; see: hal help replay",
            self.bad(*words, "--tolerance", "nan", "--", "GAIN=1"),
        )
        self.assertEqual(
            "0.002 s of recording: 1 input driven, 0 values compared: nothing was tested; record values that the netlist computes too\n",
            self.bad_output(*words, "--tolerance", "1", "--names", "feedback", "--", "GAIN=1"),
        )
        self.assertEqual(
            "hal replay: --names: the recording has no value 'efort'; did you mean 'effort'?\n",
            self.bad(*words, "--names", "feedback,efort", "--", "GAIN=1"),
        )
        self.assertIn(
            "effort  differs by up to inf: 1 instead of nan at 0.000000 s\n",
            self.bad_output(*words, "--tolerance", "1", "--", "GAIN=1"),
        )

    def test_a_plot_of_what_the_scope_wrote_and_of_the_largest_values(self):
        self.write("scope.csv", "time_s,a\n-0.002,1\n-0.001,-1\n0.000,1\n")
        self.good("plot", "scope.csv")
        self.assertIn(">-1</text>", (self.folder / "scope.svg").read_text())
        self.write(
            "large.csv", "time_s,a,b\n0,-1e308,1e17\n1,1.7e308,100000000000000016\n2,0,1e17\n"
        )
        self.good("plot", "large.csv")
        svg = (self.folder / "large.svg").read_text()
        self.assertNotRegex(svg, "nan|inf")
        self.assertIn(">1e+308</text>", svg)
        self.assertEqual(2, svg.count('fill="none" stroke="#999"'), "each has a strip of its own")

    def test_values_of_other_sizes_have_a_scale_of_their_own(self):
        self.write(
            "run.csv",
            "time_s,a,b,small,zero\n"
            + "".join(f"{i},{i % 7},{i % 5 - 2},{(i % 3) * 0.01},0\n" for i in range(20)),
        )
        self.good("plot", "run.csv")
        svg = (self.folder / "run.svg").read_text()
        self.assertEqual(2, svg.count('fill="none" stroke="#999"'))
        y = {
            name: re.search(rf'y="([\d.]+)"[^>]*>{name}</text>', svg)[1]
            for name in ("a", "b", "small", "zero")
        }
        self.assertEqual(y["a"], y["b"])
        self.assertEqual(y["a"], y["zero"])
        self.assertNotEqual(y["a"], y["small"])

    def test_a_plot_of_too_many_values_asks_for_names(self):
        names = [f"v{i}" for i in range(25)]
        self.write(
            "run.csv",
            f"time_s,{','.join(names)}\n" + "".join(f"{i}{',1' * 25}\n" for i in range(2)),
        )
        self.assertEqual(
            "hal plot: 25 values are too many for one picture (limit 24); name some: hal plot FILE NAME…\n",
            self.bad("plot", "run.csv"),
        )
        self.good("plot", "run.csv", "v1*")

    def test_the_ending_of_a_plot(self):
        self.write("run.csv", "time_s,a\n0,1\n1,2\n")
        self.assertEqual(
            "hal plot: unknown format of 'x.jpg'; name the file .svg or .png\n",
            self.bad("plot", "run.csv", "-o", "x.jpg"),
        )
        if shutil.which("rsvg-convert"):
            self.good("plot", "run.csv", "-o", "x.png")
            self.assertEqual(b"\x89PNG", (self.folder / "x.png").read_bytes()[:4])
        error = self.bad("plot", "run.csv", "-o", "y.png", environment={"PATH": str(self.folder)})
        self.assertIn("cannot draw 'y.png': ", error)
        self.assertIn("(or name the file .svg)", error)
        self.assertFalse((self.folder / "y.png").exists())

    def bad_output(self, *words):
        done = self.run_program(*words)
        self.assertEqual(1, done.returncode, done.stderr)
        return done.stdout


class Live(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", NETLIST + "start\n"))

    def recorder(self, *words):
        process = subprocess.Popen(
            [str(HAL), "record", *words],
            env=self.environment,
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, process)
        return process

    def times(self, name):
        with open(self.folder / name, newline="") as file:
            return [float(row[0]) for row in list(csv.reader(file))[1:]]

    def test_a_group_is_an_instance_a_component_a_thread_or_a_file(self):
        def columns(*words):
            self.good("record", "group.csv", *words, "--for", "20ms")
            with open(self.folder / "group.csv", newline="") as file:
                return next(csv.reader(file))[1:]

        self.assertEqual(
            ["above.equal", "above.in0", "sine", "high", "above.hyst"],
            [name for name in columns("--group", "above") if "time" not in name],
        )
        self.assertIn("offset.in1", columns("--group", "sum2"))
        self.assertNotIn("offset.in1", columns("--group", "above"))
        self.assertTrue(
            {"offset.in1", "shifted", "above.hyst"}
            <= set(columns("--group", "offset", "--group", "above"))
        )
        for group in ("servo", "a.hal", str(self.folder / "a.hal")):
            self.assertTrue(
                {"offset.in1", "shifted", "sine", "high"} <= set(columns("--group", group)), group
            )
        self.assertEqual(
            "hal record: --group: 'abov' is not a component, an instance, a thread or a netlist file with values; hal shell show all lists them\n",
            self.bad("record", "group.csv", "--group", "abov"),
        )
        self.assertEqual(
            "hal record: --all has every --group; leave one out\n",
            self.bad("record", "group.csv", "--all", "--group", "above"),
        )

    def test_a_running_machine_is_recorded_without_a_sampler(self):
        out = self.good("record", "run.csv", "sine", "wave.*", "servo.missed", "--for", "300ms")
        self.assertRegex(
            out, r"^run\.csv: \d+ rows of \d+ values, \d+\.\d kB(, \d+ rows? lost)?\n$"
        )
        with open(self.folder / "run.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), int(out.split()[1]))
        lost = int(out.split()[-3]) if "lost" in out else 0
        cycles = [round(float(row["time_s"]) * 1000) for row in rows]
        missed = [int(row["servo.missed"]) for row in rows]
        self.assertEqual(sorted(set(cycles)), cycles)
        # A busy host: the machine counts the periods that it missed, and the recording the rows that it lost.
        gaps = cycles[-1] - cycles[0] + 1 - len(rows)
        self.assertIn(gaps - (missed[-1] - missed[0]), range(lost + 1))
        self.assertLessEqual(len(rows) + gaps, 300)
        if len(rows) + gaps < 300 and lost == 0:
            self.assertGreater(
                int(self.value("servo.missed")), missed[-1], "the last periods were missed"
            )

    def test_a_file_is_complete_after_ctrl_c(self):
        process = self.recorder("run.mcap", "--all")
        wait_until((self.folder / "run.mcap.part").exists, "the file is begun")
        self.shell("setp", "wave.amplitude", "2")
        wait_until(
            lambda: (self.folder / "run.mcap.part").stat().st_size > 1000
            or process.poll() is not None,
            "something is written",
        )
        out, err = self.end(process, signal.SIGINT)
        self.assertEqual((0, ""), (process.returncode, err))
        self.assertRegex(out, r"^run\.mcap: ")
        self.assertIn(b"setp wave.amplitude 2", self.expanded("run.mcap"))

    def expanded(self, name):
        """What the recording's events are, by the picture: titles of its marks."""
        self.good("plot", name, "sine")
        return (self.folder / name.replace(".mcap", ".svg")).read_bytes()

    def test_a_machine_that_ends_repeats_no_row(self):
        process = self.recorder("run.csv", "wave.sawtooth", "servo.missed")
        recorded = self.folder / "run.csv"
        wait_until(lambda: recorded.exists() and recorded.stat().st_size > 0, "rows are written")
        self.end(self.machine, signal.SIGINT)
        process.communicate(timeout=TIMEOUT)
        with open(self.folder / "run.csv", newline="") as file:
            values = [row[1] for row in list(csv.reader(file))[1:]]
        repeated = [after for before, after in zip(values, values[1:]) if before == after]
        self.assertEqual(repeated, [], "each cycle that ran computes another value")

    def test_every_nth_cycle_and_rotation(self):
        out = self.good(
            "record",
            "run.csv",
            "sine",
            "--every",
            "10",
            "--for",
            "900ms",
            "--rotate",
            "300ms",
            "--keep",
            "2",
        )
        self.assertGreaterEqual(len(out.splitlines()), 3)
        kept = sorted(path.name for path in self.folder.glob("run-*.csv"))
        self.assertEqual(2, len(kept), kept)
        times = self.times(kept[-1])
        # A row comes later when the machine misses its cycle; the others stay on the grid.
        on_grid = collections.Counter(round(time * 1000) % 10 for time in times).most_common(1)[0][
            1
        ]
        self.assertLessEqual(len(times) - on_grid, int(self.value("servo.missed")), times)

    def test_size_limit(self):
        self.assertRegex(
            self.good("record", "run.csv", "sine", "--limit", "0.02"), r"^run\.csv: \d+ rows"
        )

    def test_a_flight_recorder_writes_at_a_trigger(self):
        self.shell("newsig", "crash", "bit")
        process = self.recorder(
            "box.csv", "sine", "--last", "200ms", "--after", "100ms", "--trigger", "crash"
        )
        self.good("record", "wait.csv", "sine", "--for", "400ms")
        self.assertEqual([], list(self.folder.glob("box-*")))
        self.shell("sets", "crash", "TRUE")
        name = wait_until(
            lambda: [path.name for path in self.folder.glob("box-*.csv")], "the trigger has written"
        )[0]
        self.assertRegex(name, r"^box-\d{8}T\d{6}Z-crash-001\.csv$")
        self.end(process, signal.SIGINT)
        times = self.times(name)
        self.assertAlmostEqual(0.3, times[-1] - times[0], delta=0.06)

    def test_a_flight_recorder_writes_when_the_machine_dies(self):
        process = self.recorder("box.csv", "sine", "--last", "200ms")
        self.good("record", "wait.csv", "sine", "--for", "400ms")
        self.machine.kill()
        out, _ = process.communicate(timeout=60)
        self.assertEqual(0, process.returncode)
        self.assertRegex(out, r"^box-\d{8}T\d{6}Z-end-of-machine-001\.csv: \d+ rows")

    def test_a_full_disk_ends_with_a_readable_file(self):
        def small():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))

        done = subprocess.run(
            [str(HAL), "record", "run.mcap", "sine", "shifted"],
            env=self.environment,
            cwd=self.folder,
            preexec_fn=small,
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(1, done.returncode)
        self.assertRegex(
            done.stderr,
            r"^hal record: cannot write 'run\.mcap': File too large; the file is complete up to there\n$",
        )
        self.good("plot", "run.mcap", "sine")

    def test_thousands_of_values_are_recorded_up_to_a_limit(self):
        def machine(name, count):
            large = (
                f"loadrt threads name1=servo period1=1000000\nloadrt siggen count={count}\n"
                + "".join(f"addf siggen.{i}.update servo\n" for i in range(count))
            )
            self.start("run", self.write(f"{name}.hal", large), "--name", name, instance=name)

        machine("big", 250)
        out = self.good("record", "big.csv", "--name", "big", "--all", "--for", "100ms")
        rows, values = int(out.split()[1]), int(out.split()[4])
        self.assertGreater(values, 2500)
        lost = int(out.split()[-3]) if "lost" in out else 0
        self.assertGreaterEqual(rows + lost, 80)
        machine("huge", 400)
        self.assertRegex(
            self.bad("record", "huge.csv", "--name", "huge", "--all", "--for", "100ms"),
            r"^hal record: \d{4} values are more than 4096; name fewer, or type --group NAME\n$",
        )

    def test_two_recorders_do_not_share_a_file(self):
        for name in ("run.mcap", "run.csv"):
            first = self.recorder(name, "sine")
            wait_until(
                lambda: any(path.stat().st_size > 0 for path in self.folder.glob(f"{name}*")),
                "the file is begun",
            )
            self.assertEqual(
                f"hal record: cannot write '{name}': another recorder is writing it; end that one, or name another file\n",
                self.bad("record", name, "sine", "--for", "100ms"),
            )
            out, err = self.end(first, signal.SIGINT)
            self.assertEqual((0, ""), (first.returncode, err))
            self.assertRegex(out, rf"^{re.escape(name)}: \d+ rows of 1 value")
            self.good("plot", name, "sine")

    def test_what_a_killed_recorder_left_is_kept(self):
        left = self.recorder("run.mcap", "sine")
        wait_until(
            lambda: (self.folder / "run.mcap.part").exists()
            and (self.folder / "run.mcap.part").stat().st_size > 3000,
            "a chunk is written",
        )
        left.kill()
        left.communicate()
        before = (self.folder / "run.mcap.part").read_bytes()
        out = self.good("record", "run.mcap", "sine", "--for", "100ms")
        self.assertTrue(
            out.startswith(
                "'run.mcap.part' was left by a recorder that was killed; it is now 'run-unfinished-001.mcap'\n"
            ),
            out,
        )
        self.assertEqual(before, (self.folder / "run-unfinished-001.mcap").read_bytes())
        self.assertIn(
            "ends without a summary", self.run_program("plot", "run-unfinished-001.mcap").stderr
        )
        self.assertIn("<svg", (self.folder / "run-unfinished-001.svg").read_text())
        self.assertFalse((self.folder / "run.mcap.part").exists())

    def test_the_destination_is_checked_at_the_start(self):
        (self.folder / "folder.mcap").mkdir()
        os.mkfifo(self.folder / "pipe.mcap")
        for last in ([], ["--last", "10s"]):
            self.assertEqual(
                "hal record: cannot write 'nowhere/x.mcap': No such file or directory\n",
                self.bad("record", "nowhere/x.mcap", "sine", *last),
            )
            self.assertEqual(
                "hal record: cannot write 'folder.mcap': it is a folder; name a file in it\n",
                self.bad("record", "folder.mcap", "sine", *last),
            )
            self.assertEqual(
                "hal record: cannot write 'pipe.mcap': it is a pipe or a device; name a file\n",
                self.bad("record", "pipe.mcap", "sine", *last),
            )
        self.assertTrue((self.folder / "pipe.mcap").is_fifo())

    def test_a_link_is_followed(self):
        (self.folder / "big").mkdir()
        for name in ("run.mcap", "run.csv"):
            (self.folder / name).symlink_to(f"big/{name}")
            self.good("record", name, "sine", "--for", "100ms")
            self.assertTrue((self.folder / name).is_symlink())
            self.assertGreater((self.folder / "big" / name).stat().st_size, 1000)
        self.assertEqual(
            ["run.csv", "run.mcap"], sorted(path.name for path in (self.folder / "big").iterdir())
        )

    def test_the_machine_is_killed(self):
        process = self.recorder("run.mcap", "sine")
        wait_until((self.folder / "run.mcap.part").exists, "the file is begun")
        self.machine.kill()
        out, err = process.communicate(timeout=60)
        self.assertEqual(
            (1, "hal record: instance 'default' was killed; the file is complete up to there\n"),
            (process.returncode, err),
        )
        self.assertRegex(out, r"^run\.mcap: \d+ rows? of 1 value")

    def test_the_machine_is_killed_and_another_program_removes_its_socket(self):
        process = self.recorder("run.mcap", "sine")
        wait_until((self.folder / "run.mcap.part").exists, "the file is begun")
        process.send_signal(signal.SIGSTOP)
        self.machine.kill()
        self.machine.wait(60)
        self.assertEqual(1, self.run_program("shell", "getp", "sine").returncode)
        self.assertFalse((self.folder / "halcyon" / "default.sock").exists())
        process.send_signal(signal.SIGCONT)
        self.assertEqual(
            (1, "hal record: instance 'default' was killed; the file is complete up to there\n"),
            (process.wait(60), process.stderr.read()),
        )

    def test_a_trigger_that_never_fires_is_told(self):
        self.shell("newsig", "crash", "bit")
        self.assertEqual(
            "nothing was written: there was no fault, and 'crash' did not become TRUE or non-zero\n",
            self.good(
                "record", "box.mcap", "sine", "--last", "1s", "--trigger", "crash", "--for", "200ms"
            ),
        )
        self.shell("sets", "crash", "TRUE")
        self.assertEqual(
            "nothing was written: there was no fault, and 'crash' was TRUE or non-zero all the time\n",
            self.good(
                "record", "box.mcap", "sine", "--last", "1s", "--trigger", "crash", "--for", "200ms"
            ),
        )
        self.assertEqual(
            "nothing was written: there was no fault\n",
            self.good("record", "box.mcap", "sine", "--last", "1s", "--for", "200ms"),
        )

    def test_a_disk_without_room_leaves_no_empty_file(self):
        def none():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20, resource.RLIM_INFINITY))

        for name, left in (
            ("run.mcap", "; no row was written, and the file was removed"),
            ("run.csv", "; no row was written: 'run.csv' has none"),
        ):
            done = subprocess.run(
                [str(HAL), "record", name, "sine", "--for", "1s"],
                env=self.environment,
                cwd=self.folder,
                preexec_fn=none,
                capture_output=True,
                text=True,
                timeout=60,
            )
            self.assertEqual(
                (1, "", f"hal record: cannot write '{name}': File too large{left}\n"),
                (done.returncode, done.stdout, done.stderr),
            )
        self.assertEqual([], list(self.folder.glob("run.mcap*")))

    def test_words(self):
        self.assertIn("did you mean 'sine'?", self.bad("record", "run.mcap", "sin"))
        self.assertIn("matches 'zz*'", self.bad("record", "run.mcap", "zz*"))
        self.assertIn("missing names", self.bad("record", "run.mcap"))
        self.assertIn(
            "--trigger needs --last", self.bad("record", "run.mcap", "sine", "--trigger", "high")
        )
        self.assertIn(
            "--after needs --last TIME", self.bad("record", "run.mcap", "sine", "--after", "1s")
        )
        self.assertIn(
            "--keep needs --rotate TIME or --last TIME",
            self.bad("record", "run.mcap", "sine", "--keep", "2"),
        )
        self.assertIn(
            "unknown format of 'run.txt'; name the file .mcap or .csv",
            self.bad("record", "run.txt", "sine"),
        )
        self.assertIn(
            "--limit: -1 is negative; use 0 or more",
            self.bad("record", "run.mcap", "sine", "--limit", "-1"),
        )
        self.assertIn("for a sampler", self.bad("record", "run.mcap", "sine", "--tag"))
        self.assertIn("No such file or directory", self.bad("record", "nowhere/run.mcap", "sine"))


if __name__ == "__main__":
    unittest.main()
