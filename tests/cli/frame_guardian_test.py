# SPDX-License-Identifier: MIT
"""The guardian of stop frames sends them on a real interface however the machine ends, and reports what it did."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

from harness import Case, Terminal, wait_until
from own_network import own_network

TYPE = 0x88B5  # IEEE 802, local experimental ethertype 1
SOURCE = "020000000001"
FRAME = f"FFFFFFFFFFFF.{SOURCE}.{TYPE:04X}.5354"
LAST = f"FFFFFFFFFFFF.{SOURCE}.{TYPE:04X}.4F50"
NETLIST = f"""loadrt threads name1=servo period1=1000000
loadrt frame_guardian names=guard link=eth:lo send={FRAME},{LAST}
addf guard.update servo
start
"""
SENT = "the stop frames were sent 3 times"


class Listener:
    """The payloads of the frames of this test, with the time of each."""

    def __init__(self):
        self.frames = []
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(TYPE))
        self.socket.bind(("lo", TYPE))
        self.socket.settimeout(0.1)
        self.ends = False
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        while not self.ends:
            try:
                frame, origin = self.socket.recvfrom(2048)
            except OSError:  # nothing within 0.1 s, or the interface is down
                continue
            outgoing = origin[2] == socket.PACKET_OUTGOING  # `lo` shows each frame twice
            if not outgoing and frame[6:12].hex().upper() == SOURCE:
                self.frames.append((time.monotonic(), frame[14:16]))

    def close(self):
        self.ends = True
        self.thread.join()
        self.socket.close()


class FrameGuardian(Case):
    def setUp(self):
        super().setUp()
        self.write("guard.hal", NETLIST)
        self.bus = Listener()
        self.addCleanup(self.bus.close)

    def guarded_machine(self, **how):
        machine = self.start("run", "guard.hal", **how)
        self.comes("guard.guarded", "TRUE")
        self.assertEqual([], self.bus.frames)
        return machine

    def stops(self, since, rounds=3):
        """Waits for all frames, in their order."""
        wait_until(lambda: len(self.bus.frames) >= 2 * rounds, "the stop frames are sent")
        payloads = [payload for when, payload in self.bus.frames if when >= since]
        self.assertEqual([b"ST", b"OP"], payloads[:2])
        self.assertEqual([b"ST", b"OP"] * rounds, payloads[: 2 * rounds])

    def guardian_of(self, machine):
        """The process of the guardian."""
        for children in Path(f"/proc/{machine.pid}/task").glob("*/children"):
            for child in children.read_text().split():
                if "hal-frame-guard" in Path(f"/proc/{child}/comm").read_text():
                    return int(child)
        raise AssertionError("there is no guardian")

    def killed(self, number, group=False):
        machine = self.guarded_machine(start_new_session=True)
        since = time.monotonic()
        if group:
            os.killpg(machine.pid, number)
        else:
            machine.send_signal(number)
        self.stops(since)
        return self.end(machine, signal.SIGKILL)

    def set_link(self, state):
        subprocess.run(["ip", "link", "set", "lo", state], check=True)

    def next_start(self):
        machine = self.start("run", "guard.hal")
        return self.end(machine)[1]

    def test_a_killed_process_and_its_report(self):
        errors = self.killed(signal.SIGKILL)[1]
        self.assertRegex(
            errors,
            r"guard: guardian: \d{4}-\d\d-\d\d \d\d:\d\d:\d\d, the process has ended; "
            r"the stop frames were sent 3 times; \d+\.\d ms\n",
        )
        self.assertRegex(
            self.next_start(),
            "guard: the guardian of the previous run: .*, the process has ended; "
            r"the stop frames were sent 3 times; \d+\.\d ms\n",
        )
        self.assertNotIn("previous run", self.next_start())

    def test_a_killed_process_group(self):
        self.killed(signal.SIGKILL, group=True)

    def test_a_segmentation_fault(self):
        self.killed(signal.SIGSEGV)

    def test_sigterm(self):
        machine = self.guarded_machine()
        since = time.monotonic()
        errors = self.end(machine)[1]
        self.stops(since)
        self.assertIn("guard: sends the stop frames: the component is unloaded\n", errors)
        self.assertEqual(2, errors.count("guard: sends the stop frames: "), errors)
        self.assertRegex(errors, rf"guard: {SENT} after \d+\.\d ms\n")
        self.assertNotIn("previous run", self.next_start())

    def test_a_suspended_process(self):
        machine = self.guarded_machine()
        since = time.monotonic()
        machine.send_signal(signal.SIGSTOP)
        self.stops(since)
        machine.send_signal(signal.SIGKILL)
        errors = self.end(machine, signal.SIGKILL)[1]
        self.assertIn(f"the process has ended after its cycles had stopped; {SENT}", errors)

    def test_a_closed_terminal(self):
        terminal = Terminal(self, "run", "guard.hal")
        self.comes("guard.guarded", "TRUE")
        since = time.monotonic()
        os.close(terminal.descriptor)
        terminal.descriptor = os.open("/dev/null", os.O_RDWR)
        self.stops(since)
        os.waitpid(terminal.process, 0)
        terminal.status = 0

    def test_e_stop_stop_and_unload(self):
        machine = self.guarded_machine()
        for words in (("setp", "guard.estop", "TRUE"), ("stop",)):
            self.bus.frames.clear()
            since = time.monotonic()
            self.say(*words)
            self.stops(since)
        self.say("setp", "guard.estop", "FALSE")
        self.say("start")
        self.comes("guard.stopped", "FALSE")
        self.assertEqual("2", self.value("guard.stops"))
        self.bus.frames.clear()
        self.say("delf", "guard.update", "servo")
        wait_until(lambda: len(self.bus.frames) >= 6, "the function is gone")
        time.sleep(0.1)
        self.bus.frames.clear()
        since = time.monotonic()
        self.say("unloadrt", "guard")
        self.stops(since)
        errors = self.end(machine)[1]
        for reason in (
            "the pin estop is TRUE",
            "its function was stopped, or its thread has a fault",
            "the component is unloaded",
        ):
            self.assertIn(f"guard: sends the stop frames: {reason}\n", errors)

    def test_the_guardian_is_killed(self):
        machine = self.guarded_machine()
        os.kill(self.guardian_of(machine), signal.SIGKILL)
        self.comes("guard.guarded", "FALSE")
        self.comes("guard.fault", "TRUE")
        self.assertIn(
            "guard: the guardian has ended: nothing sends the stop frames any more",
            self.say("show", "fault"),
        )
        errors = self.end(machine)[1]
        self.assertIn(
            "guard: the guardian has ended: nothing sends the stop frames any more; "
            "type: unloadrt, loadrt\n",
            errors,
        )

    def test_the_guardian_is_suspended(self):
        machine = self.guarded_machine()
        os.kill(self.guardian_of(machine), signal.SIGSTOP)
        wait_until(
            lambda: "guard: the guardian stalls: no stop frame is sent"
            in self.say("show", "fault"),
            "the stall is seen",
        )
        wait_until(lambda: "(lasts)" not in self.say("show", "fault"), "it is continued")
        self.assertEqual("TRUE", self.value("guard.guarded"))
        errors = self.end(machine)[1]
        stalls = (
            "guard: the guardian stalls: no stop frame is sent; stop the drives by other means\n"
        )
        self.assertIn(stalls, errors)
        self.assertIn("guard: the guardian runs again\n", errors)

    def test_a_journal_is_executed_again(self):
        machine = self.start("run", "guard.hal", "--journal", "run.mcap", "--values", "*")
        self.comes("guard.guarded", "TRUE")
        self.say("setp", "guard.estop", "TRUE")
        self.comes("guard.stopped", "TRUE")
        self.end(machine)
        self.bus.frames.clear()
        done = self.run_program("replay", "--exact", "run.mcap")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertRegex(done.stdout, r"no difference, [1-9]\d* values compared")
        self.assertEqual([], self.bus.frames)

    def test_a_link_without_carrier_at_the_end(self):
        machine = self.guarded_machine()
        self.set_link("down")
        self.addCleanup(self.set_link, "up")
        self.say("setp", "guard.estop", "TRUE")
        self.comes("guard.fault", "TRUE")
        errors = self.end(machine)[1]
        self.assertIn(
            "guard: eth:lo has not taken the stop frames within 2 s (0 times sent); "
            "stop the drives by other means\n",
            errors,
        )

    def test_an_interface_that_does_not_exist(self):
        self.write("none.hal", NETLIST.replace("eth:lo", "eth:none0"))
        done = self.run_program("run", "none.hal")
        self.assertEqual(1, done.returncode)
        self.assertIn("none0", done.stderr)
        self.assertNotIn("did not start within", done.stderr)


if __name__ == "__main__":
    if not own_network():
        print("raw frames need a network of one's own: unshare or ip is missing or denied")
        sys.exit(77)
    unittest.main()
