# SPDX-License-Identifier: MIT
"""The journal of a live machine and its exact re-execution: hal run --journal, hal replay --exact."""

import contextlib
import csv
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import unittest

from harness import HAL, PLUGINS, ROOT, SANITIZED, SERVO, TIMEOUT, Case, needs_package, wait_until

# Three threads that read each other: jitter and missed periods decide which cycles they read. The
# execution time of a thread is a value like any other.
MACHINE = """loadrt threads name1=fast period1=500000 name2=servo period2=1000000 name3=slow period3=7000000
loadrt siggen
loadrt pid names=pid.x
loadrt lowpass
loadrt sum2 names=add.0,add.1
loadrt comp names=above
loadrt integ names=plant,drift
loadrt conv_s32_float names=time
addf siggen.0.update fast
addf add.0 fast
addf time fast
addf pid.x.do-pid-calcs servo
addf plant servo
addf above servo
addf lowpass.0 slow
addf add.1 slow
addf drift slow
net sine siggen.0.sine => add.0.in0 pid.x.command above.in0
net sum add.0.out => lowpass.0.in
net smooth lowpass.0.out => add.1.in0 add.0.in1
net effort pid.x.output => plant.in
net position plant.out => pid.x.feedback add.1.in1
net total add.1.out => above.in1
net spent servo.time => time.in
net spent-float time.out => drift.in
setp siggen.0.frequency 3
setp lowpass.0.gain 0.2
setp pid.x.Pgain 4
setp pid.x.enable 1
setp plant.gain 2
start
"""

# Functions of one instance in two threads share its state: the pulses of a shaft and its speed. The
# component faults reads what the supervisor counts.
SHARED = """loadrt threads name1=base period1=200000 name2=servo period2=1000000
loadrt siggen
loadrt sim_encoder names=shaft
loadrt encoder names=turns
loadrt faults
addf sim-encoder.make-pulses base
addf encoder.update-counters base
addf siggen.0.update servo
addf encoder.capture-position servo
addf sim-encoder.update-speed servo
addf faults servo
setp siggen.0.frequency 2
setp siggen.0.amplitude 3
setp turns.position-scale 400
net speed siggen.0.cosine => shaft.speed
net phase-A shaft.phase-A => turns.phase-A
net phase-B shaft.phase-B => turns.phase-B
net phase-Z shaft.phase-Z => turns.phase-Z
"""

UNRECORDED = """loadrt threads name1=servo period1=1000000
loadrt unrecorded
loadrt integ names=sum
addf unrecorded.0 servo
addf sum servo
net value unrecorded.0.out => sum.in
net total sum.out
"""

STREAM = """loadrt threads name1=servo period1=1000000
loadrt streamer
loadrt integ names=sum
addf streamer.0 servo
addf sum servo
net value streamer.0.pin.0 => sum.in
net total sum.out
loadrt sampler depth=200
addf sampler.0 servo
net total sampler.0.pin.0
"""


# The threads may be blocked.
TIMED = """loadrt threads name1=servo period1=1000000 supervise1=off name2=slow period2=5000000 supervise2=off
loadrt siggen names=wave
loadrt sum2 names=sum
loadrt timed names=first file=x
addf wave.update servo
addf sum servo
addf first slow
net sine wave.sine => sum.in0
net total sum.out
start
"""


