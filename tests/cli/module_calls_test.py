#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""What LinuxCNC's compiled modules do to the machine as a whole, and their tasks. The modules are in modules/, compiled here; LinuxCNC is not needed."""
import re
import signal
import subprocess
import unittest

import harness
from harness import wait_until
from module_case import CC, ModuleCase

GUARDED = harness.HAL.parent / "rt-guard" / "hal"  # the program with the real-time guard
SERVO = "newthread servo 1000000\n"


@unittest.skipUnless(CC, "no C compiler")
class ModuleCalls(ModuleCase):
    # --- wiring, values, locks -------------------------------------------------------------------------------------------

    def test_a_module_wires_itself_up_and_takes_itself_apart(self):
        self.build("wires")
        done = self.sim(
            """loadrt sum2 names=sum
setp sum.in1 100
loadrt wires
advance 2 cycles
gets w
getp wires.more
getp wires.late
getp wires.denied
getp wires.add
getp sum.out
getp sum.tmax
unloadrt wires
advance 1 cycles
list sig
getp sum.in0
delf sum wired
loadrt wires
advance 2 cycles
gets w
"""
        )
        self.assertEqual(
            (0, "6\n6\n12\n-1\n3\n106\n7\n\n6\n6\n".split()),
            (done.returncode, done.stdout.split()),
            done.stderr,
        )
        said = """hal_signal_new: 'w': signal 'w' already exists
hal_signal_new: 'x': unsupported type
hal_link: 'nothing': unknown pin 'nothing'
new 0 -22 -22, link 0 0 0 0 -22
hal_add_funct_to_thread: 'wires': function 'wires' is already in thread 'wired'
hal_add_funct_to_thread: 'wires': unknown thread 'unwired'
hal_del_funct_from_thread: 'sum': function 'sum' is not in thread 'wired'
addf 0 0 0 -22 -22, delf 0 -22, addf 0
hal_param_set: 'wires.gain': the parameter has another type
hal_param_set: 'nothing': unknown parameter
set 0 3, type -22, foreign 0, missing -22
alias 0 0 0 0
sum.in1: type 2, 100, 0
wires.out: type 2, 0, 1
w: type 2, 0, 1
wires.gain: type 2, 3, 0
hal_get_pin_value_by_name: 'wires.gain': unknown name
wires.gain as a pin: -22
hal_port_alloc: the size is 0
port 1 1 0 abcd 4, none 0
hal_set_constructor: '(null)': unknown component, or no function
make 0 -22, unready -22, realtime 1 0
rtapi 1, exit 0 -22
start 0
"""
        ended = """hal_signal_delete: 'nothing': unknown name
hal_link: 'sum.in0': only while a module is loaded, in rtapi_app_main
unlink 0 0, delete 0 -22, link -1, made 0
"""
        warning = f"""{self.folder}/m.hal:3:8: warning: signal 'w' has no writer any more: its readers keep the value it has [lost-writer]
    3 | loadrt wires
      |        ^^^^^
      = help: for another writer, type: net w PIN; for another value: sets w VALUE

1 warning; the edit took effect
"""
        self.assertEqual(said + ended + warning + said + ended, done.stderr)

    def test_what_a_module_did_is_undone_when_its_load_fails(self):
        self.build("wires")
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "loadrt sum2 names=sum\nloadrt wires mode=fail\nlist sig\nlist thread\nlist pin wires sum\ngetp sum.tmax\nloadrt wires\nlist sig\nlist thread\n",
            ),
        )
        self.assertEqual(
            (1, ["sum.in0", "sum.in1", "sum.out", "sum.time", "0", "w", "wired"]),
            (done.returncode, done.stdout.split()),
            done.stderr,
        )
        self.assertIn(
            "component 'wires' cannot make 'wires': hal_signal_new: 'w': signal 'w' already exists (rtapi_app_main: Input/output error (-5)) [construct-failed]",
            done.stderr,
        )
        self.assertEqual(2, done.stderr.count("new 0 -22 -22, link 0 0 0 0 -22\n"))

    def test_what_a_module_did_is_undone_with_a_later_line(self):
        self.build("wires")
        done = self.run_program(
            "sim",
            "--quiet",
            "-k",
            self.write(
                "m.hal",
                "loadrt sum2 names=sum\nbegin\nloadrt wires\nnet y nothing.out\ncommit\nlist sig\nlist thread\nloadrt wires\nadvance 2 cycles\ngets w\n",
            ),
        )
        self.assertEqual((1, ["6"]), (done.returncode, done.stdout.split()), done.stderr)

    def test_a_load_that_is_rolled_back_deletes_nothing_later(self):
        self.build("wires")
        done = self.sim(
            "newthread t 1000000\nloadrt sum2 names=sum\nnewsig w float\nadvance 1 cycles\nbegin\nloadrt wires\nabort\nnewsig z bit\nadvance 1 cycles\nlist sig\n"
        )
        self.assertEqual((0, ["w", "z"]), (done.returncode, done.stdout.split()), done.stderr)

    def test_a_module_meets_and_sets_locks(self):
        self.build("wires")
        done = self.sim(
            "loadrt sum2 names=sum\nloadrt wires mode=lock\nadvance 1 cycles\nstatus lock\nunlock all\n"
        )
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("before 0, set 0, then 2, new -1, start 0, set 0\n", done.stderr)
        self.assertIn("hal_signal_new: 'w': it is locked (lock, hal_set_lock)\n", done.stderr)
        self.assertIn("current lock value 2 (02)", done.stdout)

    def test_what_halcompile_generates_for_new_instances_loads(self):
        (self.folder / "made.c").write_text(
            """int hal_init(const char *), hal_ready(int), hal_set_constructor(int, int (*)(char *, char *));
static int make(char *prefix, char *argument) { return prefix && argument ? 0 : -1; }
int rtapi_app_main(void) { const int comp = hal_init("made"); return hal_set_constructor(comp, make) || hal_ready(comp); }
void rtapi_app_exit(void) {}
"""
        )
        subprocess.run(
            [
                CC,
                "-shared",
                "-fPIC",
                "-o",
                str(self.modules / "made.so"),
                str(self.folder / "made.c"),
            ],
            check=True,
        )
        self.assertIn(
            "made", self.good("sim", "--quiet", self.write("m.hal", "loadrt made\nlist comp\n"))
        )

    # --- the clock -------------------------------------------------------------------------------------------------------

    def test_a_module_adjusts_the_period_of_its_thread(self):
        self.build("phase")
        done = self.sim(
            """loadrt phase
addf phase phase-thread
start
advance 3 cycles
getp phase.period
setp phase.correction 1000
setp phase.set 1
advance 3 cycles
getp phase.period
getp phase.result
setp phase.set 0
advance 5 cycles
getp phase.period
setp phase.correction -2000
setp phase.set 1
advance 5 cycles
getp phase.period
setp phase.correction 0
advance 3 cycles
getp phase.period
"""
        )
        self.assertEqual(
            (
                0,
                ["1200000", "1201000", "0", "1201000", "1198000", "1200000"],
                "rtapi_clock_set_period: 'clock': it runs already\nphase: -22, 0 400000 -22 400000\n",
            ),
            (done.returncode, done.stdout.split(), done.stderr),
        )

    def test_one_component_adjusts_the_clock(self):
        self.build("phase")
        (self.modules / "other.so").write_bytes(
            (self.modules / "phase.so").read_bytes().replace(b"phase", b"other")
        )
        done = self.sim(
            "loadrt phase\nloadrt other\naddf other other-thread\nsetp other.set 1\nstart\nadvance 3 cycles\ngetp other.result\ngetp other.period\n"
        )
        self.assertEqual(
            (0, ["-22", "1200000"]), (done.returncode, done.stdout.split()), done.stderr
        )

    # --- tasks -----------------------------------------------------------------------------------------------------------

    def test_a_task_runs_beside_the_threads_with_pins_and_parameters(self):
        self.build("ticker")
        machine = self.start(
            "run",
            self.write(
                "m.hal",
                SERVO
                + "loadrt sum2 names=sum\nloadrt ticker\naddf sum servo\naddf ticker servo\nnet a sum.out ticker.in\nnet b ticker.twice sum.in0\n",
            ),
        )
        self.say("setp", "sum.gain0", "0.25")  # out = 0.25 * twice + in1, twice = 2 * out + step
        self.say("setp", "ticker.step", "5")
        self.comes("ticker.twice", "10")
        self.say("setp", "sum.in1", "1.5")
        self.comes("sum.out", "5.5")
        self.assertEqual(("1", "-1"), (self.value("ticker.self"), self.value("ticker.created")))
        self.say("unlinkp", "ticker.in")
        self.say("setp", "ticker.in", "2")
        self.comes("ticker.twice", "9")
        self.comes("sum.out", "3.75")
        self.say("net", "a", "ticker.in")
        self.comes("sum.out", "5.5")
        self.say("stop")
        count = int(self.value("ticker.count"))
        wait_until(
            lambda: int(self.value("ticker.count")) > count + 5,
            "it counts although the threads are stopped",
        )
        self.say("setp", "ticker.step", "6")
        self.comes("ticker.twice", "17")
        self.say("start")
        self.comes("ticker.twice", "18")
        self.say("setp", "ticker.pause", "1")
        self.pass_time()
        count = self.value("ticker.count")
        self.pass_time()
        self.assertEqual((count, "0"), (self.value("ticker.count"), self.value("ticker.seen")))
        self.say("setp", "ticker.pause", "0")
        wait_until(lambda: int(self.value("ticker.count")) > int(count), "it goes on")
        unloaded = self.shell("unloadrt", "ticker")
        self.assertEqual(0, unloaded.returncode)
        self.assertIn("signal 'b' has no writer any more", unloaded.stderr)
        self.say("loadrt", "ticker", "fault=leave")
        wait_until(lambda: int(self.value("ticker.count")) > 5, "it counts again")
        self.say("unloadrt", "ticker")
        out, err = self.end(machine)
        self.assertNotIn("machine's own", err)
        self.assertRegex(
            err,
            re.escape(
                """rtapi_task_new: the owner is not an id of this module
rtapi_task_new: the priority is not one of rtapi_prio_...
rtapi_task_new: no code
ticker: bad -22 -22 -22, priorities 1 1 1, self -22
rtapi_task_resume: a task without a period could not be ended and would keep the CPU; rtapi_task_start gives it one
rtapi_task_start: unknown task
rtapi_task_start: the period is 0
rtapi_task_start: the task is not paused
ticker: free-running -38, unknown -22, period -22, start 0 -22
"""
            ),
        )
        self.assertIn("ticker: delete 0 -22, counted 1\n", err)
        self.assertIn("ticker: the task has argument text\n", err)

    def pass_time(self):
        beat = int(self.value("servo.threadbeat"))
        wait_until(lambda: int(self.value("servo.threadbeat")) > beat + 20, "20 cycles")

    def test_edits_while_a_task_runs(self):
        self.build("ticker")
        machine = self.start(
            "run",
            self.write(
                "m.hal", SERVO + "loadrt sum2 names=sum\nloadrt ticker\naddf sum servo\nstart\n"
            ),
        )
        for turn in range(30):
            self.say("net", f"a{turn}", "sum.out", "ticker.in")
            self.say("net", f"b{turn}", "ticker.twice", "sum.in0") if turn % 2 else None
            self.say("delsig", "all")
        wait_until(lambda: int(self.value("ticker.count")) > 100, "it counts")
        self.end(machine)

    def test_a_task_needs_the_real_clock(self):
        self.build("ticker")
        error = self.error("loadrt ticker\n")
        self.assertIn(
            "rtapi_task_new: a task runs in real time, which hal sim does not; hal run does\n",
            error,
        )
        self.assertIn("(rtapi_app_main: Function not implemented (-38)) [construct-failed]", error)

    def run_with(self, fault, program=harness.HAL, more=""):
        netlist = self.write("m.hal", SERVO + f"loadrt ticker fault={fault}\n{more}")
        return subprocess.run(
            [str(program), "run", netlist],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=harness.TIMEOUT,
        )

    def test_a_failed_load_ends_its_tasks(self):
        self.build("ticker")
        done = self.run_with("main")
        self.assertEqual(1, done.returncode)
        self.assertIn("start 0 -22\n", done.stderr)
        self.assertIn("(rtapi_app_main: Input/output error (-5)) [construct-failed]", done.stderr)

    def test_a_task_that_returns_has_ended(self):
        self.build("ticker")
        machine = self.start("run", self.write("m.hal", SERVO + "loadrt ticker fault=return\n"))
        self.comes("ticker.count", "3")
        self.say("unloadrt", "ticker")
        self.say("loadrt", "ticker")
        wait_until(lambda: int(self.value("ticker.count")) > 5, "it counts")
        self.end(machine)

    @unittest.skipIf(harness.SANITIZED, "the sanitizer takes crash signals")
    def test_a_crash_in_a_task_names_the_module(self):
        self.build("ticker")
        done = self.run_with("crash")
        self.assertEqual(-signal.SIGSEGV, done.returncode)
        self.assertIn(
            "hal: ticker: a task of the module's own crashed (segmentation fault); outputs were set to their safe values; the process ends\n",
            done.stderr,
        )

    def test_a_task_that_ends_the_process_is_named(self):
        self.build("ticker")
        done = self.run_with("exit")
        self.assertEqual(3, done.returncode)
        self.assertIn(
            "hal: ticker: a task of the module's own called exit(); outputs were set to their safe values; the process ends\n",
            done.stderr,
        )

    @unittest.skipUnless(GUARDED.exists(), "no clang 19: no real-time guard")
    def test_the_real_time_guard_names_a_task_that_allocates(self):
        self.build("ticker")
        done = self.run_with("malloc", GUARDED)
        self.assertEqual(1, done.returncode, done.stderr)
        self.assertRegex(done.stderr, "Real-time violation: .*`malloc`")
        self.assertIn(
            "hal: ticker: a task of the module's own made the call that the real-time guard prints above; outputs were set to their safe values; the process ends\n",
            done.stderr,
        )

    def test_a_task_that_does_not_wait_is_reported_and_its_code_stays(self):
        self.build("ticker")
        machine = self.start("run", self.write("m.hal", SERVO + "loadrt ticker fault=silent\n"))
        self.comes("ticker.count", "3")
        self.say("unloadrt", "ticker")
        again = self.shell("loadrt", "ticker")
        self.assertIn(
            "it has crashed, or a task of it did not end; end this machine and start it again before you load it [construct-failed]",
            again.stderr,
        )
        out, err = self.end(machine)
        self.assertIn("hal: ticker: task 1 has not called rtapi_wait() for 0.1 s\n", err)
        self.assertIn(
            "ticker: task 1 has not called rtapi_wait() for 1 s and cannot be ended; its code stays in memory until the machine ends\n",
            err,
        )

    # --- what it cannot do -------------------------------------------------------------------------------------------------

    def test_what_linuxcnc_does_not_export_either(self):
        for symbol, why in (
            (
                "rtapi_sem_new",
                "is declared in LinuxCNC's headers, but LinuxCNC does not export it to modules either",
            ),
            (
                "rtapi_fifo_new",
                "is declared in LinuxCNC's headers, but LinuxCNC does not export it to modules either",
            ),
            (
                "halpr_find_pin_by_name",
                "reads LinuxCNC's memory directly, which a machine of Halcyon does not have",
            ),
        ):
            (self.folder / "other.c").write_text(
                f"int {symbol}(void);\nint rtapi_app_main(void) {{ return {symbol}(); }}\nvoid rtapi_app_exit(void) {{}}\n"
            )
            subprocess.run(
                [
                    CC,
                    "-shared",
                    "-fPIC",
                    "-o",
                    str(self.modules / "other.so"),
                    str(self.folder / "other.c"),
                ],
                check=True,
            )
            with self.subTest(symbol):
                self.assertIn(
                    f"it uses {symbol}, which {why} [construct-failed]",
                    self.error("loadrt other\n"),
                )


if __name__ == "__main__":
    unittest.main()
