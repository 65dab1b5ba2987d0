# SPDX-License-Identifier: MIT
# packages: modbus
"""The guardian stops a drive on a pseudo terminal however the runtime ends, and reports what it did. modbus_stop_test.py measures how soon."""

import os
import re
import signal
import time
import unittest

from guarded_machine import GuardedMachine
from harness import Case, wait_until
from modbus_drive import BROADCAST_STOP, RUN, STOP, Drive

CONFIGURATION = """[bus]
baud = 115200
heartbeat = 60ms
[slave 1 spindle]
profile = delta-ms300
every = 20ms
"""
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt modbus config=spindle.modbus link=serial:line
addf modbus.0.receive servo
addf modbus.0.transmit servo
setp modbus.0.spindle.speed-cmd 12000
start
"""


class Guardian(GuardedMachine, Case):
    program = "hal-guardian"
    netlist = "spindle.hal"

    def setUp(self):
        super().setUp()
        self.write("spindle.modbus", CONFIGURATION)
        self.write("spindle.hal", NETLIST)
        self.drive = Drive(str(self.folder / "line"))
        self.addCleanup(self.drive.close)

    def guarded(self):
        """Waits until it is, and turns the spindle."""
        self.comes("modbus.0.spindle.online", "TRUE")
        self.assertEqual("TRUE", self.value("modbus.0.guarded"))
        self.say("setp", "modbus.0.spindle.run", "TRUE")
        wait_until(lambda: self.drive.registers[0x2000] == RUN, "the drive runs")

    def stops(self, since):
        """Waits for a stop telegram, which must be the last command."""
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the drive is stopped")
        time.sleep(0.05)
        commands = [(when, f) for when, f in self.drive.writes if f[2:4] == STOP[2:4]]
        self.assertEqual(STOP, commands[-1][1])
        self.assertTrue(any(when >= since and frame == STOP for when, frame in commands))

    def test_a_killed_process(self):
        self.killed(signal.SIGKILL)
        self.assertIn("slave 1 (spindle) acknowledged its stop telegrams", self.next_start())
        self.assertNotIn("previous run", self.next_start())

    def test_sigterm(self):
        self.killed(signal.SIGTERM)

    def test_ctrl_c(self):
        self.killed(signal.SIGINT, group=True)

    def test_a_suspended_process(self):
        machine = self.suspended()
        machine.send_signal(signal.SIGCONT)
        wait_until(lambda: self.value("modbus.0.spindle.stopped") == "FALSE", "writes are allowed")
        self.assertEqual(1, self.drive.registers[0x2000])  # needs another edge of run
        self.end(machine)

    def test_unload_and_e_stop_and_stop(self):
        machine = self.run_guarded()
        for words in (("setp", "modbus.0.estop", "TRUE"), ("stop",), ("unload", "modbus")):
            since = time.monotonic()
            if words[0] == "unload":
                self.shell("delf", "modbus.0.receive", "servo")
                self.shell("delf", "modbus.0.transmit", "servo")
                words = ("unloadrt", "modbus")
            self.shell(*words)
            self.stops(since)
            if words[0] == "setp":
                self.say("setp", "modbus.0.estop", "FALSE")
                wait_until(lambda: self.value("modbus.0.spindle.stopped") == "FALSE", "released")
            elif words[0] == "stop":
                self.say("start")
            else:
                break
            self.say("setp", "modbus.0.spindle.run", "FALSE")
            time.sleep(0.05)
            wait_until(lambda: self.value("modbus.0.spindle.online") == "TRUE", "online")
            self.say("setp", "modbus.0.spindle.run", "TRUE")
            wait_until(lambda: self.drive.registers[0x2000] == RUN, "the drive runs again")
        self.end(machine)

    def test_an_ordinary_end(self):
        machine = self.run_guarded()
        since = time.monotonic()
        self.say("exit")
        self.end(machine)
        self.stops(since)

    def test_a_broadcast_stop_is_sent_before_and_behind_the_addressed_one(self):
        broadcast = "[bus]\nbroadcast-stop = holding 0x2000 1\nturnaround = 40ms\n"
        self.write("spindle.modbus", CONFIGURATION.replace("[bus]\n", broadcast))
        machine = self.run_guarded()
        begin = len(self.drive.writes)
        machine.send_signal(signal.SIGKILL)
        wait_until(
            lambda: sum(f == BROADCAST_STOP for _, f in self.drive.writes) == 2, "both broadcasts"
        )
        self.end(machine, signal.SIGKILL)
        writes = [(when, f) for when, f in self.drive.writes[begin:] if f[2:4] == STOP[2:4]]
        self.assertEqual([BROADCAST_STOP, STOP, BROADCAST_STOP], [f for _, f in writes[-3:]])
        self.assertIn(
            "; the broadcast stop was sent; slave 1 (spindle) acknowledged its stop telegrams",
            self.next_start(),
        )

    def test_a_broadcast_stop_that_cannot_be_sent_is_not_reported_as_sent(self):
        broadcast = "[bus]\nbroadcast-stop = holding 0x2000 1\nturnaround = 40ms\n"
        self.write("spindle.modbus", CONFIGURATION.replace("[bus]\n", broadcast))
        machine = self.run_guarded()
        guardian = self.suspend_guardian(machine)
        self.drive.close()
        machine.kill()
        machine.wait()
        os.kill(guardian, signal.SIGCONT)
        reports = self.folder / "state/halcyon"
        report = wait_until(
            lambda: "".join(file.read_text() for file in reports.glob("guardian-*")), "the report"
        )
        report = re.sub("^[-0-9]{10} [:0-9]{8}, (.*); [0-9.]+ ms\n$", r"\1", report)
        self.assertEqual(
            "the process has ended; the broadcast stop was not sent: the line is lost; "
            "slave 1 (spindle) did not acknowledge its stop telegrams",
            report.replace(" after its cycles had stopped", ""),
        )

    def test_a_stop_without_guardian_lasts_as_long_as_its_broadcasts(self):
        writes = ", ".join(["holding 0x2000 1"] * 4)
        broadcast = f"[bus]\nguardian = no\nbroadcast-stop = {writes}\nturnaround = 1s\n"
        self.write("spindle.modbus", CONFIGURATION.replace("[bus]\n", broadcast))
        machine = self.start("run", "spindle.hal")
        self.comes("modbus.0.spindle.online", "TRUE")
        self.say("setp", "modbus.0.spindle.run", "TRUE")
        wait_until(lambda: self.drive.registers[0x2000] == RUN, "the drive runs")
        begin = len(self.drive.writes)
        out = self.end(machine)[1]
        frames = [f for _, f in self.drive.writes[begin:] if f[2:4] == STOP[2:4]]
        # the end of the thread and the unload are stops: the second begins anew
        self.assertEqual([BROADCAST_STOP] * 4 + [STOP] + [BROADCAST_STOP] * 4, frames[-9:])
        self.assertEqual({BROADCAST_STOP}, set(frames[:-5]))
        self.assertIn("slave 1 (spindle) acknowledged its stop telegrams after", out)
        self.assertNotIn("stop the drives by other means", out)

    def test_the_end_sends_the_stop_telegrams_again_behind_a_stop_that_is_over(self):
        for guardian in ("no", "yes"):
            with self.subTest(guardian=guardian):
                bus = f"[bus]\nguardian = {guardian}\n"
                self.write("spindle.modbus", CONFIGURATION.replace("[bus]\n", bus))
                machine = self.start("run", "spindle.hal")
                self.comes("modbus.0.spindle.online", "TRUE")
                self.say("setp", "modbus.0.estop", "TRUE")
                self.comes("modbus.0.spindle.stopped", "TRUE")
                begin = len(self.drive.writes)
                self.shell("unloadrt", "modbus")
                self.assertIn(STOP, [frame for _, frame in self.drive.writes[begin:]])
                self.end(machine)

    def ends_with(self, status, machine):
        """Ends the machine; what it printed about a component that could not stop."""
        printed = "".join(self.end(machine))
        self.assertEqual(status, machine.returncode, printed)
        return re.findall("'modbus.0' raised a fault while it stopped: .*", printed)

    def test_an_end_that_a_drive_does_not_acknowledge_has_status_1(self):
        machine = self.run_guarded()
        self.drive.answers = False
        self.assertEqual(1, len(self.ends_with(1, machine)))

    def test_an_end_behind_an_unacknowledged_e_stop_has_status_1(self):
        machine = self.run_guarded()
        self.drive.answers = False
        self.say("setp", "modbus.0.estop", "TRUE")
        wait_until(
            lambda: "did not acknowledge its stop telegrams" in self.say("show", "fault"),
            "the stop is unconfirmed",
        )
        self.say("exit")
        self.assertEqual(1, len(self.ends_with(1, machine)))

    def test_an_unload_that_a_drive_does_not_acknowledge_is_not_forgotten(self):
        machine = self.run_guarded()
        self.drive.answers = False
        for function in ("receive", "transmit"):
            self.shell("delf", f"modbus.0.{function}", "servo")
        self.shell("unloadrt", "modbus")
        self.assertEqual(1, len(self.ends_with(1, machine)))

    def test_an_end_that_all_drives_acknowledge_has_status_0(self):
        self.assertEqual([], self.ends_with(0, self.run_guarded()))
        classic = self.start("run", "--for", "300ms", self.netlist)
        classic.wait()
        self.assertEqual([], self.ends_with(0, classic))

    def test_a_drive_that_does_not_answer_is_reported(self):
        machine = self.run_guarded()
        self.drive.answers = False
        machine.send_signal(signal.SIGKILL)
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the stop telegram was sent")
        self.end(machine, signal.SIGKILL)
        self.drive.answers = True
        self.assertIn("did not acknowledge", self.next_start())

    def test_a_killed_guardian_is_a_fault(self):
        machine = self.run_guarded()
        self.kill_guardian(machine)
        self.comes("modbus.0.fault", "TRUE")
        self.assertEqual("FALSE", self.value("modbus.0.guarded"))
        self.assertEqual("FALSE", self.value("modbus.0.spindle.online"))
        self.comes("modbus.0.spindle.stopped", "TRUE")
        self.assertEqual(STOP, self.drive.writes[-1][1])
        out = self.end(machine)[1]
        self.assertIn("guardian has ended", out)
        self.assertIn("acknowledged its stop telegrams", out)

    def test_a_killed_guardian_of_a_machine_that_ends_then(self):
        machine = self.run_guarded()
        self.drive.answers = False
        self.kill_guardian(machine)
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the stop telegram was sent")
        self.comes("modbus.0.fault", "TRUE")
        wait_until(lambda: not self.guardians_of(machine), "the other guardian has given up")
        self.drive.answers = True
        self.drive.registers[0x2000] = RUN
        self.assertIn("acknowledged its stop telegrams", self.end(machine)[1])
        self.assertEqual(STOP, self.drive.writes[-1][1])

    def test_a_suspended_guardian_is_a_fault_and_continued(self):
        machine = self.run_guarded()
        guardian = self.suspend_guardian(machine)
        self.drive.registers[0x2103] = 0
        self.comes("modbus.0.spindle.at-speed", "FALSE")
        wait_until(lambda: self.value("modbus.0.guarded") == "TRUE", "it is continued")
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the drive needs another edge")
        os.kill(guardian, signal.SIGSTOP)
        out = self.end(machine)[1]  # continued for the stop telegrams
        self.assertEqual(STOP, self.drive.writes[-1][1])
        self.assertIn("the guardian stalls", out)
        self.assertIn("the guardian runs again", out)

    def test_a_line_in_use_is_not_opened(self):
        machine = self.run_guarded()
        self.assertIn(
            "another program uses 'line'",
            self.bad("modbus", "read", "serial:line?baud=115200", "1", "holding", "0x2103"),
        )
        self.assertIn(
            "another program uses 'serial:line'", self.bad("run", "--name", "two", "spindle.hal")
        )
        self.assertEqual(RUN, self.drive.registers[0x2000])
        self.assertEqual("0", self.value("modbus.0.spindle.timeouts"))
        self.end(machine)

    def test_a_line_that_cannot_be_opened_is_reported(self):
        os.unlink(self.folder / "line")
        self.assertIn("cannot open 'line'", self.bad("run", "spindle.hal"))


if __name__ == "__main__":
    unittest.main()
