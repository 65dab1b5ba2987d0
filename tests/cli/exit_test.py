# SPDX-License-Identifier: MIT
"""Components that end the process: outputs safe, named, never status 0; and the observer that sees what no handler inside sees."""
import os
import signal
import unittest
from pathlib import Path

from harness import HAL, PLUGINS, SANITIZED, Case, undisturbed, wait_until

FAULTY = """newthread servo 1000000 policy=other
loadrt test-faulty names=f
loadrt sum2 names=adder
addf f.run servo
addf adder servo
setp f.dies {dies}
"""


def children(pid):
    """The processes that a process has started."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            name, rest = (entry / "stat").read_text().rsplit(")", 1)
        except OSError:
            continue
        if int(rest.split()[1]) == pid:
            found.append((int(entry.name), name.split("(", 1)[1]))
    return found


def gone(pid):
    return (
        not Path(f"/proc/{pid}").exists()
        or Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    )


class Exits(Case):
    def setUp(self):
        super().setUp()
        self.environment["HALCYON_PLUGIN_PATH"] = (
            str(HAL.parent.parent / "tests/plugins") + ":" + PLUGINS
        )

    def observer(self, machine):
        found = [pid for pid, name in children(machine.pid) if name == "hal-observer"]
        self.assertEqual(1, len(found))
        return found[0]

    def death(self, dies):
        """Standard error and status of a machine whose function ends the process."""
        machine = self.start("run", self.write("a.hal", FAULTY.format(dies=dies)), loaded=False)
        err = undisturbed(machine.communicate(timeout=60)[1])
        return err, machine.returncode

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_function_that_ends_the_process_is_named_and_the_status_is_not_0(self):
        for dies, call in (
            (6, r"exit\(\)"),
            (7, r"_exit\(\)"),
            (8, r"quick_exit\(\)"),
            (9, "the system call exit_group"),
        ):
            with self.subTest(call):
                err, status = self.death(dies)
                self.assertRegex(
                    err,
                    r"^emergency function called\nhal: test-faulty: function 'f\.run' called "
                    + call
                    + r" at cycle \d+; outputs were set to their safe values; the process ends\n$",
                )
                self.assertEqual(1, status)

    @unittest.skipUnless(
        os.uname().machine in ("x86_64", "aarch64"),
        "the instruction is not written for this processor",
    )
    def test_an_end_that_only_the_observer_sees_is_reported(self):
        err, _ = self.death(10)
        self.assertRegex(
            err,
            r"^hal: machine 'default' \(process \d+\) ended without shutting down: it was killed, or a function ended it by a "
            r"system call; thread 'servo' ran function 'f\.run' \(test-faulty\); its outputs were not set to their safe values\n$",
        )

    def test_a_machine_that_is_killed_is_reported_and_its_observer_ends(self):
        machine = self.start("run", self.write("a.hal", FAULTY.format(dies=0)))
        observer = self.observer(machine)
        machine.kill()
        err = undisturbed(machine.communicate(timeout=60)[1])
        self.assertRegex(
            err,
            rf"^hal: machine 'default' \(process {machine.pid}\) ended without shutting down: it was killed.*; "
            "its outputs were not set to their safe values\n$",
        )
        wait_until(lambda: gone(observer), "the observer ends")

    def test_the_observer_says_nothing_after_an_orderly_end_and_leaves_with_the_machine(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            machine = self.start("run", self.write("a.hal", FAULTY.format(dies=0)))
            observer = self.observer(machine)
            self.assertEqual(
                b"hal-observer", Path(f"/proc/{observer}/cmdline").read_bytes().strip(b"\0")
            )
            _, err = self.end(machine, number)
            self.assertEqual(("", 0), (err, machine.returncode))
            self.assertTrue(gone(observer))

    def test_signals_for_the_machine_do_not_end_the_observer(self):
        machine = self.start("run", self.write("a.hal", FAULTY.format(dies=0)))
        observer = self.observer(machine)
        for number in (
            signal.SIGINT,
            signal.SIGTERM,
            signal.SIGHUP,
            signal.SIGTSTP,
            signal.SIGPIPE,
        ):
            os.kill(observer, number)
        machine.kill()
        self.assertIn("ended without shutting down", machine.communicate(timeout=60)[1])

    def test_a_crash_is_reported_once(self):
        err, status = self.death(1)
        if not SANITIZED:
            self.assertEqual(-signal.SIGSEGV, status)
            self.assertEqual(1, err.count("hal: "), err)

    @unittest.skipIf(SANITIZED, "the sanitizer has these functions itself")
    def test_a_component_that_exits_outside_of_the_cycle_is_named(self):
        path = self.write("c.hal", "loadrt test-exits in=constructor\n")
        self.assertEqual(
            "hal: 'test-exits.0' (test-exits) called exit() in its constructor; the process ends\n",
            self.bad("check", path),
        )
        path = self.write("s.hal", "newthread servo 1000000\nloadrt test-exits in=stop\n")
        err = self.bad("run", "--for", "10ms", path)
        self.assertEqual(
            "hal: 'test-exits.0' (test-exits) called exit() in stop; outputs were set to their safe values; the process ends\n",
            err,
        )

    def test_a_process_that_a_component_forks_may_end_as_it_likes(self):
        path = self.write("f.hal", "newthread servo 1000000\nloadrt test-exits in=child\n")
        done = self.run_program("run", "--for", "10ms", path)
        self.assertEqual(("", 0), (done.stderr, done.returncode))


if __name__ == "__main__":
    unittest.main()
