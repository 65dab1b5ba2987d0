# SPDX-License-Identifier: MIT
"""Threads that hang: the supervisor names the function, makes outputs safe, and commands fail with that fault."""
import ctypes
import json
import os
import re
import signal
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, PLUGINS, undisturbed, wait_until
from hung_case import MACHINE, HungCase

PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH = 0x4206, 0x4207, 17


class Debugger:
    """Stops one thread of a process, as a debugger does."""

    def __init__(self, tid):
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        self.libc.ptrace.restype = ctypes.c_long
        self.tid = tid
        if self.libc.ptrace(PTRACE_SEIZE, tid, None, None) != 0:
            raise unittest.SkipTest(f"no ptrace here: {os.strerror(ctypes.get_errno())}")
        if self.libc.ptrace(PTRACE_INTERRUPT, tid, None, None) != 0:
            raise OSError(ctypes.get_errno(), "PTRACE_INTERRUPT")
        os.waitpid(tid, 0x40000000)  # __WALL

    def go(self):
        self.libc.ptrace(PTRACE_DETACH, self.tid, None, None)


class Supervisor(HungCase):
    def test_a_cpu_that_the_machine_does_not_have_is_reported(self):
        path = self.write("t.hal", "newthread servo 1000000 policy=other cpu=1023\n")
        machine = self.start("run", path)
        out, err = self.end(machine)
        self.assertEqual(0, machine.returncode, out + err)
        self.assertRegex(
            err,
            r"^\S*t\.hal:1:11: warning: thread 'servo' is not bound to a CPU: this machine has no CPU 1023 \[ignored-option\]\n",
        )
        self.assertRegex(err, r"(?m)^ +\S help: write a cpu= from 0 to \d+, or omit it$")

    def test_blocked_function(self):
        machine = self.machine()
        self.check_hung(machine, self.hang(1), "waits in a system call")

    def test_endless_loop(self):
        machine = self.machine("policy=other")
        self.check_hung(
            machine, self.hang(2), "(uses CPU time|gets no CPU time)"
        )  # the latter is true on a busy host

    def test_function_that_returns_finds_its_thread_stopped(self):
        machine = self.machine()
        before = self.value("adder.out")
        self.assertEqual("2", before)
        fault = self.hang(4, 1500)
        self.assertIn("waits in a system call", fault)
        wait_until(lambda: "back" in self.events(), "the function returns")
        beat = self.value("servo.threadbeat")
        wait_until(lambda: self.value("servo.threadbeat") != beat, "the thread has cycles again")
        self.assertEqual("-1", self.value("s.out"))
        self.good("shell", "setp", "adder.in0", "9")
        self.assertEqual("2", self.value("adder.out"))
        self.assertRegex(self.shell("show", "timing").stdout, r"(?m)^servo .* stopped by a fault$")
        self.good("shell", "start")
        wait_until(
            lambda: self.value("adder.out") == "9" and self.value("s.out") == "5",
            "it runs again after start",
        )
        self.end(machine)
        self.assertEqual(1, machine.returncode)

    def test_stop_by_a_debugger(self):
        machine = self.machine()
        name = [
            t
            for t in Path(f"/proc/{machine.pid}/task").iterdir()
            if (t / "comm").read_text().strip() == "servo"
        ]
        self.assertEqual(1, len(name), "threads carry their names")
        debugger = Debugger(int(name[0].name))
        self.addCleanup(debugger.go)
        wait_until(
            lambda: "hung-thread" in self.shell("--json", "show", "fault").stdout,
            "the fault is known",
        )
        self.assertRegex(
            self.faults(),
            rf"no cycle ended for .*, stopped by the debugger with process ID {os.getpid()} ",
        )
        self.assertEqual("-1", self.value("s.out"))
        debugger.go()
        beat = self.value("servo.threadbeat")
        wait_until(lambda: self.value("servo.threadbeat") != beat, "the thread has cycles again")
        self.assertEqual("-1", self.value("s.out"))
        self.good("shell", "start")
        wait_until(lambda: self.value("s.out") == "5", "it runs again after start")

    def test_stop_of_the_whole_process(self):
        machine = self.machine()
        machine.send_signal(signal.SIGSTOP)
        wait_until(
            lambda: Path(f"/proc/{machine.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
            == "T",
            "it is stopped",
        )
        self.sleep(0.5)
        machine.send_signal(signal.SIGCONT)
        wait_until(
            lambda: "hung-thread" in self.shell("--json", "show", "fault").stdout,
            "the fault is known",
        )
        self.assertRegex(
            self.faults(),
            r"servo: the process got no CPU time for \d+ ms \(stopped by a signal or a debugger, or the host was busy\)",
        )
        self.assertEqual("-1", self.value("s.out"))
        self.good("shell", "start")
        wait_until(lambda: self.value("s.out") == "5", "it runs again after start")

    @staticmethod
    def sleep(seconds):
        import time

        time.sleep(seconds)

    def test_overrun_of_many_periods_is_a_fault_that_names_the_function(self):
        self.machine()
        self.good("shell", "setp", "s.ms", "25")
        self.good("shell", "setp", "s.mode", "3")
        wait_until(
            lambda: "overrun" in self.shell("--json", "show", "fault").stdout, "the fault is known"
        )
        self.assertRegex(
            self.faults(),
            r"servo: the cycle took 2\d(\.\d+)? ms \(2\d periods\), last seen in function 's' \(stall\) at cycle ",
        )
        self.assertEqual("5", self.value("s.out"))

    def test_fault_is_printed_when_it_happens(self):
        machine = self.machine()
        self.good("shell", "setp", "s.ms", "25")
        self.good("shell", "setp", "s.mode", "3")
        while "'s' (stall)" not in (
            line := machine.stderr.readline()
        ):  # a busy host has overruns of its own
            self.assertTrue(line, "it ended")
        self.assertRegex(
            line,
            r"^fault: servo: the cycle took [\d.]+ ms \(\d+ periods\), last seen in function 's' \(stall\) at cycle .* \[overrun\]\n$",
        )
        self.assertIsNone(machine.poll())
        self.good("explain", "[overrun]")

    def test_storm_of_faults_is_a_line_per_second_with_a_count(self):
        self.environment["HALCYON_PLUGIN_PATH"] = (
            str(HAL.parent.parent / "tests/plugins") + ":" + PLUGINS
        )
        machine = self.start(
            "run",
            self.write(
                "a.hal",
                "newthread servo 1000000\nloadrt test_faulty names=f\nloadrt sum2 names=adder\n"
                "addf f.run servo\naddf adder servo\n",
            ),
        )
        self.good("shell", "setp", "f.raises", "TRUE")
        first = machine.stderr.readline()
        self.assertRegex(
            first, r"^fault: f: a finger in the gear \(3\) at cycle .* \[component\]\n$"
        )
        wait_until(
            lambda: json.loads(self.shell("--json", "show", "fault").stdout)[-1]["count"] > 1000,
            "a storm",
        )
        self.good("shell", "setp", "f.raises", "FALSE")

        def all_recorded():  # the last second of a storm is counted before it is recorded
            shown = self.faults()
            recorded = sum(
                record["count"]
                for record in json.loads(self.shell("--json", "show", "fault").stdout)
            )
            return shown.splitlines()[-1].split()[0] == str(recorded)

        wait_until(all_recorded, "the storm is over")
        out, err = self.end(machine)
        lines = [first, *(line for line in err.splitlines() if "finger" in line)]
        counted = sum(
            int(found[1]) if (found := re.search(r"\((\d+) times", line)) else 1 for line in lines
        )
        self.assertEqual(re.search(r"(?m)^(\d+) faults:$", out)[1], str(counted), err)
        self.assertLess(len(lines), counted / 100, err)

    def test_unsupervised_thread_is_reported_and_hangs_unnoticed(self):
        machine = self.machine("supervise=off")
        self.good("shell", "setp", "s.mode", "4")
        wait_until(lambda: "back" in self.events(), "the function returns")
        wait_until(lambda: self.value("s.out") == "5", "the thread goes on")
        self.assertRegex(self.shell("show", "timing").stdout, r"(?m)^servo .*, not supervised")
        out, _ = self.end(machine)
        self.assertIn("thread servo is not supervised (supervise=off)", out)

    def test_stop_and_setp_of_an_unsupervised_thread_that_hangs_are_errors(self):
        self.machine("supervise=off policy=other")
        self.good("shell", "setp", "s.mode", "1")
        wait_until(lambda: "hang" in self.events(), "it hangs")
        self.sleep(1.2)
        for words in (
            ["setp", "adder.in0", "7"],
            ["-f", self.write("stop.hal", "begin\nsetp other.in1 4\nstop\ncommit\n")],
        ):
            done = self.shell(*words)
            self.assertEqual(1, done.returncode, words)
            self.assertIn("[silent-thread]", done.stderr, words)
        self.assertEqual("0", self.value("other.in1"))

    def test_component_whose_stop_does_not_return_is_named_and_does_not_keep_the_machine(self):
        machine = self.start(
            "run",
            self.write("a.hal", "newthread servo 1000000\nloadrt stuck\naddf stuck.0 servo\n"),
        )
        machine.send_signal(signal.SIGTERM)
        err = undisturbed(machine.communicate(timeout=120)[1])
        self.assertEqual(1, machine.returncode)
        self.assertEqual(
            "hal: 'stuck.0' (stuck) has not returned from stop for 2 s; the machine ends when it returns, at the latest in 13 s\n"
            "hal: 'stuck.0' (stuck) has not returned from stop for 15 s; outputs set to their safe values; the process ends\n",
            err,
        )

    def test_component_that_announces_a_long_stop_is_not_a_hang(self):
        machine = self.start(
            "run",
            self.write(
                "a.hal", "newthread servo 1000000\nloadrt stuck takes=3000\naddf stuck.0 servo\n"
            ),
        )
        machine.send_signal(signal.SIGTERM)
        err = undisturbed(machine.communicate(timeout=120)[1])
        self.assertEqual(0, machine.returncode)
        self.assertEqual(
            "hal: 'stuck.0' (stuck) needs up to 5 s to stop: a slow bus still sends what is queued\n",
            err,
        )

    def test_component_whose_start_does_not_return_is_named_while_the_machine_goes_on(self):
        machine = self.start(
            "run",
            self.write(
                "a.hal", "newthread servo 1000000\nloadrt stuck start=1\naddf stuck.0 servo\n"
            ),
            loaded=False,
        )
        self.assertEqual(
            "hal: 'stuck.0' (stuck) has not returned from start for 2 s; all commands wait for it\n",
            machine.stderr.readline(),
        )
        machine.send_signal(signal.SIGTERM)
        err = undisturbed(machine.communicate(timeout=120)[1])
        self.assertEqual(1, machine.returncode)
        self.assertIn(
            "(stuck) has not returned from start for 2 s; the machine ends when it returns, at the latest in 13 s\n",
            err,
        )

    def test_thread_without_cpu_time_is_told_apart_from_one_that_hangs(self):
        machine = self.machine("policy=other cpu=0")
        busy = [
            subprocess.Popen(
                [sys.executable, "-c", "import os\nos.sched_setaffinity(0, {0})\nwhile True: pass"]
            )
            for _ in range(3)
        ]
        for one in busy:
            self.addCleanup(one.wait)
            self.addCleanup(one.kill)
        (thread,) = (
            int(task.name)
            for task in Path(f"/proc/{machine.pid}/task").iterdir()
            if (task / "comm").read_text().strip() == "servo"
        )
        os.sched_setscheduler(
            thread, os.SCHED_IDLE, os.sched_param(0)
        )  # it gets what the others leave
        wait_until(
            lambda: "starved-thread" in self.shell("--json", "show", "fault").stdout,
            "the fault is known",
        )
        fault = self.faults()
        self.assertRegex(
            fault,
            r"servo: ready to run, but got no CPU time for [\d.]+ m?s \(limit 100 ms\) at cycle [\d ]+; the thread's functions are "
            r"stopped and its outputs were set to their safe values; see: show thread servo, start; .* uses CPU 0: move it to another CPU "
            r"\(taskset -cp\), or cpu=N of newthread binds the thread to another CPU",
        )
        self.assertNotIn("(stall)", fault)
        self.assertEqual("-1", self.value("s.out"))
        started = self.shell("start")
        if started.returncode != 0:  # otherwise it has just had a cycle
            self.assertRegex(
                started.stderr,
                r"thread 'servo' is ready to run, but has got no CPU time on CPU 0 for [\d.]+ m?s \[starved-thread\]",
            )
            self.assertNotIn("does not return", started.stderr)
        for one in busy:
            one.kill()
        os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))
        wait_until(
            lambda: self.shell("start").returncode == 0 and self.value("s.out") == "5",
            "it runs again after start",
        )

    def test_hang_that_lasts_is_not_acknowledged(self):
        path = self.write(
            "a.hal",
            MACHINE.format(options="")
            + "loadrt faults\naddf faults slow\nloadrt estop_latch\naddf estop-latch.0 slow\n"
            "net ok faults.ok => estop-latch.0.ok-in\n",
        )
        self.start("run", path)
        wait_until(
            lambda: self.value("faults.ok") == "TRUE" or self.shell("fault", "clear"),
            "no fault of a busy host",
        )
        self.hang(4, 3000)
        wait_until(lambda: self.value("faults.ok") == "FALSE", "the safety chain sees it")
        done = self.shell("fault", "clear")
        self.assertEqual(0, done.returncode)
        self.assertRegex(
            done.stderr,
            r"warning: 1 fault lasts and is not acknowledged: servo: function 's' \(stall\) has not returned, .* \[lasting-fault\]",
        )
        self.good("shell", "setp", "estop-latch.0.reset", "TRUE")
        beat = int(self.value("slow.threadbeat"))
        wait_until(
            lambda: int(self.value("slow.threadbeat")) > beat + 3, "the chain had its cycles"
        )
        self.assertEqual(
            ("FALSE", "FALSE"), (self.value("faults.ok"), self.value("estop-latch.0.ok-out"))
        )
        wait_until(lambda: "back" in self.events(), "the function returns")
        self.assertIn(
            "[lasting-fault]", self.shell("fault", "clear").stderr
        )  # its thread is stopped
        wait_until(lambda: self.shell("start").returncode == 0, "it runs again")
        self.assertEqual("FALSE", self.value("faults.ok"))
        wait_until(
            lambda: "[lasting-fault]" not in self.shell("fault", "clear").stderr
            and self.value("faults.ok") == "TRUE",
            "it is over",
        )

    def test_limit_of_its_own(self):
        self.machine("supervise=30ms")
        self.assertIn("(limit 30 ms)", self.hang(4, 200))

    def test_limit_below_three_periods_is_rejected(self):
        error = self.bad("check", self.write("a.hal", "newthread servo 1000000 supervise=2ms\n"))
        self.assertIn(
            "a supervision limit of 2 ms is too short for a period of 1 ms [bad-argument]", error
        )

    def test_alive_pin_changes_until_a_thread_hangs(self):
        path = self.write("a.hal", MACHINE.format(options="") + "loadrt faults\naddf faults slow\n")
        self.start("run", path)
        wait_until(lambda: self.value("faults.alive") == "TRUE", "it changes")
        wait_until(lambda: self.value("faults.alive") == "FALSE", "it changes back")
        self.hang(1)
        level = self.value("faults.alive")
        beat = int(self.value("slow.threadbeat"))
        wait_until(lambda: int(self.value("slow.threadbeat")) > beat + 30, "its thread goes on")
        self.assertEqual(level, self.value("faults.alive"))
        self.assertEqual(("FALSE", "4"), (self.value("faults.ok"), self.value("faults.last-code")))

    def test_watchdog_device_is_fed_until_a_thread_hangs(self):
        device = self.folder / "watchdog"
        os.mkfifo(device)
        reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        machine = self.machine("", "--watchdog", device)

        def drained():
            try:
                return os.read(reader, 4096)
            except BlockingIOError:
                return b""

        wait_until(drained, "it is fed")
        self.hang(1)
        drained()
        self.sleep(0.5)
        self.assertEqual(b"", drained())
        out, err = self.end(machine)
        self.assertNotIn(b"V", drained())
        self.assertIn("was not disarmed, because a thread does not end", err)
        self.assertEqual(1, machine.returncode)

    def test_watchdog_device_is_disarmed_at_an_orderly_end(self):
        device = self.folder / "watchdog"
        os.mkfifo(device)
        reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        machine = self.machine("", "--watchdog", device)
        wait_until(lambda: self.value("s.out") == "5", "it runs")
        self.end(machine)
        fed = os.read(reader, 65536)
        self.assertTrue(fed.endswith(b"V") and set(fed[:-1]) <= {0}, fed)
        self.assertEqual(0, machine.returncode)

    def test_watchdog_device_that_is_missing_is_an_error(self):
        error = self.bad(
            "run",
            self.write("a.hal", MACHINE.format(options="")),
            "--watchdog",
            "/nowhere/watchdog",
        )
        self.assertIn("cannot open '/nowhere/watchdog': No such file or directory", error)

    def test_watchdog_device_that_accepts_no_write_is_an_error(self):
        error = self.bad(
            "run", self.write("a.hal", MACHINE.format(options="")), "--watchdog", "/dev/full"
        )
        self.assertEqual("hal run: cannot write to '/dev/full': No space left on device\n", error)

    def test_watchdog_device_that_rejects_the_disarming_is_named_with_the_reason(self):
        device = self.folder / "watchdog"
        os.mkfifo(device)
        reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        machine = self.machine("", "--watchdog", device)
        os.close(reader)  # further writes fail
        _, error = self.end(machine)
        self.assertIn(
            f"{device} cannot be disarmed: Broken pipe; it resets this host after its timeout",
            error,
        )
        self.assertEqual(1, machine.returncode)

    def simulation(self, mode, *words):
        path = self.write(
            "a.hal",
            f"newthread servo 1000000\nloadrt stall names=s file=events.txt\naddf s servo\nsetp s.mode {mode}\n",
        )
        sim = subprocess.Popen(
            ["hal", "sim", path, "--for", "1s", *words],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(sim.kill)
        return sim

    def test_hang_on_the_virtual_clock_ends_with_a_signal(self):
        sim = self.simulation(2)
        wait_until(lambda: "hang" in self.events(), "it hangs")
        sim.send_signal(signal.SIGTERM)
        _, err = sim.communicate(timeout=60)
        self.assertEqual(1, sim.returncode)
        self.assertRegex(
            err,
            r"^hal: servo: function 's' \(stall\) has not returned for [\d.]+ s of wall time \(cycle 0\); "
            r"outputs were set to their safe values; the process ends \[hung-thread\]\n$",
        )

    def test_hang_on_the_virtual_clock_is_reported_while_it_lasts(self):
        sim = self.simulation(1)
        line = sim.stderr.readline()
        self.assertEqual(
            "hal: servo: function 's' (stall) has not returned for 10 s of wall time (cycle 0); it goes on (--cycle-limit TIME ends it)\n",
            line,
        )
        self.assertIsNone(sim.poll())
        self.assertNotIn("safe", self.events())

    def test_cycle_limit_ends_a_hang_on_the_virtual_clock(self):
        sim = self.simulation(2, "--cycle-limit", "300ms")
        _, err = sim.communicate(timeout=60)
        self.assertEqual(1, sim.returncode)
        self.assertRegex(
            err,
            r"^hal: servo: function 's' \(stall\) has not returned for [\d.]+ m?s of wall time \(cycle 0\); "
            r"outputs were set to their safe values; the process ends \[hung-thread\]\n$",
        )
        self.assertIn("safe", self.events())
        self.assertIn("invalid duration 'soon'", self.bad("sim", "x.hal", "--cycle-limit", "soon"))

    def test_cycle_limit_ends_a_run_whose_cycle_has_ended_too_late(self):
        path = self.write(
            "short.hal", "newthread servo 1000000\nloadrt siggen\naddf siggen.0.update servo\n"
        )
        self.assertRegex(
            self.bad("sim", path, "--cycle-limit", "1ns", "--for", "1s"),
            # the watcher may look while the function is in its call
            r"^hal: servo: (the cycle took [\d.]+ [mun]?s of wall time \(--cycle-limit 1 ns, cycle 0\)|"
            r"function 'siggen.0.update' \(siggen\) has not returned for [\d.]+ [mun]?s of wall time \(cycle 0\)); "
            r"outputs were set to their safe values; the process ends \[hung-thread\]\n$",
        )
        self.good("sim", "-q", path, "--cycle-limit", "10min", "--for", "1s")


if __name__ == "__main__":
    unittest.main()
