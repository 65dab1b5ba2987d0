# SPDX-License-Identifier: MIT
"""A machine with a guardian, for the tests that kill, suspend and replace one of the two."""

import os
import signal
import time
from pathlib import Path

from harness import Terminal, suspend


class GuardedMachine:
    """A mix-in of Case. A class that uses it has `program`, the name of its guardian; run_guarded(), which starts a machine that is
    guarded; netlist, its file; guarded(), which waits until a machine is guarded; and stops(since), which waits until the devices
    have been stopped since then."""

    program = ""
    netlist = ""

    def run_guarded(self, **how):
        machine = self.start("run", self.netlist, **how)
        self.guarded()
        return machine

    def guardians_of(self, machine):
        """The processes of its guardians, in the order of their numbers."""
        found = []
        for children in Path(f"/proc/{machine.pid}/task").glob("*/children"):
            for child in children.read_text().split():
                try:
                    name = Path(f"/proc/{child}/comm").read_text().strip()
                except OSError:  # it has ended meanwhile
                    continue
                if name == self.program[:15]:
                    found.append(int(child))
        return sorted(found)

    def guardian_of(self, machine):
        """The process of the only guardian."""
        guardians = self.guardians_of(machine)
        self.assertEqual(1, len(guardians))
        return guardians[0]

    def kill_guardian(self, machine):
        """Kills it; its number."""
        guardian = self.guardian_of(machine)
        os.kill(guardian, signal.SIGKILL)
        return guardian

    def suspend_guardian(self, machine):
        guardian = self.guardian_of(machine)
        suspend(guardian)
        return guardian

    def killed(self, number, group=False):
        """Ends a machine by a signal, and waits for the stop; the output of both."""
        machine = self.run_guarded(start_new_session=True)
        since = time.monotonic()
        if group:
            os.killpg(machine.pid, number)
        else:
            machine.send_signal(number)
        self.stops(since)
        return self.end(machine, signal.SIGKILL)

    def suspended(self):
        """Suspends a machine, and waits for the stop; the machine, which is still suspended."""
        machine = self.run_guarded()
        since = time.monotonic()
        machine.send_signal(signal.SIGSTOP)
        self.stops(since)
        return machine

    def next_start(self):
        """What the next machine prints."""
        machine = self.start("run", self.netlist)
        return self.end(machine)[1]

    def test_a_killed_process_group(self):
        self.killed(signal.SIGKILL, group=True)

    def test_a_segmentation_fault(self):
        self.killed(signal.SIGSEGV)

    def test_an_abort(self):
        self.killed(signal.SIGABRT)

    def test_a_closed_terminal(self):
        terminal = Terminal(self, "run", self.netlist)
        self.guarded()
        since = time.monotonic()
        os.close(terminal.descriptor)
        terminal.descriptor = os.open("/dev/null", os.O_RDWR)
        self.stops(since)
        os.waitpid(terminal.process, 0)
        terminal.status = 0

    def test_a_suspended_guardian_of_a_machine_that_is_killed(self):
        machine = self.run_guarded()
        self.suspend_guardian(machine)
        since = time.monotonic()
        machine.send_signal(signal.SIGKILL)
        self.stops(since)
        self.end(machine, signal.SIGKILL)

    def test_a_second_program_with_the_same_report_is_rejected(self):
        machine = self.run_guarded()
        errors = self.bad("run", "--name", "two", self.netlist)
        self.assertRegex(errors, "another program uses '.*' with a guardian of this name")
        self.guarded()
        self.end(machine)
        self.assertNotIn("another program", self.next_start())