def edits(count, values):
    """Lines that change the machine while it runs, and as many values."""
    dice = random.Random(34)
    lines = []
    for number in range(count // 4):
        thread = dice.choice(["fast", "servo", "slow"])
        lines += [
            f"loadrt sum2 names=extra.{number}",
            f"net sum => extra.{number}.in0",
            f"addf extra.{number} {thread}",
        ]
        if dice.random() < 0.5:
            lines += ["unlinkp pid.x.feedback", "net position => pid.x.feedback"]
        else:
            lines += [f"delf extra.{number} {thread}", f"unload extra.{number}"]
    lines.insert(len(lines) // 3, "stop")
    lines.insert(len(lines) // 3 + 9, "start")
    lines.insert(len(lines) // 2, "reload lowpass")
    pins = ["siggen.0.frequency", "siggen.0.amplitude", "pid.x.Pgain", "add.0.gain0"]
    for _ in range(values):
        line = f"setp {dice.choice(pins)} {dice.uniform(0, 4):.17g}"
        lines.insert(dice.randrange(len(lines) + 1), line)
    return lines


@contextlib.contextmanager
def load(count):
    """Processes that compete for the CPUs."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


class Program:
    """A program with pins, at the control socket."""

    def __init__(self, folder, declaration):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(TIMEOUT)
        self.socket.connect(str(folder / "halcyon" / "default.sock"))
        self.lines = self.socket.makefile("rb")
        self.lines.readline()
        self.ask(declaration)

    def close(self):
        self.lines.close()
        self.socket.close()

    def ask(self, request):
        self.socket.sendall(json.dumps(request).encode() + b"\n")
        reply = json.loads(self.lines.readline())
        assert reply["ok"], reply
        return reply


class ExactReplay(Case):
    def run_journaled(self, text, *options, name="run.mcap"):
        return self.start("run", self.write("a.hal", text), "--journal", name, *options)

    def give(self, lines):
        done = self.run_program("shell", given="\n".join(lines) + "\n")
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)

    def finish(self, machine):
        out, error = self.end(machine)
        self.assertEqual(0, machine.returncode, out + error)
        return error

    def wait_for_cycles(self, count):
        start = int(self.shell("getp", "servo.threadbeat").stdout)
        wait_until(
            lambda: int(self.shell("getp", "servo.threadbeat").stdout) >= start + count,
            f"{count} cycles",
        )

    def replay(self, *options, name="run.mcap", status=0):
        done = self.run_program("replay", "--exact", name, *options)
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_a_machine_that_is_edited_under_load_is_executed_again(self):
        with load(2):
            machine = self.run_journaled(MACHINE, "--values", "*")
            self.give(edits(200, 1000))
            self.wait_for_cycles(500)
            self.finish(machine)
        text = self.replay()
        found = re.match(r"(\d+) cycles of 3 threads, (\d+) edits and ", text)
        self.assertIsNotNone(found, text)
        self.assertGreater(int(found[1]), 1000)
        self.assertGreater(int(found[2]), 1200)
        self.assertRegex(text, r"\nno difference, \d{5,} values compared\n$")

    def test_values_of_a_journal_without_values_become_a_recording(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(500)
        self.give(["setp siggen.0.frequency 7"])
        self.wait_for_cycles(500)
        self.finish(machine)
        text = self.replay("--record", "out.csv", "--names", "sine,sum,effort", "--show", "sine")
        cycles = int(re.match(r"(\d+) cycles", text)[1])
        self.assertRegex(text, r"out\.csv: \d+ rows of 3 values\n")
        with (self.folder / "out.csv").open() as file:
            rows = list(csv.DictReader(file))
        self.assertEqual({"time_s", "sine", "sum", "effort"}, set(rows[0]))
        sines = [float(row["sine"]) for row in rows if row["sine"]]
        self.assertGreater(len(sines), 2 * 900)  # of the fast thread, each cycle
        self.assertLess(len(rows), cycles + 1)
        self.assertGreater(max(sines), 0.9)
        shown = float(re.search(r"^sine (\S+)$", text, re.M)[1])
        self.assertAlmostEqual(shown, sines[-1], places=6)
        self.replay("--record", "out.mcap", "--names", "sine,sum", "--until", "0.2s")
        self.good("plot", "out.mcap", "sine", "-o", "out.svg")

    def test_a_recording_of_a_journal_needs_known_names_and_a_known_format(self):
        self.finish(self.run_journaled(SERVO))
        text = self.replay("--record", "out.csv", "--names", "nothing", status=1)
        self.assertIn("--record: --names: ", text)
        self.assertIn("'nothing'", text)
        self.assertFalse((self.folder / "out.csv").exists())
        self.assertIn(
            "--record: unknown format of 'out.txt'; name the file .mcap or .csv",
            self.replay("--record", "out.txt", status=1),
        )
        self.assertEqual(
            "hal replay: --record and --shell exclude each other; leave one out\n",
            self.replay("--record", "out.csv", "--shell", status=1),
        )
        self.assertEqual(
            "hal replay: --record: cannot write 'none/out.csv': No such file or directory\n",
            self.replay("--record", "none/out.csv", status=1),
        )

    def test_values_that_a_recording_lacks_because_they_were_loaded_later_are_reported(self):
        machine = self.run_journaled(SERVO + "net early servo.threadbeat\n")
        self.wait_for_cycles(20)
        self.give(["loadrt not names=late", "addf late servo", "net later late.out"])
        self.wait_for_cycles(20)
        self.give(["loadrt and2 names=short"])
        self.wait_for_cycles(20)
        self.give(["unloadrt short"])
        self.wait_for_cycles(20)
        self.finish(machine)
        note = (
            "hal replay: 'out.csv' does not have {} loaded after its first row: {}; to record "
            "more, list each name in --names: the recording then begins when the machine has all "
            "of them\n"
        )
        done = self.run_program("replay", "--exact", "run.mcap", "--record", "out.csv")
        self.assertEqual(
            note.format(
                "12 values",
                "late.in, late.out, late.time, late.tmax, late.tmax-increased, later, short.in0, "
                "short.in1, short.out, … (3 more)",
            ),
            done.stderr,
        )
        words = ("replay", "--exact", "run.mcap", "--record", "out.csv", "--names")
        self.assertEqual(
            note.format(
                "6 values", "late.in, late.out, late.time, late.tmax, late.tmax-increased, later"
            ),
            self.run_program(*words, "[el]a*").stderr,
        )
        done = self.run_program(*words, "early,late.in")
        self.assertEqual("", done.stderr)
        self.assertRegex(done.stdout, r"out\.csv: [1-9]\d+ rows of 2 values\n")
        with (self.folder / "out.csv").open() as file:
            beats = [int(row["early"]) for row in csv.DictReader(file)]
        self.assertGreater(beats[0], 20)
        self.assertEqual(list(range(beats[0], beats[-1] + 1)), beats)

    def test_a_recording_of_a_journal_with_a_slow_thread(self):
        slow = "newthread slow 10000000000\nloadrt integ names=late\naddf late slow\n"
        machine = self.run_journaled(SERVO + slow + "start\n")
        self.wait_for_cycles(300)
        self.finish(machine)
        self.assertRegex(
            self.replay("--record", "out.csv"), r"\nout\.csv: \d{3,} rows of \d\d values\n$"
        )

    def test_a_recording_that_is_not_possible_ends_at_the_first_cycle(self):
        machine = self.run_journaled(SERVO + "loadrt sum2 count=500\nstart\n")
        self.wait_for_cycles(300)
        self.finish(machine)
        done = self.run_program("replay", "--exact", "run.mcap", "--record", "out.csv")
        self.assertRegex(
            done.stderr,
            r"^hal replay: --record: --names: 45\d\d values are more than the 4096 that a probe can "
            r"sample; name fewer\n$",
        )
        found = re.match(
            r"(\d+) cycles? of 1 thread, .* newest: cycle \d+ of 'servo' .*\nstopped; no difference so far\n$",
            done.stdout,
        )
        self.assertIsNotNone(found, done.stdout)
        # an edit may execute several, and a busy host makes the number of the first one larger
        self.assertLess(int(found[1]), 100)
        self.assertEqual(1, done.returncode)

    def test_a_difference_that_no_recorded_value_has_is_named_by_a_later_one(self):
        netlist = SERVO + """loadrt gauge file=number.txt
loadrt integ names=late
newthread slow 50000000
addf gauge.0 servo
addf late slow
net number gauge.0.out => late.in
start
"""
        self.write("number.txt", "5\n")
        machine = self.run_journaled(netlist, "--values", "late.out")
        self.wait_for_cycles(300)
        self.finish(machine)
        self.write("number.txt", "7\n")  # it is read again
        text = self.replay("--anyway", status=1)
        found = re.search(
            r"first difference: cycle \d+ of thread 'servo' at \S+ s has values with another checksum\n"
            r"no recorded value of this cycle or before differs\n(?s:.*)"
            r"first recorded value that differs: 'late.out' \('late' of integ, function 'late'\) in cycle \d+ of "
            r"thread 'slow': 0.35\d* instead of 0.25\n",
            text,
        )
        self.assertIsNotNone(found, text)

    def test_an_edit_that_a_thread_does_not_take_is_rolled_back_again(self):
        mark = lambda name: self.folder / name
        machine = self.run_journaled(TIMED, "--values", "*")
        edit = subprocess.Popen(
            [str(HAL), "shell"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, edit, signal.SIGKILL)
        edit.stdin.write(
            "begin\nloadrt timed names=second file=y waits=1\naddf second servo\n"
            "net count second.out => sum.in1\ncommit\n"
        )
        edit.stdin.close()
        edit.stdin = None
        wait_until(lambda: mark("y.started").exists(), "the instance is started")
        mark("x.hold").touch()
        wait_until(lambda: mark("x.holding").exists(), "the slow thread is in a cycle")
        mark("y.go").touch()
        error = edit.communicate(timeout=TIMEOUT)[1]
        self.assertIn("slow", error)
        mark("x.hold").unlink()
        self.wait_for_cycles(100)
        self.give(["loadrt sum2 names=extra", "addf extra slow", "net sine => extra.in0"])
        self.wait_for_cycles(100)
        self.finish(machine)
        text = self.replay()
        self.assertRegex(text, r"\nno difference, \d{4,} values compared\n$")
        # its state has the memory of the edit that was rolled back; a sanitizer's heap has no state
        reason = "a build with a sanitizer" if SANITIZED else "an edit before it was rolled back"
        self.assertIn(
            f"--cut: the state of the machine cannot be written: {reason}",
            self.replay("--break", "extra.out > -5", "--cut", "cut.mcap", status=1),
        )

    def test_a_journal_without_cycles_gives_no_recording(self):
        netlist = self.write("a.hal", "loadrt integ names=sum\n")
        machine = self.start("run", netlist, "--journal", "run.mcap", loaded=False)
        wait_until(lambda: self.value("sum.in") == "0", "the instance is loaded")
        self.finish(machine)
        done = self.run_program("replay", "--exact", "run.mcap", "--record", "out.csv")
        self.assertEqual(
            (1, "hal replay: --record: no cycle was executed\n"), (done.returncode, done.stderr)
        )
        self.assertFalse((self.folder / "out.csv").exists())
        self.assertRegex(
            self.replay(),
            r"^0 cycles of 0 threads, 0 edits and 0 s executed in \S+ s; the journal has no cycles\nno difference\n$",
        )

    def test_no_option_replaces_the_journal_itself(self):
        self.finish(self.run_journaled(SERVO + "start\n"))
        whole = (self.folder / "run.mcap").read_bytes()
        os.symlink("run.mcap", self.folder / "link.mcap")
        part = shutil.copy(self.folder / "run.mcap", self.folder / "a.mcap")
        for option, more in (("--record", []), ("--cut", ["--until", "2"])):
            for name in ("run.mcap", "./link.mcap"):
                self.assertEqual(
                    f"hal replay: {option}: '{name}' is the journal itself; name another file\n",
                    self.replay(option, name, *more, status=1),
                )
            self.assertEqual(
                f"hal replay: {option}: 'a.mcap' is the journal itself; name another file\n",
                self.replay(part, option, "a.mcap", *more, status=1),
            )
        self.assertEqual(
            "hal replay: --cut: 'b.mcap' is the file of --record; name another one\n",
            self.replay("--record", "b.mcap", "--cut", "b.mcap", "--until", "2", status=1),
        )
        self.assertEqual(whole, (self.folder / "run.mcap").read_bytes())

    def test_functions_of_two_threads_that_share_state_run_in_their_order(self):
        with load(2):
            machine = self.run_journaled(SHARED, "--values", "*")
            self.wait_for_cycles(2000)
            self.finish(machine)
        done = self.run_program("replay", "--exact", "run.mcap", "--show", "turns.position")
        # also where one has interrupted the other in the middle
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        self.assertRegex(done.stdout, r"(?m)^no difference, \d{5,} values compared$")
        self.assertRegex(done.stdout, r"(?m)^turns.position -?\d")

    def test_it_stops_at_a_time_a_cycle_or_a_condition(self):
        machine = self.run_journaled(MACHINE, "--values", "position")
        self.wait_for_cycles(300)
        self.finish(machine)
        text = self.replay("--until", "0.1s", "--show", "position,sine,nowhere", status=1)
        self.assertRegex(text, r"\nstopped; no difference so far, \d+ values compared\n")
        self.assertIn("--show: no pin, parameter or signal matches 'nowhere'", text)
        text = self.replay("--until", "0.1s", "--show", "position,sine")
        self.assertRegex(text, r"\nposition \S+\nsine \S+\n$")
        self.assertRegex(
            self.replay("--until", "120"), r"newest: cycle \d{3} of 'fast' at .*\nstopped"
        )
        text = self.replay("--break", "position > 0.01", "--show", "position")
        self.assertRegex(text, r"(?s)newest: cycle \d+ of 'servo'.*stopped.*position 0\.01\d*\n$")
        self.assertIn(
            "--break: the machine has no 'wheel'", self.replay("--break", "wheel > 1", status=1)
        )
        for words, problem in [
            (["--until", "soon"], "--until: invalid cycle or time 'soon'"),
            (["--break", "> 3"], "--break: invalid condition '> 3'"),
            (["--break", "position => 3"], "--break: invalid condition 'position => 3'"),
            (["--break", "position > x"], "--break: invalid condition 'position > x'"),
            ([self.write("b.hal", SERVO)], "--exact takes one journal and no netlist"),
        ]:
            self.assertIn(problem, self.replay(*words, status=1))

    def shell_in_the_past(self, lines, *options, status=0):
        done = self.run_program(
            "replay", "--exact", "run.mcap", "--shell", *options, given="\n".join(lines) + "\n"
        )
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stdout.splitlines(), done.stderr

    def test_a_shell_goes_to_any_cycle_and_back(self):
        machine = self.run_journaled(MACHINE, "--values", "position")
        self.wait_for_cycles(1500)
        self.finish(machine)
        read = ["where", "gets position", "gets total", "getp servo.time"]
        forward, _ = self.shell_in_the_past(["goto 0.4s", *read, "step 700", *read])
        lines = ["goto 0.4s", "step 700", *read, "step back 700", *read, "step 699", "step"]
        there, _ = self.shell_in_the_past([*lines, *read, "goto 0.4s", *read])
        self.assertEqual(forward[5:10], there[1:6])
        self.assertEqual(forward[0:5], there[6:11])
        self.assertEqual(forward[6:10], there[13:17])
        self.assertEqual(forward[0:5], there[17:22])
        numbers = [
            int(re.fullmatch(r"cycle (\d+) of 'slow' at \S+ s", line)[1])
            for line in self.shell_in_the_past(
                ["goto 0.5s", "step slow", "step 5 slow", "step back 5 slow", "step back slow"]
            )[0][1:]
        ]
        self.assertEqual([0, 5, 0, -1], [number - numbers[0] for number in numbers])
        begin, _ = self.shell_in_the_past(["step back 99999", "step 3", "goto 0s", "step back 9"])
        self.assertEqual("before the first cycle", begin[0])
        self.assertEqual("before the first cycle", begin[3])

    def test_a_process_that_is_copied_has_one_thread(self):
        # a copy has the locks of the other threads, and nobody releases them
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(200)
        self.finish(machine)
        shell = self.start(
            "replay", "--exact", "run.mcap", "--shell", loaded=False, stdin=subprocess.PIPE
        )

        def descendants(process):
            listed = pathlib.Path(f"/proc/{process}/task").glob("*/children")
            children = [int(child) for one in listed for child in one.read_text().split()]
            return children + [below for child in children for below in descendants(child)]

        wait_until(lambda: len(descendants(shell.pid)) == 2, "the re-execution and its first copy")
        for process in descendants(shell.pid):
            self.assertEqual(1, len(os.listdir(f"/proc/{process}/task")))
        shell.communicate("quit\n", timeout=TIMEOUT)
        self.assertEqual(0, shell.returncode)

    def test_reverse_finds_where_a_condition_began(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(1500)
        self.finish(machine)
        forward, _ = self.shell_in_the_past(
            ["continue", "continue", "continue", "gets sine"], "--break", "sine > 0.5"
        )
        self.assertEqual(4, len({line.split(":")[0] for line in forward[:4]}), forward)
        back, _ = self.shell_in_the_past(
            ["break sine > 0.5", "goto 99s", "reverse", "reverse", "goto 0s"]
            + ["continue"] * 4
            + ["reverse"] * 4
        )
        self.assertEqual("the journal has no further cycle", back[1])
        self.assertRegex(back[2], r"^cycle \d+ of 'fast' at \S+ s: sine 0\.5\d*$")
        self.assertEqual(forward[0:4], back[5:9])
        self.assertEqual(forward[2::-1], back[9:12])
        self.assertEqual("the condition begins to hold in no earlier cycle", back[12])

    def test_the_past_cannot_be_changed(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(200)
        self.finish(machine)
        other = self.folder / "other.hal"
        other.write_text("setp pid.x.Pgain 3\nunloadrt all\n")
        lines = ["setp pid.x.Pgain 3", "sets sum 3", "pid.x.Pgain = 3", "loadrt sum2", "stop"]
        lines.append(f"source {other}")
        out, _ = self.shell_in_the_past(["goto 100", *lines, "getp pid.x.Pgain"], status=1)
        for line, text in zip(lines, out[1:]):
            self.assertRegex(
                text, "is not possible: this is a moment of the past|unknown command 'pid.x.Pgain'"
            )
        self.assertEqual("4", out[-1])
        for line, problem in [
            ("step 3 wheel", "the journal has no thread 'wheel'"),
            ("step 0", "the number of cycles is 1 or more"),
            ("goto soon", "goto: write a cycle or a time"),
            ("goto 1e3", "goto: write a cycle or a time"),
            ("goto 0.5", "goto: write a cycle or a time"),
            ("break sine =>", "break: invalid condition 'sine =>'"),
            ("reverse", "reverse: no break condition"),
        ]:
            self.assertIn(problem, self.shell_in_the_past([line], status=1)[1])
        self.assertIn(
            "break: the machine has no 'wheel'",
            self.shell_in_the_past(["continue"], "--break", "wheel > 3")[0],
        )

        self.assertIn(
            "break: the machine has no 'wheel' in this cycle",
            self.shell_in_the_past(["goto 0.1s", "break wheel > 3"])[0],
        )
        self.assertIn(
            "break: the machine has no 'wheel'",
            self.shell_in_the_past(["goto 0.1s", "break wheel > 3", "reverse"])[0],
        )

    def test_the_journal_of_an_earlier_run_is_kept(self):
        for _ in range(3):
            machine = self.run_journaled(MACHINE)
            self.wait_for_cycles(100)
            self.finish(machine)
        journals = sorted(path.name for path in self.folder.glob("*.mcap"))
        self.assertEqual(2, len(journals), journals)
        self.assertTrue(journals[0].endswith("-previous.mcap"), journals)

    def test_another_value_changes_what_follows(self):
        machine = self.run_journaled(MACHINE, "--values", "*")
        self.wait_for_cycles(800)
        self.finish(machine)
        show = ["--until", "0.6s", "--show", "position"]
        as_it_was = self.replay(*show).splitlines()[-1]
        at = ["--at", "0.3s", *show]
        text = self.replay("--edit", "setp pid.x.Pgain 9", *at)
        self.assertRegex(
            text,
            r"\nedited after cycle \d+ of '\w+' at 0\.3\d+ s\n"
            r"first value that differs: 'effort' \('pid\.x' of pid, function "
            r"'pid\.x\.do-pid-calcs'\) in cycle \d+ of thread 'servo': \S+ instead of \S+, and "
            r"\d+ further values of the same cycle\n"
            r"first cycle that differs: \d+ of 'servo' at 0\.3\d+ s\n"
            r"the journal has no input from outside of the machine but the time: what follows is "
            r"computed\n",
        )
        self.assertNotEqual(as_it_was, text.splitlines()[-1])
        text = self.replay("--edit", "setp pid.x.Pgain 4", *at)
        self.assertIn("\nno cycle differs from the journaled ones\n", text)
        self.assertEqual(as_it_was, text.splitlines()[-1])
        shell, _ = self.shell_in_the_past(
            ["goto 0.6s", "gets position", "step back 900", "goto 0.6s", "gets position"],
            *["--edit", "setp pid.x.Pgain 9", "--at", "0.3s"],
        )
        self.assertEqual(shell[1], shell[4])
        for edit, at, problem in [
            ("setp pid.x.output 3", "0.3s", "--edit: 'pid.x.output' is linked to signal 'effort'"),
            ("sets effort 3", "0.3s", "--edit: signal 'effort' is written by 'pid.x.output'"),
            ("setp wheel 3", "0.3s", "--edit: the machine has no pin or parameter 'wheel'"),
            ("setp pid.x.Pgain x", "0.3s", "--edit: 'pid.x.Pgain': 'x' is not a number"),
            ("setp pid.x.Pgain 3", "99s", "--at 99s: the execution ended before it"),
            ("net x y", "0.3s", "--edit: invalid edit 'net x y'"),
            ("setp pid.x.Pgain 3", "soon", "--at: invalid cycle or time 'soon'"),
        ]:
            self.assertIn(problem, self.replay("--edit", edit, "--at", at, status=1))
        self.assertIn("--at needs --edit", self.replay("--at", "3s", status=1))
        self.assertIn("--edit needs --at", self.replay("--edit", "setp a 3", status=1))

    def test_another_netlist_changes_what_follows(self):
        machine = self.run_journaled(MACHINE, "--values", "*")
        self.wait_for_cycles(400)
        self.give(["setp siggen.0.amplitude 1.5"])
        self.wait_for_cycles(400)
        self.finish(machine)
        show = ["--until", "0.6s", "--show", "position,effort"]
        as_it_was = self.replay(*show).splitlines()[-2:]
        at = ["--at", "0.3s", *show]
        self.write("same.hal", MACHINE.replace("\n", "\n\n"))
        text = self.replay("--netlist", "same.hal", *at)
        self.assertIn("\nno cycle differs from the journaled ones\n", text)
        self.assertEqual(as_it_was, text.splitlines()[-2:])
        changed = MACHINE.replace("setp pid.x.Pgain 4", "setp pid.x.Pgain 9").replace(
            "net effort pid.x.output => plant.in",
            "loadrt limit1 names=soft\naddf soft servo 2\nsetp soft.max 1\nsetp soft.min -1\n"
            "net wish pid.x.output => soft.in\nnet effort soft.out => plant.in",
        )
        self.write("changed.hal", changed)
        text = self.replay("--netlist", "changed.hal", *at, "--show", "wish")
        self.assertRegex(text, r"\nedited after cycle \d+ of '\w+' at 0\.3\d+ s\n")
        self.assertRegex(text, r"\nfirst cycle that differs: \d+ of '\w+' at 0\.3\d+ s\n")
        values = dict(line.split() for line in text.splitlines()[-3:])
        self.assertLessEqual(abs(float(values["effort"])), 1)
        self.assertNotEqual(as_it_was[0], f"position {values['position']}")
        # the links between threads are others
        self.write("fewer.hal", MACHINE.replace("add.1.in0 add.0.in1", "add.1.in0"))
        self.assertRegex(
            self.replay("--netlist", "fewer.hal", *at), r"\nfirst cycle that differs: "
        )
        for words, problem in [
            (["--netlist", "no.hal", "--at", "0.3s"], "--netlist: cannot read 'no.hal'"),
            (["--netlist", "same.hal"], "--netlist needs --at CYCLE|TIME"),
            (
                ["--netlist", self.write("bogus.hal", MACHINE + "\nbogus line\n"), *at],
                "unknown command 'bogus'",
            ),
            (
                ["--netlist", self.write("more.hal", MACHINE + "newthread t 3000000\n"), *at],
                "has other threads, and the journal has no cycles of them",
            ),
            (
                ["--netlist", self.write("wrong.hal", MACHINE + "addf nothing servo\n"), *at],
                "cannot be applied: unknown function 'nothing'",
            ),
        ]:
            self.assertIn(problem, self.replay(*words, status=1))

    def test_an_incident_becomes_a_test(self):
        own = self.folder / "plugins"
        own.mkdir()
        shutil.copy(HAL.parent.parent / "components" / "sum2.so", own)
        self.environment["HALCYON_PLUGIN_PATH"] = f"{own}:{PLUGINS}"
        machine = self.run_journaled(MACHINE, "--values", "*")
        self.give(["setp siggen.0.amplitude 1.5"])
        self.wait_for_cycles(1500)
        self.finish(machine)
        before = os.umask(0o002)
        try:
            text = self.replay(
                "--break", "sine > 1.4", "--show", "sine,effort", "--as-test", "case"
            )
        finally:
            os.umask(before)
        self.assertRegex(
            text, r"\ncase: \d+ cycles, 2 values expected; to run it, type: hal replay case\n"
        )
        case = self.folder / "case"
        self.assertLess((case / "journal.mcap").stat().st_size, 40_000)
        modes = {path.name: path.stat().st_mode & 0o777 for path in case.iterdir()}
        self.assertEqual(dict.fromkeys(("journal.mcap", "expected", "test.hal"), 0o664), modes)
        self.assertEqual(
            re.search(r"(?m)^sine .*\neffort .*\n", text)[0], (case / "expected").read_text()
        )
        self.assertIn("\nsetp siggen.0.amplitude 1.5\n", (case / "test.hal").read_text())
        self.assertEqual(0, self.run_program("check", case / "test.hal").returncode)
        self.assertRegex(
            self.good("replay", "case"), r"^\d+ cycles: 2 values, 0 not as expected\n$"
        )
        run = [sys.executable, ROOT / "tests/netlists/run.py", HAL, "--once", case]
        done = subprocess.run(run, capture_output=True, text=True, env=self.environment)
        self.assertEqual("1 of 1 netlist tests passed\n", done.stdout + done.stderr)
        # a changed plugin is what the test is for
        with open(own / "sum2.so", "ab") as plugin:
            plugin.write(b"x")
        self.good("replay", "case")
        (case / "expected").write_text("effort 7\nwheel 3\n")
        done = self.run_program("replay", "case")
        self.assertEqual(1, done.returncode)
        self.assertRegex(
            done.stdout,
            r"^effort \S+ instead of 7\nwheel unknown instead of 3\n"
            r"\d+ cycles: 2 values, 2 not as expected\n$",
        )
        done = subprocess.run(run, capture_output=True, text=True, env=self.environment)
        self.assertIn("\n    wheel unknown instead of 3\n", done.stdout)
        self.assertIn("\n0 of 1 netlist tests passed\n", done.stdout)
        (case / "expected").write_text("\n")
        done = self.run_program("replay", "case")
        self.assertEqual(1, done.returncode)
        self.assertIn("'expected' has no line with a name and a value", done.stdout)
        whole = (case / "journal.mcap").read_bytes()
        (case / "journal.mcap").write_bytes(whole[:10])
        self.assertIn("cannot execute 'case/journal.mcap'", self.bad("replay", "case"))
        self.write("file", "")
        for words, problem in [
            (["--as-test", "file/case"], "cannot create the folder 'file/case'"),
            (["--as-test", "b", "--shell"], "--as-test is for the journal as it is"),
            (
                ["--as-test", "case"],
                "--as-test: 'case' exists already; name another folder, or remove it",
            ),
            (
                ["--as-test", "b", "--show", "sine,efort"],
                "--show: no pin, parameter or signal matches 'efort'; did you mean 'effort'?",
            ),
        ]:
            self.assertIn(problem, self.replay("--anyway", *words, status=1))
        self.assertFalse((self.folder / "b").exists())
        (self.folder / "empty").mkdir()
        self.replay("--anyway", "--show", "e*", "--as-test", "empty")
        self.assertRegex((self.folder / "empty" / "expected").read_text(), r"(?m)^effort \S+$")

    def test_an_end_before_the_goal_is_reported(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(100)
        self.finish(machine)
        self.assertIn("--until 99s: the journal ends before it", self.replay("--until", "99s"))
        self.assertIn(
            "--break 'sine > 7': it holds in no cycle of the journal",
            self.replay("--break", "sine > 7"),
        )

    def test_what_a_killed_machine_left_is_executed(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(3000)
        machine.send_signal(signal.SIGKILL)
        machine.wait()
        part = self.folder / "run.mcap.part"
        wait_until(part.exists, "the part")
        text = self.replay(name="run.mcap.part")
        self.assertIn("the file has no end: it is read up to its last complete chunk", text)
        self.assertGreater(int(re.search(r"(\d+) cycles of 3 threads", text)[1]), 3000)
        again = self.run_journaled(MACHINE)
        error = self.finish(again)
        self.assertIn("the unfinished journal of an earlier run is now", error)

    def test_a_journal_that_is_cut_off_among_edits_has_no_difference(self):
        machine = self.run_journaled(MACHINE)
        self.give(edits(300, 300))
        self.wait_for_cycles(200)
        self.finish(machine)
        whole = (self.folder / "run.mcap").read_bytes()
        chance = random.Random(5)
        for _ in range(25):
            at = chance.randrange(len(whole) // 3, len(whole) - 100)
            (self.folder / "cut.mcap").write_bytes(whole[:at])
            text = self.replay(name="cut.mcap")
            self.assertNotIn("first difference", text)
            self.assertNotIn("did not answer", text)

    @unittest.skipUnless(os.geteuid() == 0, "mounts a file system")
    def test_a_full_disk_is_reported_at_once(self):
        small = self.folder / "small"
        small.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200k", "none", small]).returncode:
            self.skipTest("mounts are not allowed here")
        self.addCleanup(subprocess.run, ["umount", small], check=False)
        path = self.write("a.hal", MACHINE)
        machine = self.start("run", path, "--journal", "small/run.mcap")
        part = small / "run.mcap.part"
        wait_until(lambda: part.exists() and part.stat().st_size > 100_000, "much is written")
        self.wait_for_cycles(8000)
        _, error = self.end(machine)
        self.assertEqual(1, machine.returncode, error)
        self.assertIn(
            "hal run: cannot write 'small/run.mcap': No space left on device; the machine goes on without a journal\n",
            error,
        )

    def test_a_damaged_file_is_executed_up_to_the_damage(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(2500)
        self.finish(machine)
        whole = (self.folder / "run.mcap").read_bytes()
        for at in (len(whole) * 2 // 3, len(whole) // 4, 40):
            changed = bytearray(whole)
            changed[at] ^= 0xFF
            (self.folder / "changed.mcap").write_bytes(changed)
            (self.folder / "cut.mcap").write_bytes(whole[:at])
            for name in ("changed.mcap", "cut.mcap"):
                done = self.run_program("replay", "--exact", name)
                self.assertIn(done.returncode, (0, 1), done.stderr)
                self.assertNotIn("first difference", done.stdout)
                self.assertTrue(done.stderr or done.returncode == 0, done.stdout)
        (self.folder / "changed.mcap").write_bytes(whole[: len(whole) // 2])
        self.assertRegex(self.replay(name="changed.mcap"), r"the file has no end")

    def test_another_file_is_no_journal(self):
        self.good("sim", self.write("a.hal", SERVO), "-q", "--for", "10ms", "--record", "run.mcap")
        self.assertIn("it is not a journal: hal run --journal writes one", self.replay(status=1))
        self.assertIn("missing.mcap", self.replay(name="missing.mcap", status=1))
        for words, problem in [
            (["--journal", "run.csv"], "--journal: unknown format of 'run.csv'"),
            (["--journal", "nowhere/run.mcap"], "cannot write 'nowhere/run.mcap'"),
            (["--values", "total"], "--values needs --journal FILE"),
            (["--journal", "b.mcap", "--values", "wheel", "--for", "1s"], "matches 'wheel'"),
        ]:
            self.assertIn(problem, self.bad("run", self.folder / "a.hal", *words))
        for option, value in (
            ("--until", "3"),
            ("--break", "a > 1"),
            ("--show", "a"),
            ("--shell", None),
            ("--edit", "setp a 1"),
            ("--netlist", "b.hal"),
            ("--at", "3"),
            ("--as-test", "t"),
            ("--record", "b.csv"),
            ("--cut", "b.mcap"),
            ("--anyway", None),
        ):
            words = [option] if value is None else [option, value]
            self.assertEqual(
                f"hal replay: only with --exact: {option}\n",
                self.bad("replay", "run.mcap", "a.hal", *words),
            )
        self.assertEqual(
            "hal replay: only with --exact: --until, --anyway\n",
            self.bad("replay", "run.mcap", "a.hal", "--anyway", "--until", "3"),
        )
        for words in (["--tolerance", "1"], ["--for", "1s"]):
            self.assertIn("compares all bits", self.bad("replay", "--exact", "run.mcap", *words))

    def test_the_values_of_a_journal_are_drawn_without_a_word_about_the_rest(self):
        machine = self.run_journaled(MACHINE, "--values", "*")
        self.wait_for_cycles(10)
        self.end(machine)  # a host without CPU time ends it with a fault
        done = self.run_program("plot", "run.mcap", "sine")
        self.assertEqual((0, "run.svg\n", ""), (done.returncode, done.stdout, done.stderr))

    def test_a_journal_without_exact_and_an_unfinished_one_say_what_to_type(self):
        machine = self.run_journaled(MACHINE)
        self.wait_for_cycles(10)
        self.end(machine)
        said = self.bad("replay", "run.mcap")
        self.assertIn(
            "'run.mcap' is a journal; to execute it again, type: hal replay --exact run.mcap;", said
        )
        (self.folder / "run.mcap").rename(self.folder / "run.mcap.part")
        said = self.bad("replay", "--exact", "run.mcap")
        self.assertIn("; 'run.mcap.part' is there, of a machine that runs", said)
        self.assertNotIn(".part", self.bad("replay", "--exact", "other.mcap"))

    def test_another_plugin_is_rejected(self):
        own = self.folder / "plugins"
        own.mkdir()
        shutil.copy(HAL.parent.parent / "components" / "sum2.so", own)
        self.environment["HALCYON_PLUGIN_PATH"] = f"{own}:{PLUGINS}"
        machine = self.run_journaled(SERVO)
        self.wait_for_cycles(50)
        self.finish(machine)
        self.replay()
        with open(own / "sum2.so", "ab") as plugin:
            plugin.write(b"x")
        text = self.replay(status=1)
        self.assertRegex(
            text, r"the plugin of 'sum2' was changed: \S+sum2.so has hash [0-9a-f]{16}"
        )
        self.assertIn("type: hal replay --exact --anyway", text)
        self.assertIn("\nno difference\n", self.replay("--anyway"))

    def test_values_of_programs_are_written_again(self):
        machine = self.run_journaled(SERVO, "--values", "*")
        program = Program(
            self.folder,
            {"component": "panel", "pins": [{"name": "speed", "type": "float", "dir": "out"}]},
        )
        self.give(["net speed panel.speed => adder.in0"])
        self.addCleanup(program.close)
        for value in range(50):
            program.ask({"exchange": "panel", "write": [0, value / 7]})
            self.wait_for_cycles(2)
        self.finish(machine)
        text = self.replay("--show", "total")
        self.assertRegex(text, r"no difference, \d{3,} values compared\ntotal 10\n")

    def test_the_records_that_programs_feed_and_take_are_recorded(self):
        machine = self.run_journaled(STREAM, "--values", "*")
        self.comes("sampler.0.full", "TRUE")
        self.write("in.txt", "".join(f"{value}\n" for value in range(1, 2000)))
        self.good("play", "in.txt")
        self.good("record", "-n", "100", "out.txt")
        self.comes("streamer.0.pin.0", "1999")
        self.finish(machine)
        text = self.replay("--show", "streamer.0.pin.0")
        self.assertNotIn("not in the journal", text)
        self.assertRegex(text, r"no difference, \d{4,} values compared\nstreamer.0.pin.0 1999\n")

    def test_the_first_difference_is_named(self):
        machine = self.run_journaled(UNRECORDED, "--values", "*")
        self.wait_for_cycles(100)
        self.finish(machine)
        text = self.replay(status=1)
        self.assertIn(
            "'unrecorded.0' (unrecorded) has 1 stream, whose data are not in the journal", text
        )
        self.assertRegex(
            text,
            r"first difference: '(sum\.in|unrecorded\.0\.\S+|value)' \('unrecorded\.0' of unrecorded, function "
            r"'unrecorded\.0'\) in cycle \d+ of thread 'servo': \S+ instead of \S+",
        )
        self.assertRegex(
            text,
            r"\ninputs of 'unrecorded\.0' in this cycle:\n  unrecorded\.0\.enable TRUE\n",
        )
        machine = self.run_journaled(UNRECORDED, name="b.mcap")
        self.wait_for_cycles(100)
        self.finish(machine)
        self.assertRegex(
            self.replay(name="b.mcap", status=1),
            r"first difference: cycle \d+ of thread 'servo' at \S+ s has values with another "
            r"checksum\nto have the value named, write the journal with: --values '\*'",
        )

    def test_the_inputs_of_a_function_that_differs_earlier_in_each_execution(self):
        machine = self.run_journaled(
            """loadrt threads name1=servo period1=1000000
loadrt earlier
addf earlier.0 servo
setp earlier.0.in 3
net value earlier.0.out
""",
            "--values",
            "*",
        )
        self.wait_for_cycles(100)
        self.finish(machine)
        self.environment["EARLIER"] = "60"
        self.assertRegex(
            self.replay(status=1),
            r"first difference: '\S+' \('earlier\.0' of earlier, function 'earlier\.0'\) in cycle \d+ "
            r"of thread 'servo': (TRUE|1) instead of (FALSE|0).*\n"
            r"inputs of 'earlier\.0' in this cycle:\n  earlier\.0\.in 3\n",
        )

    def test_faults_that_another_thread_raises_while_they_are_read(self):
        machine = self.run_journaled(
            """loadrt threads name1=fast period1=200000 supervise1=60s name2=servo period2=1000000 supervise2=60s
loadrt raiser
loadrt lengthy
loadrt faults
addf raiser.0 fast
addf lengthy.0 servo
addf faults servo
start
""",
            "--values",
            "faults.*",
        )
        # the fast thread raises some between the begin of a cycle and its reading of them
        wait_until(lambda: int(self.shell("getp", "faults.count").stdout) > 10_000, "faults")
        self.finish(machine)
        self.assertRegex(self.replay(), r"\nno difference, \d{4,} values compared\n$")

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_what_a_helper_thread_computes_is_recorded_by_its_component(self):
        machine = self.run_journaled(
            """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
loadrt lqr names=hold a=0,1;0,0 b=0;0.5 q="diag 1000 10" r=0.01
addf wave.update servo
addf hold.update servo
net place wave.sine => hold.x-0
""",
            "--values",
            "*",
        )
        for number in range(1, 6):
            self.give([f"setp hold.q-0 {number * 100}"])
            self.comes("hold.designs", str(number))
        self.give(["setp hold.q-0 -1"])
        self.comes("hold.rejected", "TRUE")
        self.finish(machine)
        done = self.run_program("replay", "--exact", "run.mcap", "--show", "hold.designs")
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertRegex(done.stdout, r"no difference, \d{4,} values compared\nhold.designs 5\n")

    @needs_package("vision")
    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_what_a_camera_has_seen_is_recorded(self):
        machine = self.run_journaled(
            """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
loadrt vision_scene show=furuta
loadrt vision_pendulum source=sim:furuta
addf wave.update servo
addf vision-scene.0.update servo
addf vision-pendulum.0.update servo
net arm wave.sine => vision-scene.0.arm-angle
""",
            "--values",
            "*",
        )
        wait_until(lambda: int(self.value("vision-pendulum.0.frames")) > 20, "pictures")
        self.give(["setp vision-scene.0.unplugged TRUE"])
        self.comes("vision-pendulum.0.error-code", "3")
        self.finish(machine)
        text = self.replay("--show", "vision-pendulum.0.error-code")
        self.assertNotIn("not in the journal", text)
        self.assertRegex(
            text, r"no difference, \d{4,} values compared\nvision-pendulum.0.error-code 3\n"
        )

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_a_component_gets_the_time_that_it_has_read(self):
        machine = self.run_journaled(
            """loadrt threads name1=servo period1=1000000
loadrt timedelta
addf timedelta.0 servo
""",
            "--values",
            "*",
        )
        self.wait_for_cycles(300)
        self.finish(machine)
        text = self.replay("--show", "timedelta.0.max")
        self.assertRegex(text, r"no difference, \d{4,} values compared\ntimedelta.0.max \d{7,}\n")


if __name__ == "__main__":
    unittest.main()
