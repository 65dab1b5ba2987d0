# SPDX-License-Identifier: MIT
"""Functions that change the process or thread around them: contained, named, never a hang."""
import os
import re
import resource
import signal
import subprocess
import time
import unittest
from pathlib import Path

from harness import HAL, SANITIZED, TIMEOUT, Case, undisturbed, wait_until

MACHINE = """newthread servo 1000000 policy=other
newthread slow 10000000 policy=other
loadrt violate names=v
loadrt sum2 names=adder,other
addf v.act servo
addf v.look servo
addf adder servo
addf other slow
net level v.out => other.in0
"""
INSTRUCTIONS = os.uname().machine in ("x86_64", "aarch64")  # that the component can write down


def machines(parent):
    """The processes that a machine has forked and that run: not its observer, nor what has ended."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            name, rest = (entry / "stat").read_text().rsplit(")", 1)
        except OSError:
            continue
        state, of = rest.split()[:2]
        if int(of) == parent and state != "Z" and "hal-observer" not in name:
            found.append(int(entry.name))
    return found


def cpu_seconds(process):
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Violations(Case):
    def machine(self, *words):
        machine = self.start("run", self.write("a.hal", MACHINE), *words)
        wait_until(lambda: self.value("v.out") == "5", "its functions run")
        return machine

    def faults(self):
        return self.shell("show", "fault").stdout

    def violate(self, mode):
        """Sets the mode of a running machine; the fault that follows."""
        self.good("shell", "setp", "v.mode", mode)
        return wait_until(
            lambda: "cycle-violation" in self.shell("--json", "show", "fault").stdout
            and self.faults(),
            "the fault is known",
        )

    def check_goes_on(self, machine):
        runs = self.value("v.runs")
        wait_until(lambda: self.value("v.runs") != runs, "the thread goes on")
        out, err = self.end(machine)
        self.assertEqual(0, machine.returncode, out + err)

    def ends(self, machine):
        """Standard error of a machine that ends by itself."""
        begun = time.monotonic()
        out, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(1, machine.returncode, out + err)
        self.assertLess(time.monotonic() - begun, TIMEOUT / 2)
        return undisturbed(err)

    # --- floating-point modes

    def test_modes_that_a_function_changes_are_reset_before_the_next_function(self):
        path = self.write(
            "a.hal",
            MACHINE.replace(" policy=other", "")
            + "setp v.mode 1\nstart\nadvance 300 cycles\ngetp v.seen\nshow fault\n",
        )
        done = self.run_program("sim", path)
        self.assertRegex(done.stdout, r"(?m)^0$")
        self.assertIn(
            "servo: function 'v.act' (violate) changed the floating-point modes (rounding) at cycle 0; they were "
            "reset; the function must restore them before it returns\n",
            done.stdout,
        )
        self.assertEqual(1, done.stdout.count("floating-point"), done.stdout)

    def test_modes_that_are_changed_later_name_the_function_in_the_next_cycle(self):
        path = self.write(
            "a.hal",
            MACHINE.replace(" policy=other", "")
            + "start\nadvance 300 cycles\nsetp v.mode 1\nadvance 300 cycles\ngetp v.seen\nshow fault\n",
        )
        done = self.run_program("sim", path)
        self.assertRegex(done.stdout, r"(?m)^1$")
        self.assertRegex(
            done.stdout,
            r"function 'v\.act' \(violate\) changed the floating-point modes \(rounding\) at cycle 301;",
        )

    def test_a_function_that_changes_modes_once_is_unknown_but_its_modes_are_reset(self):
        for mode, name in ((2, "rounding"), (3, "flush to zero")):
            with self.subTest(name):
                path = self.write(
                    "a.hal",
                    MACHINE.replace(" policy=other", "")
                    + f"start\nadvance 300 cycles\nsetp v.mode {mode}\nadvance 300 cycles\ngetp v.seen\nshow fault\n",
                )
                done = self.run_program("sim", path)
                self.assertRegex(done.stdout, r"(?m)^1$")
                self.assertRegex(
                    done.stdout,
                    rf"servo: a function changed the floating-point modes \({name}[^)]*\) at cycle 301; they were reset; "
                    r"it did so in one cycle only, so it is unknown which one it was\n",
                )

    @unittest.skipIf(SANITIZED, "the sanitizer takes the signal")
    @unittest.skipUnless(os.uname().machine == "x86_64", "exceptions do not trap there")
    def test_an_unmasked_exception_does_not_end_the_machine(self):
        machine = self.machine()
        fault = self.violate(4)
        self.assertRegex(
            fault,
            r"function 'v\.act' \(violate\) changed the floating-point modes \(exceptions that trap\) at cycle",
        )
        self.assertEqual("inf", self.value("v.out"))
        self.assertLess(int(self.value("v.seen")), 2)
        self.check_goes_on(machine)

    def test_changed_modes_last_until_the_function_leaves_them(self):
        machine = self.machine()
        self.violate(1)
        self.assertIn("lasts", self.shell("fault", "clear").stderr)
        self.good("shell", "setp", "v.mode", 0)
        wait_until(lambda: self.shell("fault", "clear").stderr == "", "the condition is over")
        self.check_goes_on(machine)

    def test_modes_of_a_constructor_hold_nowhere_else(self):
        path = self.write(
            "a.hal",
            "newthread servo 1000000\nloadrt violate names=w in=constructor what=modes\nloadrt violate names=v\n"
            "addf v.look servo\nstart\nadvance 10 cycles\ngetp v.seen\nshow fault\n",
        )
        done = self.run_program("sim", path)
        self.assertRegex(done.stdout, r"(?m)^0$")
        self.assertIn("no faults", done.stdout)

    # --- copies of the process

    def test_a_copy_that_a_function_makes_ends_at_once(self):
        modes = [(10, "fork")]
        if not SANITIZED:  # which has these functions itself
            modes += [(11, "_Fork"), (12, "vfork")]
            if os.uname().machine == "x86_64":
                modes.append((13, "the system call fork"))
        for mode, name in modes:
            with self.subTest(name):
                machine = self.machine()
                fault = self.violate(mode)
                self.assertRegex(
                    fault,
                    r"servo: function 'v\.act' \(violate\) called fork\(\) at cycle [\d ]+; the copy of the process was ended; "
                    r"start programs with `loadusr`, or outside of the cycle",
                )
                wait_until(lambda: machines(machine.pid) == [], "no copy runs")
                self.check_goes_on(machine)

    @unittest.skipUnless(os.uname().machine == "x86_64", "there is no such system call")
    def test_a_copy_that_nothing_sees_runs_no_further_function(self):
        machine = self.machine()
        self.good("shell", "setp", "v.mode", 14)
        runs = self.value("v.runs")
        wait_until(lambda: self.value("v.runs") != runs, "the machine goes on")
        wait_until(lambda: machines(machine.pid) == [], "no copy runs")
        self.check_goes_on(machine)

    def test_a_constructor_whose_copy_returns_leaves_one_machine(self):
        for place in ("constructor", "start"):
            with self.subTest(place):
                path = self.write(
                    "a.hal",
                    f"newthread servo 1000000 policy=other\nloadrt violate names=v in={place} what=fork\naddf v.act servo\n",
                )
                machine = self.start("run", path)
                wait_until(lambda: self.value("v.out") == "5", "its functions run")
                wait_until(lambda: machines(machine.pid) == [], "no copy runs")
                out, err = self.end(machine)
                self.assertEqual(0, machine.returncode, out + err)
                where = "its constructor" if place == "constructor" else "start"
                self.assertEqual(
                    f"hal: 'v' (violate) called fork() in {where} and let the copy of the process go on; the copy was ended: "
                    "it must end or execute a program [cycle-violation]\n",
                    err,
                )

    def test_a_constructor_may_fork_to_execute_a_program(self):
        path = self.write(
            "a.hal",
            "newthread servo 1000000 policy=other\nloadrt violate names=v in=constructor what=fork-exec\naddf v.act servo\n",
        )
        machine = self.start("run", path)
        self.assertEqual("", self.end(machine)[1])
        self.assertEqual(0, machine.returncode)

    # --- the end of the thread

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_function_that_ends_its_thread_is_named_and_start_runs_it_again(self):
        for mode, name in ((20, "pthread_exit"), (21, "the system call exit")):
            with self.subTest(name):
                machine = self.machine()
                fault = self.violate(mode)
                self.assertRegex(
                    fault,
                    r"servo: function 'v\.act' \(violate\) ended its thread at cycle [\d ]+; the thread's functions are stopped "
                    r"and its outputs were set to their safe values; see: show thread, start",
                )
                self.assertEqual("-1", self.value("v.out"))
                wait_until(lambda: self.value("other.out") == "-1", "the other thread sees it")
                self.assertIn("lasts", self.shell("fault", "clear").stderr)
                self.good("shell", "start")
                wait_until(lambda: self.value("v.out") == "5", "it runs again")
                self.end(machine)
                self.assertEqual(0, machine.returncode)

    @unittest.skipUnless(INSTRUCTIONS, "the instruction is not written for this processor")
    @unittest.skipIf(SANITIZED, "the sanitizer keeps a record of threads")
    def test_a_thread_that_a_system_call_ends_is_no_endless_loop(self):
        machine = self.machine()
        fault = self.violate(22)
        self.assertRegex(
            fault,
            r"servo: function 'v\.act' \(violate\) ended its thread at cycle [\d ]+; its outputs were set to their safe values; "
            r"end the machine: the thread cannot be started again",
        )
        self.assertEqual("-1", self.value("v.out"))
        wait_until(lambda: self.value("other.out") == "-1", "the other thread sees it")
        for words in (("start",), ("setp", "adder.in0", "1")):
            done = self.shell(*words)
            self.assertEqual(1, done.returncode)
            self.assertRegex(
                done.stderr,
                r"error: thread 'servo' has ended: function 'v\.act' \(violate\) ended it \[hung-thread\](?s:.*)"
                r"help: end the machine: the thread cannot be started again",
            )
        out, err = self.end(machine)
        self.assertEqual(1, machine.returncode, out + err)

    def test_a_function_cannot_cancel_its_thread(self):
        machine = self.machine()
        self.good("shell", "setp", "v.mode", 23)
        self.check_goes_on(machine)

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_constructor_that_ends_its_thread_is_named(self):
        path = self.write("a.hal", "loadrt violate names=v in=constructor what=thread-end\n")
        self.assertEqual(
            "hal: 'v' (violate) called pthread_exit() in its constructor; outputs were set to their safe values; the process "
            "ends [cycle-violation]\n",
            self.bad("run", "--for", "10ms", path),
        )

    # --- descriptors

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_function_that_closes_descriptors_of_the_runtime_ends_the_machine(self):
        for mode, call in (
            (30, r"close\(\)"),
            (31, r"close_range\(\)"),
            (32, r"closefrom\(\)"),
            (33, "the system call close_range"),
            (34, r"dup2\(\)"),
        ):
            with self.subTest(call):
                machine = self.machine()
                self.shell("setp", "v.mode", mode)
                self.assertRegex(
                    self.ends(machine),
                    rf"^hal: violate: function 'v\.act' called {call} for descriptor \d+, the [a-z ]+ of the runtime, at cycle \d+; "
                    r"outputs were set to their safe values; the process ends \[cycle-violation\]\n$",
                )

    @unittest.skipUnless(INSTRUCTIONS, "the instruction is not written for this processor")
    def test_descriptors_that_are_lost_unseen_end_the_machine(self):
        # the number of a closed descriptor may belong to another file when it is noticed
        for mode, what in ((35, "(closed|replaced)"), (36, "replaced")):
            with self.subTest(what):
                machine = self.machine()
                self.shell("setp", "v.mode", mode)
                self.assertRegex(
                    self.ends(machine),
                    rf"(?m)^hal: descriptor \d+, the [a-z ]+ of the runtime, was {what}: a component, or a library that it uses, "
                    r"closes descriptors that it has not opened; outputs were set to their safe values; the process ends "
                    r"\[cycle-violation\]$",
                )

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_constructor_that_closes_descriptors_is_named(self):
        path = self.write("a.hal", "loadrt violate names=v in=constructor what=close\n")
        self.assertRegex(
            self.bad("run", "--for", "10ms", path),
            r"^hal: 'v' \(violate\) called close\(\) for descriptor \d+, the [a-z ]+ of the runtime, in its constructor; outputs "
            r"were set to their safe values; the process ends \[cycle-violation\]\n$",
        )

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_function_that_replaces_the_process_ends_the_machine(self):
        calls = ("execl()", "execvp()", "execle()", "execlp()", "execv()", "execve()", "execvpe()")
        calls += ("fexecve()", "the system call execve", "execveat()")
        for mode, call in enumerate(map(re.escape, calls), 50):
            with self.subTest(call):
                machine = self.machine()
                self.shell("setp", "v.mode", mode)
                self.assertRegex(
                    self.ends(machine),
                    rf"^hal: violate: function 'v\.act' called {call} at cycle \d+; outputs were set to their safe values; "
                    r"the process ends \[cycle-violation\]\n$",
                )

    @unittest.skipIf(SANITIZED, "the sanitizer opens files to look at an address")
    @unittest.skipUnless(os.geteuid() == 0, "lowers the hard limit of another process")
    def test_a_limit_of_files_that_cannot_be_raised_is_reported_and_a_signal_ends_the_machine(self):
        for limit in (0, 2, 10):
            with self.subTest(limit):
                script = self.write("a.hal", MACHINE)
                machine = subprocess.Popen(
                    ["setpriv", "--bounding-set=-sys_resource", "--", str(HAL), "run", script],
                    cwd=self.folder,
                    env=self.environment,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                )
                self.addCleanup(self.end, machine)
                wait_until(lambda: self.value("v.out") == "5", "its functions run")
                resource.prlimit(machine.pid, resource.RLIMIT_NOFILE, (limit, limit))
                self.assertRegex(
                    machine.stderr.readline(),
                    rf"^hal: the limit of open files was lowered from \d+ to {limit} by a component or another process, and cannot be "
                    rf"raised beyond {limit}: a client for which no file is left cannot connect; SIGTERM ends the machine; "
                    r"to raise it, type as root: prlimit --nofile=\d+ "
                    rf"--pid {machine.pid}\n$",
                )
                before = cpu_seconds(machine.pid)
                time.sleep(0.5)
                used = cpu_seconds(machine.pid) - before
                self.assertLess(used, 0.25, "no thread of the runtime spins")
                machine.send_signal(signal.SIGTERM)
                self.assertEqual(0, machine.wait(TIMEOUT), machine.stderr.read())

    def test_a_lowered_limit_of_files_is_raised_again(self):
        machine = self.machine()
        self.good("shell", "setp", "v.mode", 60)
        line = wait_until(machine.stderr.readline, "it is reported")
        self.assertRegex(
            line,
            r"^hal: the limit of open files was lowered from \d+ to 0 by a component or another process; it was raised again\n$",
        )
        self.check_goes_on(machine)

    # --- signals

    def test_signals_that_a_function_unblocks_or_ignores_end_the_machine_in_order(self):
        for mode, name in ((40, "unblocked"), (41, "ignored")):
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
                with self.subTest(f"{name} {number.name}"):
                    machine = self.machine()
                    self.good("shell", "setp", "v.mode", mode)
                    runs = self.value("v.runs")
                    wait_until(lambda: self.value("v.runs") != runs, "the function has run")
                    out, err = self.end(machine, number)
                    self.assertEqual((0, ""), (machine.returncode, err), out)

    def test_an_alarm_that_a_function_sets_does_not_end_the_machine(self):
        machine = self.machine()
        self.good("shell", "setp", "v.mode", 42)
        time.sleep(1.5)  # the alarm is due after one second
        self.check_goes_on(machine)


if __name__ == "__main__":
    unittest.main()
