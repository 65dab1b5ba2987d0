# SPDX-License-Identifier: MIT
# packages: modbus
"""The guardian stops a drive on a pseudo terminal however the runtime ends: each kind of end, the stop telegram complete on the line.
HALCYON_MODBUS_ROUNDS=10 makes a hundred ends of them."""

import os
import pty
import select
import signal
import threading
import time
import tty
import unittest

from harness import Case, Terminal, wait_until

STOP = bytes.fromhex("010620000001 43CA")
RUN = 0x12
ROUNDS = int(os.environ.get("HALCYON_MODBUS_ROUNDS", "1"))

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


def crc16(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return bytes([crc & 255, crc >> 8])


class Drive:
    """A converter with Delta's registers on the master end of a pseudo terminal."""

    def __init__(self, link):
        self.master, slave = pty.openpty()
        self.slave = slave  # held open: the master end reads EIO while nobody has it
        tty.setraw(slave)
        tty.setraw(self.master)
        if os.path.islink(link):
            os.unlink(link)
        os.symlink(os.ttyname(slave), link)
        self.registers = {0x2000: 0, 0x2001: 0, 0x2002: 0, 0x2100: 0, 0x2103: 0}
        self.writes = []  # (time, frame)
        self.answers = True
        self.ended = False
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        received = b""
        while not self.ended:
            if not select.select([self.master], [], [], 0.02)[0]:
                received = b""  # a frame has no pause of 20 ms
                continue
            received += os.read(self.master, 512)
            while len(received) >= 8:
                frame, received = received[:8], received[8:]
                if crc16(frame[:6]) == frame[6:]:
                    self.answer(frame)

    def answer(self, frame):
        address = frame[2] << 8 | frame[3]
        value = frame[4] << 8 | frame[5]
        if frame[1] == 6:
            self.writes.append((time.monotonic(), frame))
            self.registers[address] = value
            if address == 0x2001 or address == 0x2000:
                turning = self.registers[0x2000] & 3 == 2
                self.registers[0x2103] = self.registers[0x2001] if turning else 0
            reply = frame[:6]
        else:
            words = [self.registers.get(address + n, 0) for n in range(value)]
            reply = bytes([1, 3, 2 * value]) + b"".join(w.to_bytes(2, "big") for w in words)
        if self.answers:
            os.write(self.master, reply + crc16(reply))

    def close(self):
        self.ended = True
        self.thread.join()
        os.close(self.master)
        os.close(self.slave)


late = {}  # of each kind of end, in ms


class Guardian(Case):
    @classmethod
    def tearDownClass(cls):
        for kind, times in sorted(late.items()):
            print(f"{kind}: {len(times)} stops, {min(times):.1f} to {max(times):.1f} ms")

    def setUp(self):
        super().setUp()
        self.write("spindle.modbus", CONFIGURATION)
        self.write("spindle.hal", NETLIST)
        self.drive = Drive(str(self.folder / "line"))
        self.addCleanup(self.drive.close)

    def run_spindle(self, **how):
        machine = self.start("run", "spindle.hal", **how)
        self.turn()
        return machine

    def turn(self):
        self.comes("modbus.0.spindle.online", "TRUE")
        self.assertEqual("TRUE", self.value("modbus.0.guarded"))
        self.say("setp", "modbus.0.spindle.run", "TRUE")
        wait_until(lambda: self.drive.registers[0x2000] == RUN, "the drive runs")

    def stops(self, since):
        """Waits for the stop telegram, which must be the last command; measures how late it is."""
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the drive is stopped")
        time.sleep(0.05)
        commands = [(when, f) for when, f in self.drive.writes if f[2:4] == STOP[2:4]]
        self.assertEqual(STOP, commands[-1][1])
        first = next(when for when, frame in commands if when >= since and frame == STOP)
        late.setdefault(self.id().rsplit(".", 1)[1], []).append(1e3 * (first - since))

    def report_of_next_start(self):
        machine = self.start("run", "spindle.hal")
        return self.end(machine)[1]

    def killed(self, number, group=False):
        for _ in range(ROUNDS):
            machine = self.run_spindle(start_new_session=True)
            since = time.monotonic()
            if group:
                os.killpg(machine.pid, number)
            else:
                machine.send_signal(number)
            self.stops(since)
            self.end(machine, signal.SIGKILL)

    def test_a_killed_process(self):
        self.killed(signal.SIGKILL)
        self.assertIn(
            "slave 1 (spindle) acknowledged its stop telegrams", self.report_of_next_start()
        )
        self.assertNotIn("previous run", self.report_of_next_start())

    def test_a_killed_process_group(self):
        self.killed(signal.SIGKILL, group=True)

    def test_a_segmentation_fault(self):
        self.killed(signal.SIGSEGV)

    def test_an_abort(self):
        self.killed(signal.SIGABRT)

    def test_sigterm(self):
        self.killed(signal.SIGTERM)

    def test_ctrl_c(self):
        self.killed(signal.SIGINT, group=True)

    def test_a_suspended_process(self):
        for _ in range(ROUNDS):
            machine = self.run_spindle()
            since = time.monotonic()
            machine.send_signal(signal.SIGSTOP)
            self.stops(since)
            machine.send_signal(signal.SIGCONT)
            wait_until(
                lambda: self.value("modbus.0.spindle.stopped") == "FALSE", "writes are allowed"
            )
            self.assertEqual(1, self.drive.registers[0x2000])  # needs another edge of run
            self.end(machine)

    def test_a_closed_terminal(self):
        for _ in range(ROUNDS):
            terminal = Terminal(self, "run", "spindle.hal")
            self.turn()
            since = time.monotonic()
            os.close(terminal.descriptor)
            terminal.descriptor = os.open("/dev/null", os.O_RDWR)
            self.stops(since)
            os.waitpid(terminal.process, 0)
            terminal.status = 0

    def test_unload_and_e_stop_and_stop(self):
        for _ in range(ROUNDS):
            machine = self.run_spindle()
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
                    wait_until(
                        lambda: self.value("modbus.0.spindle.stopped") == "FALSE", "released"
                    )
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
        for _ in range(ROUNDS):
            machine = self.run_spindle()
            since = time.monotonic()
            self.say("exit")
            self.end(machine)
            self.stops(since)

    def test_a_drive_that_does_not_answer_is_reported(self):
        machine = self.run_spindle()
        self.drive.answers = False
        machine.send_signal(signal.SIGKILL)
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the stop telegram was sent")
        self.end(machine, signal.SIGKILL)
        self.drive.answers = True
        self.assertIn("did not acknowledge", self.report_of_next_start())

    def test_a_killed_guardian_is_a_fault(self):
        machine = self.run_spindle()
        children = self.children(machine.pid)
        self.assertEqual(1, len(children))
        os.kill(children[0], signal.SIGKILL)
        self.comes("modbus.0.fault", "TRUE")
        self.assertEqual("FALSE", self.value("modbus.0.guarded"))
        self.assertEqual("FALSE", self.value("modbus.0.spindle.online"))
        self.comes("modbus.0.spindle.stopped", "TRUE")
        self.assertEqual(STOP, self.drive.writes[-1][1])
        out = self.end(machine)[1]
        self.assertIn("guardian has ended", out)
        self.assertIn("acknowledged its stop telegrams", out)

    def test_a_killed_guardian_of_a_machine_that_ends_then(self):
        machine = self.run_spindle()
        self.drive.answers = False
        os.kill(self.children(machine.pid)[0], signal.SIGKILL)
        wait_until(lambda: self.drive.registers[0x2000] == 1, "the stop telegram was sent")
        self.comes("modbus.0.fault", "TRUE")
        wait_until(lambda: not self.children(machine.pid), "the other guardian has given up")
        self.drive.answers = True
        self.drive.registers[0x2000] = RUN
        self.assertIn("acknowledged its stop telegrams", self.end(machine)[1])
        self.assertEqual(STOP, self.drive.writes[-1][1])

    def test_a_suspended_guardian_is_a_fault_and_continued(self):
        machine = self.run_spindle()
        guardian = self.children(machine.pid)[0]
        os.kill(guardian, signal.SIGSTOP)
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
        machine = self.run_spindle()
        self.assertIn(
            "another program uses 'line'",
            self.bad("modbus", "read", "serial:line?baud=115200", "1", "holding", "0x2103"),
        )
        self.assertIn("another program uses 'line'", self.bad("run", "--name", "two", "spindle.hal"))
        self.assertEqual(RUN, self.drive.registers[0x2000])
        self.assertEqual("0", self.value("modbus.0.spindle.timeouts"))
        self.end(machine)

    @staticmethod
    def children(pid):
        found = []
        for entry in os.listdir("/proc"):
            if not entry.isdigit():
                continue
            try:
                with open(f"/proc/{entry}/stat") as stat:
                    name, rest = stat.read().rsplit(")", 1)
            except OSError:
                continue
            if int(rest.split()[1]) == pid and "hal-guardian" in name:
                found.append(int(entry))
        return found

    def test_a_line_that_cannot_be_opened_is_reported(self):
        os.unlink(self.folder / "line")
        self.assertIn("cannot open 'line'", self.bad("run", "spindle.hal"))


if __name__ == "__main__":
    unittest.main()
