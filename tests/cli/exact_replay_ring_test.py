# SPDX-License-Identifier: MIT
# packages: canopen
"""Journals that begin later than their machine: hal replay --cut, hal run --journal-keep, journal save."""

import re
import shutil
import signal
import unittest
from pathlib import Path

import exact_replay_test
from harness import ROOT, SANITIZED, Case, wait_until

AXIS = ROOT / "halfiles" / "canopen-axis"

# Components with memory on the heap: a delay line and a stream of records.
HEAP = """loadrt threads name1=servo period1=1000000 name2=slow period2=4000000
loadrt siggen
loadrt delay names=late depth=100
loadrt sampler depth=100 cfg=f
loadrt lowpass names=calm
loadrt integ names=sum
addf siggen.0.update servo
addf late servo
addf calm servo
addf sampler.0 servo
addf sum slow
net sine siggen.0.sine => late.in
net delayed late.out => calm.in sampler.0.pin.0
net smooth calm.out => sum.in
setp siggen.0.frequency 3
setp late.cycles 50
setp calm.gain 0.1
start
"""

# The first cycle is a fault.
FAULT = """newthread servo 1000000 budget=1ns
loadrt siggen
addf siggen.0.update servo
start
"""


@unittest.skipIf(SANITIZED, "a sanitizer has its own operator new")
class ExactReplayRing(Case):
    def run_journaled(self, text, *options, name="run.mcap"):
        return self.start("run", self.write("a.hal", text), "--journal", name, *options)

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

    def replay(self, name, *options, status=0):
        done = self.run_program("replay", "--exact", name, *options)
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def cut_and_compare(self, show, *until):
        """Executes the rest from its state, and the whole, to the same end."""
        text = self.replay("run.mcap", *until, "--cut", "rest.mcap")
        self.assertIn("\nrest.mcap: the journal from here on", text)
        rest = self.replay("rest.mcap", "--show", show)
        whole = self.replay("run.mcap", "--show", show)
        self.assertRegex(rest, r"\nno difference\n")
        lines = rest.splitlines()[2:]
        self.assertEqual(whole.splitlines()[2:], lines)
        self.assertGreater(len(lines), 0)
        count = re.compile(r"(?m)^(\d+) cycles")
        self.assertLess(int(count.search(rest)[1]), int(count.search(whole)[1]) - 100)
        return rest

    def test_a_journal_is_cut_under_load_and_edits(self):
        with exact_replay_test.load(2):
            machine = self.run_journaled(exact_replay_test.MACHINE)
            lines = exact_replay_test.edits(60, 200)
            self.run_program("shell", given="\n".join(lines[: len(lines) // 2]) + "\n")
            self.wait_for_cycles(500)
            self.run_program("shell", given="\n".join(lines[len(lines) // 2 :]) + "\n")
            self.wait_for_cycles(500)
            self.finish(machine)
        for until in ("0.3s", "0.9s"):
            self.cut_and_compare("position,sum,total,effort,servo.time", "--until", until)
        # a rest can be cut again
        shutil.copy(self.folder / "rest.mcap", self.folder / "run.mcap")
        self.cut_and_compare("position,sum,total,effort", "--until", "0.2s")

    def test_functions_that_share_state_and_streams_go_on(self):
        machine = self.run_journaled(exact_replay_test.SHARED)
        self.wait_for_cycles(1500)
        self.finish(machine)
        self.cut_and_compare("turns.position,turns.velocity,speed", "--until", "0.7s")

    def test_heap_memory_of_components_is_in_the_state(self):
        machine = self.run_journaled(HEAP)
        self.wait_for_cycles(1500)
        self.finish(machine)
        self.cut_and_compare("delayed,smooth,sum.out", "--until", "0.7s")

    def test_memory_of_thousands_of_setup_calls_is_in_the_state(self):
        every = "".join(f"addf hoard.{number} servo\n" for number in (0, 2099))
        machine = self.run_journaled(
            f"newthread servo 1000000\nloadrt hoard count=2100\n{every}start\n"
        )
        self.wait_for_cycles(500)
        self.finish(machine)
        self.cut_and_compare("hoard.0.sum,hoard.2099.sum", "--until", "0.2s")

    def test_memory_that_does_not_fit_names_its_component(self):
        cannot = "hal replay: --cut: the state of the machine cannot be written: "
        for argument, problem in (
            ("mib=300", "'hoard.0' (hoard) allocates more than 256 MiB in one setup call"),
            (
                "cycle-mib=300",
                "what functions allocate in cycles does not fit 256 MiB; what 'hoard.0' allocates "
                "is not in the state",
            ),
        ):
            machine = self.run_journaled(
                f"newthread servo 1000000\nloadrt hoard {argument}\naddf hoard.0 servo\nstart\n"
            )
            self.wait_for_cycles(500)
            self.finish(machine)
            done = self.run_program(
                "replay", "--exact", "run.mcap", "--until", "400", "--cut", "rest.mcap"
            )
            self.assertEqual((1, cannot + problem + "\n"), (done.returncode, done.stderr))
            self.assertFalse((self.folder / "rest.mcap").exists())

    def test_a_bus_goes_on(self):
        shutil.copy(AXIS / "axis.canopen", self.folder)
        machine = self.run_journaled("""loadrt threads name1=servo period1=1000000
loadrt canopen config=axis.canopen
loadrt canopen_drive link=sim:axis id=2
addf canopen.0.receive servo
addf canopen.0.transmit servo
addf canopen-drive.0.update servo
start
""")
        wait_until(
            lambda: self.shell("getp", "canopen.0.nodes-operational").stdout.strip() == "1",
            "the node is operational",
        )
        self.wait_for_cycles(1000)
        self.finish(machine)
        for until in ("200", "0.9s"):  # while the node boots, and later
            self.cut_and_compare(
                "canopen.0.nodes-operational,canopen.0.x.statusword,canopen-drive.0.*",
                "--until",
                until,
            )

    def test_memory_that_grows_in_cycles_is_in_the_state(self):
        done = self.run_program(
            "compile", "--no-check-rt", Path(__file__).parent / "sources/grows.cpp"
        )
        self.assertEqual(0, done.returncode, done.stderr)
        machine = self.run_journaled("""loadrt threads name1=servo period1=1000000
loadrt siggen
loadrt grows names=a,b
addf siggen.0.update servo
addf a servo
addf b servo
net sine siggen.0.sine => a.in
net cosine siggen.0.cosine => b.in
start
""")
        self.wait_for_cycles(2500)
        self.finish(machine)
        self.cut_and_compare("a.out,b.out", "--until", "0.7s")
        shutil.copy(self.folder / "rest.mcap", self.folder / "run.mcap")
        self.cut_and_compare("a.out,b.out", "--until", "0.9s")

    def test_a_cut_needs_a_moment_and_a_name(self):
        machine = self.run_journaled(HEAP)
        self.wait_for_cycles(100)
        self.finish(machine)
        for words, problem in [
            (["--cut", "rest.mcap"], "--cut: name the moment with --until or --break"),
            (["--cut", "rest.csv", "--until", "9"], "--cut: unknown format of 'rest.csv'"),
            (["--cut", "rest.mcap", "--until", "9", "--shell"], "--cut: it is for the journal as"),
            (["--cut", "no/rest.mcap", "--until", "9"], "cannot write 'no/rest.mcap'"),
        ]:
            self.assertIn(problem, self.replay("run.mcap", *words, status=1))

    def test_the_last_seconds_are_kept(self):
        machine = self.run_journaled(exact_replay_test.MACHINE, "--journal-keep", "4s")
        ring = self.folder / "run.mcap.ring"
        wait_until(lambda: (ring / "000004.mcap").exists(), "four parts")
        self.good("shell", "setp", "pid.x.Pgain", "3")
        wait_until(lambda: not (ring / "000002.mcap").exists(), "the second part was cut")
        self.good("shell", "setp", "pid.x.Pgain", "2")
        self.wait_for_cycles(100)
        self.good("shell", "journal", "save", "now.mcap")
        self.wait_for_cycles(300)
        error = self.finish(machine)
        self.assertIn("run.mcap: the last 4 s of ", error)
        self.assertNotIn("kept whole", error)
        self.assertFalse(ring.exists())
        for name in ("now.mcap", "run.mcap"):
            text = self.replay(name, "--show", "pid.x.Pgain")
            self.assertIn("\npid.x.Pgain 2\n", text)
            seconds = float(re.search(r"and ([0-9.]+) s executed", text)[1])
            self.assertGreater(seconds, 4)
        self.assertGreater(int(re.search(r"newest: cycle (\d+)", text)[1]), 6000)

    def test_short_runs_end_in_order(self):
        path = self.write("machine.hal", HEAP)
        for _ in range(5):
            words = ("--journal", "run.mcap", "--journal-keep", "10min", "--for", "0.3s")
            done = self.run_program("run", path, *words)
            self.assertEqual(0, done.returncode, done.stderr)
            self.assertRegex(done.stderr, r"run.mcap: the last 600 s of \d+ cycles\n")
        self.assertFalse((self.folder / "run.mcap.ring").exists())

    def test_a_killed_machine_leaves_its_ring(self):
        machine = self.run_journaled(HEAP, "--journal-keep", "4s")
        ring = self.folder / "run.mcap.ring"
        wait_until(lambda: (ring / "000003.mcap.part").exists(), "three parts")
        self.wait_for_cycles(500)
        machine.send_signal(signal.SIGKILL)
        machine.wait()
        self.assertNotIn("first difference", self.replay("run.mcap.ring"))
        again = self.run_journaled(HEAP, "--journal-keep", "4s")
        self.wait_for_cycles(10)
        self.assertIn("is now 'run.mcap.ring.1'", self.finish(again))

    def test_the_ring_of_a_machine_that_runs_is_not_taken(self):
        machine = self.run_journaled(HEAP, "--journal-keep", "4s")
        self.wait_for_cycles(10)
        other = ["run", "a.hal", "-N", "other", "--journal", "run.mcap", "--journal-keep", "4s"]
        self.write("a.hal", HEAP)
        self.assertEqual(
            "hal run: cannot write 'run.mcap': another machine keeps its journal in "
            "'run.mcap.ring'; end that machine, or name another file\n",
            self.bad(*other),
        )
        self.wait_for_cycles(10)
        self.finish(machine)
        self.assertIn("no difference", self.replay("run.mcap"))
        self.assertEqual(0, self.run_program(*other, "--for", "10ms").returncode)

    def test_a_fault_writes_the_journal(self):
        machine = self.run_journaled(FAULT, "--journal-keep", "1min")
        written = self.folder / "run-fault-1.mcap"
        wait_until(written.exists, "the file of the fault")
        self.assertIn(
            "'run-fault-1.mcap' has the journal up to 2 s after a fault", self.finish(machine)
        )
        self.assertNotIn("first difference", self.replay("run-fault-1.mcap"))
        # another run keeps it
        before = written.read_bytes()
        machine = self.run_journaled(FAULT, "--journal-keep", "1min")
        wait_until((self.folder / "run-fault-2.mcap").exists, "the file of the second run")
        self.assertIn("'run-fault-2.mcap' has the journal", self.finish(machine))
        self.assertEqual(before, written.read_bytes())

    def test_a_journal_that_cannot_be_saved_leaves_the_machine_as_it_is(self):
        machine = self.run_journaled(HEAP)
        self.wait_for_cycles(100)
        text = self.bad("shell", "journal", "save", "none/a.mcap")
        self.assertIn("'none/a.mcap' cannot be written: No such file or directory", text)
        self.wait_for_cycles(10)
        self.good("shell", "journal", "save", "a.mcap")
        self.finish(machine)
        self.assertIn("no difference", self.replay("a.mcap"))

    def test_a_line_of_the_netlist_writes_a_journal(self):
        path = self.write("a.hal", "journal own.mcap keep=5s\n" + HEAP)
        self.assertEqual(0, self.run_program("check", path).returncode)
        self.assertEqual(0, self.run_program("sim", path, "--for", "10ms").returncode)
        machine = self.start("run", path)
        self.wait_for_cycles(200)
        self.good("shell", "journal", "save", "now.mcap")
        self.assertIn("own.mcap: the last 5 s of ", self.finish(machine))
        for name in ("own.mcap", "now.mcap"):
            self.assertIn("no difference", self.replay(name))
        # in a netlist that is sourced, beside the one that sources it
        (self.folder / "part").mkdir()
        (self.folder / "part/inner.hal").write_text("journal inner.mcap\n" + HEAP)
        (self.folder / "part/outer.hal").write_text("source inner.hal\nsource outer.hal\n")
        path = self.write("c.hal", "source part/outer.hal\n")
        machine = self.start("run", self.write("d.hal", "source part/inner.hal\n"))
        self.wait_for_cycles(100)
        self.finish(machine)
        self.assertIn("no difference", self.replay("inner.mcap"))
        self.assertIn("outer.hal", self.bad("run", path))  # it sources itself
        # in a netlist that an INI file names
        (self.folder / "part/a.ini").write_text("[HAL]\nHALFILE = named.hal\n")
        (self.folder / "part/named.hal").write_text("journal named.mcap\n" + HEAP)
        self.write("named.hal", "journal other.mcap\n")
        machine = self.start("run", "part/a.ini")
        self.wait_for_cycles(100)
        self.finish(machine)
        self.assertIn("no difference", self.replay("named.mcap"))
        two = "journal own.mcap\njournal own.mcap\njournal other.mcap\n"
        text = self.run_program("check", self.write("b.hal", two)).stderr
        self.assertEqual(
            "b.hal:3:1: warning: a machine has one journal, and that of b.hal:1 is another one: "
            "this line is ignored [ignored-option]\n"
            "    3 | journal other.mcap\n      | ^^^^^^^^^^^^^^^^^^\n"
            "      = help: remove one of the two lines\nb.hal: no errors\n",
            text.replace(str(self.folder) + "/", ""),
        )
        for line, problem in [
            ("journal own.csv", "'own.csv' is not a valid name of a journal"),
            ("journal own.mcap keep=0.1s", "'keep=0.1s' is not a valid duration of a journal"),
            ("journal own.mcap last=5s", "'last=5s' is not a valid duration of a journal"),
            ("journal save", "journal save needs a file"),
        ]:
            self.assertIn(problem, self.bad("check", self.write("b.hal", line + "\n")))

    def test_a_line_journal_beside_another_one_of_the_command_line_is_ignored_with_a_warning(self):
        self.write("two.hal", "journal own.mcap\n" + HEAP)
        self.write("two.ini", "[HAL]\nTWOPASS = on\nHALFILE = two.hal\n")
        for netlist in ("two.hal", "two.ini"):
            done = self.run_program("run", netlist, "--for", "50ms", "--journal", "other.mcap")
            self.assertEqual(0, done.returncode, done.stderr)
            warnings = re.findall("two.hal:1:1: warning: .*", done.stderr)
            self.assertEqual(
                [
                    "two.hal:1:1: warning: a machine has one journal, and the command line names it "
                    "by --journal other.mcap: this line is ignored [ignored-option]"
                ],
                warnings,
            )
            self.assertFalse((self.folder / "own.mcap").exists())
        done = self.run_program("run", "two.hal", "--for", "50ms", "--journal", "./own.mcap")
        self.assertNotIn("warning", done.stderr)

    def test_what_cannot_be_saved_is_named(self):
        for words, problem in [
            (["--journal-keep", "4s"], "--journal-keep needs --journal FILE"),
            (
                ["--journal", "a.mcap", "--journal-keep", "4s", "--values", "*"],
                "--journal-keep and --values exclude each other",
            ),
        ]:
            self.assertIn(problem, self.bad("run", self.write("a.hal", HEAP), *words))
        machine = self.start("run", self.write("a.hal", HEAP))
        for words, problem in [
            (["save", "a.mcap"], "'a.mcap' cannot be written: this machine has no journal"),
            (["save", "a.csv"], "'a.csv' cannot be written: its format is unknown"),
            (["show", "a.mcap"], "'show' is not a valid name of a journal"),
        ]:
            self.assertIn(problem, self.bad("shell", "journal", *words))
        line = self.run_program("shell", "journal", "own.mcap")
        self.assertIn(
            "warning: this machine has no journal: it begins with the machine [ignored-option]",
            line.stderr,
        )
        self.assertIn(
            "= help: write the line into a netlist that hal run or hal linuxcnc is given, or type: "
            "hal run --journal FILE.mcap\n",
            line.stderr,
        )
        self.end(machine)


if __name__ == "__main__":
    unittest.main()
