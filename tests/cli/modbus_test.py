# SPDX-License-Identifier: MIT
# packages: modbus
"""hal modbus and hal node modbus on a pseudo terminal and on TCP: check, plan, scan, read, write, monitor, faults, and a spindle in real time."""

import fcntl
import json
import os
import pty
import signal
import socket
import threading
import time
import tty
import unittest

from harness import TIMEOUT, Case, wait_until

BUS = """[bus]
link = serial:line
baud = 38400
[slave 3 io]
read level = input 0x10 s16 scale 0.1
read ready = holding 0x20.3
write pump = coil 3
stop = coil 3 0
[slave 7 spindle]
profile = vfs11
every = 100ms
"""

TCP = BUS.replace("serial:line", "{line}")

CONFIRM = "[bus]\nlink = sim:c\n[slave 3 meter]\nread a = holding 0\nconfirm = yes\n"


def open_files(pid):
    """What the descriptors of a process refer to."""
    folder = f"/proc/{pid}/fd"
    return [os.readlink(f"{folder}/{number}") for number in os.listdir(folder)]


class Modbus(Case):
    def setUp(self):
        super().setUp()
        self.write("bus.modbus", BUS)

    def node(self, link, *words):
        node = self.start_logged("node", "modbus", "bus.modbus", "--link", link, *words)
        self.addCleanup(self.end_node, node)
        wait_until(
            lambda: "2 slaves on" in (self.folder / "node.log").read_text(), "the slaves run"
        )
        return node

    @staticmethod
    def end_node(node):
        node.terminate()
        node.wait(timeout=TIMEOUT)

    def closing_device(self):
        """A device that accepts each connection, reads a request, and closes it; its line."""
        server = socket.create_server(("127.0.0.1", 0))

        def serve():
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    connection.recv(256)

        thread = threading.Thread(target=serve)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(server.close)
        self.addCleanup(server.shutdown, socket.SHUT_RDWR)
        return f"tcp:127.0.0.1:{server.getsockname()[1]}"

    def test_a_connection_that_is_closed_is_named(self):
        line = self.closing_device()
        closed = (
            f"{line} has closed the connection before the answer of slave 1; check its address, "
            "and whether the device accepts another connection\n"
        )
        for words in (("read", line, "1", "holding", "0"), ("write", line, "1", "coil", "0", "1")):
            self.assertEqual(f"hal modbus {words[0]}: {closed}", self.bad("modbus", *words))
        self.assertEqual(
            f"hal modbus scan: no slave answers: {closed}",
            self.bad("modbus", "scan", line, "--first", "1", "--last", "2"),
        )
        # on TCP slave 0 is a device: it has not accepted the request
        self.assertIn(
            f"{line} has closed the connection",
            self.bad("modbus", "write", line, "0", "coil", "0", "1"),
        )

    def test_slaves_make_no_connection(self):
        self.assertEqual(
            "hal node modbus: tcp:127.0.0.1:15020 makes a connection, and slaves wait for one; "
            "write --link listen:127.0.0.1:15020\n",
            self.bad("node", "modbus", "bus.modbus", "--link", "tcp:127.0.0.1:15020"),
        )

    def test_check_and_plan(self):
        self.assertEqual(
            "bus.modbus: 2 slaves, 7 values, 6 telegrams\n",
            self.good("modbus", "check", "bus.modbus"),
        )
        plan = json.loads(self.good("modbus", "plan", "bus.modbus", "--json"))
        self.assertEqual(6, len(plan["telegrams"]))
        self.assertTrue(0 < plan["use"] < 1)
        for telegram in plan["telegrams"]:
            self.assertGreater(telegram["age_ns"], telegram["period_ns"])
        self.write("bad.modbus", "[bus]\n[slave 1 a]\nread x = holding\n")
        self.assertIn("[modbus-value]", self.bad("modbus", "check", "bad.modbus"))
        self.write("confirm.modbus", CONFIRM)
        self.assertEqual(
            "confirm of slave 3 (meter): a changed value is read twice; the table counts one read",
            self.good("modbus", "plan", "confirm.modbus").splitlines()[-2],
        )
        self.assertIn("cannot read", self.bad("modbus", "plan", "none.modbus"))

    def by_hand(self, line):
        self.assertEqual(
            "slave 3 answers: illegal data address (exception 2)\n"
            "slave 7 answers: illegal data address (exception 2)\n",
            self.good("modbus", "scan", line, "--last", "9", "--timeout", "40ms"),
        )
        self.assertEqual(
            "0x0010  0xFF83  65411  -125\n", self.good("modbus", "read", line, "3", "input", "0x10")
        )
        self.assertEqual("0x0003  0\n", self.good("modbus", "read", line, "3", "coil", "3"))
        self.assertEqual("", self.good("modbus", "write", line, "3", "coil", "3", "1"))
        self.assertEqual("0x0003  1\n", self.good("modbus", "read", line, "3", "coil", "3"))
        self.assertEqual("", self.good("modbus", "write", line, "0", "coil", "3", "0"))
        self.assertEqual("0x0003  0\n", self.good("modbus", "read", line, "3", "coil", "3"))
        self.assertEqual(
            "hal modbus read: slave 3 rejects 'read holding 0x0500': illegal data address (exception 2)\n",
            self.bad("modbus", "read", line, "3", "holding", "0x500"),
        )
        self.assertIn("slave 4 does not answer", self.bad("modbus", "read", line, "4", "coil", "3"))
        for words in (
            ("3", "register", "0"),
            ("3", "coil", "70000"),
            ("300", "coil", "0"),
            ("3", "coil"),
            ("3", "coil", "0", "2001"),
        ):
            self.bad("modbus", "read", line, *words)
        self.bad("modbus", "write", line, "3", "input", "0", "1")
        self.bad("modbus", "write", line, "3", "coil", "0", "2")
        self.bad("modbus", "write", line, "3", "holding", "0", "65536")
        self.bad("modbus", "write", line, "3", "holding", "0")

    def test_by_hand_on_a_terminal(self):
        self.node("pty:line", "--set", "io.level=-12.5")
        line = "serial:line?baud=38400"
        self.by_hand(line)
        self.assertEqual(
            "hal modbus read: slave 0 is the broadcast address, which no slave answers; write "
            "1..247\n",
            self.bad("modbus", "read", line, "0", "coil", "3"),
        )

    def test_by_hand_on_tcp(self):
        port = 20000 + os.getpid() % 20000
        self.node(f"listen:{port}", "--set", "io.level=-12.5")
        self.by_hand(f"tcp:127.0.0.1:{port}")

    def test_a_device_on_tcp_that_rejects_a_write_to_unit_0(self):
        listener = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(listener.close)

        def reject():
            connection = listener.accept()[0]
            with connection:
                request = connection.recv(260)
                connection.sendall(request[:4] + bytes.fromhex("0003 00 86 02"))

        device = threading.Thread(target=reject)
        device.start()
        self.addCleanup(device.join)
        line = f"tcp:127.0.0.1:{listener.getsockname()[1]}"
        self.assertEqual(
            "hal modbus write: slave 0 rejects 'write holding 0x0003': illegal data address "
            "(exception 2)\n",
            self.bad("modbus", "write", line, "0", "holding", "3", "1"),
        )

    def test_a_node_listens_on_the_tcp_line_of_its_file(self):
        port = 22000 + os.getpid() % 20000
        line = f"tcp:127.0.0.1:{port}"
        self.write("tcp.modbus", TCP.format(line=line))
        self.start("node", "modbus", "tcp.modbus", loaded=False)
        wait_until(
            lambda: self.run_program("modbus", "read", line, "3", "coil", "3").returncode == 0,
            "the slaves of the file listen",
        )
        self.write("away.modbus", TCP.format(line="tcp:192.0.2.1:502"))
        self.assertEqual(
            "hal node modbus: listen:192.0.2.1:502: cannot listen: Cannot assign requested address; "
            "link = tcp:192.0.2.1:502 of the file must be an address of this computer and a free "
            "port; for another one write --link listen:5020, and load the machine with "
            "link=tcp:127.0.0.1:5020\n",
            self.bad("node", "modbus", "away.modbus"),
        )

    def test_invalid_lines_and_faults(self):
        self.assertIn("write serial:/dev/ttyUSB0 for", self.bad("modbus", "scan", "usb0"))
        self.assertIn("cannot open '/dev/none'", self.bad("modbus", "scan", "serial:/dev/none"))
        self.assertIn("not a serial line", self.bad("modbus", "scan", "serial:/dev/null"))
        self.assertIn("invalid baud", self.bad("modbus", "scan", "serial:/dev/null?baud=x"))
        for fault, problem in (
            (
                "slow",
                "unknown fault 'slow'; faults are silence, late, corrupt, wrong-unit, exception, half, noise",
            ),
            ("late:every=0", "invalid option 'every=0'; write a whole number from 1"),
            ("late:late=soon", "invalid option 'late=soon'; write a time, as in late=200ms"),
            ("half:unit=248", "invalid option 'unit=248'; write a slave, 1..247, or 0 for all"),
            ("half:for", "invalid option 'for'; write a time, as in for=2s"),
            ("half:late=1s", "half has no option 'late'; its options are unit, every, from, for"),
            ("noise:share=1.5", "invalid option 'share=1.5'; write a number in 0..1"),
            ("noise:unit=2", "noise has no option 'unit'; its options are share, from, for"),
            ("noise:every=2", "noise has no option 'every'; its options are share, from, for"),
            ("noise:late=1s", "noise has no option 'late'; its options are share, from, for"),
            ("late:x=1", "late has no option 'x'; its options are unit, every, late, from, for"),
        ):
            self.assertEqual(
                f"hal node modbus: --fault: {problem}\n",
                self.bad("node", "modbus", "bus.modbus", "--link", "pty:l", "--fault", fault),
            )
        of_io = "values that can be set are level, ready"
        of_spindle = "this slave has no value that can be set"
        for setting, problem in (
            ("io.x=1", f"io.x: unknown value; {of_io}"),
            ("io.level=4000", "io.level: out of range; write -3276.8..3276.7"),
            ("io.ready=2", "io.ready: out of range; write 0..1"),
            ("io.pump=1", f"io.pump: the master writes it; {of_io}"),
            (
                "spindle.speed-fb=3",
                f"spindle.speed-fb: the model of the drive writes it; {of_spindle}",
            ),
            ("oi.level=1", "unknown slave 'oi'; slaves are io, spindle"),
        ):
            self.assertEqual(
                f"hal node modbus: --set '{setting}': {problem}\n",
                self.bad("node", "modbus", "bus.modbus", "--link", "pty:l", "--set", setting),
            )
        self.write("file", "")
        self.assertIn(
            "'file' exists", self.bad("node", "modbus", "bus.modbus", "--link", "pty:file")
        )

    def test_a_pseudo_terminal_is_not_left_exclusive(self):
        """Its other side holds it open, and the exclusive mode with it: no later program of an ordinary user could open it."""
        self.node("pty:line", "--set", "io.level=-12.5")
        self.good("modbus", "read", "serial:line?baud=38400", "3", "coil", "3")
        line = os.open(self.folder / "line", os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, line)
        get_exclusive = 0x80045440  # TIOCGEXCL
        self.assertEqual(b"\0\0\0\0", fcntl.ioctl(line, get_exclusive, b"\0\0\0\0"))

    def test_corrupt_and_silent_slaves(self):
        self.node("pty:line", "--fault", "corrupt:unit=3", "--fault", "silence:unit=7")
        line = "serial:line?baud=38400"
        self.assertIn(
            "wrong check sequence", self.bad("modbus", "read", line, "3", "input", "0x10")
        )
        self.assertIn("does not answer", self.bad("modbus", "read", line, "7", "input", "0x10"))

    def test_monitor(self):
        master, slave = pty.openpty()
        tty.setraw(master)
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), self.folder / "line")
        monitor = self.start("modbus", "monitor", "serial:line", loaded=False)
        request = bytes.fromhex("010321030001 7E36")

        def seen():
            os.write(master, request)
            return os.ttyname(slave) in open_files(monitor.pid)

        wait_until(seen, "it listens")
        os.write(master, request + bytes.fromhex("0103020000B844"))
        time.sleep(0.2)  # a pause ends a frame
        os.write(master, request[:5])
        time.sleep(0.2)
        out = self.end(monitor)[0]
        self.assertIn("01 03 21 03 00 01 7E 36 \n", out)
        self.assertIn("01 03 02 00 00 B8 44 \n", out)
        self.assertIn("01 03 21 03 00  wrong check sequence", out)
        os.close(master)
        os.close(slave)

    def test_a_monitor_reports_that_its_line_is_lost(self):
        master, slave = pty.openpty()
        os.symlink(os.ttyname(slave), self.folder / "line")
        monitor = self.start("modbus", "monitor", "serial:line", "--for", "1s", loaded=False)
        target = os.ttyname(slave)
        wait_until(lambda: target in open_files(monitor.pid), "it listens")
        (self.folder / "line").unlink()  # another program may get the terminal
        os.close(slave)
        os.close(master)
        self.assertEqual(
            "hal modbus monitor: serial:line is lost; it is opened again\n",
            monitor.communicate(timeout=TIMEOUT)[1],
        )

    def test_a_simulation_does_not_open_a_real_line(self):
        self.write("a.hal", "loadrt modbus config=bus.modbus link=tcp:127.0.0.1:1\n")
        self.assertIn("'tcp:127.0.0.1:1' is a real line", self.bad("sim", "a.hal"))

    def spindle_is_stopped(self, node, link, number):
        """Runs the spindle on a line, ends the machine by a signal, and waits until the emulated drive stops."""
        self.node(node, "--verbose")
        self.write(
            "spindle.hal",
            "loadrt threads name1=servo period1=1000000\n"
            f"loadrt modbus config=bus.modbus link={link}\n"
            "addf modbus.0.receive servo\naddf modbus.0.transmit servo\nstart\n",
        )
        machine = self.start("run", "spindle.hal")
        self.comes("modbus.0.spindle.online", "TRUE")
        self.assertEqual("TRUE", self.value("modbus.0.guarded"))
        self.say("setp", "modbus.0.spindle.speed-cmd", "-2400")
        self.say("setp", "modbus.0.spindle.run", "TRUE")
        self.comes("modbus.0.spindle.speed-fb", "-2400")
        self.comes("modbus.0.spindle.at-speed", "TRUE")
        self.end(machine, number)
        wait_until(
            lambda: (self.folder / "node.log").read_text().count("spindle: stop") >= 2,
            "the spindle is stopped",
        )

    def test_a_spindle_on_a_terminal(self):
        self.spindle_is_stopped("pty:line", "serial:line", signal.SIGTERM)

    def test_a_spindle_on_tcp_and_a_killed_machine(self):
        port = 21000 + os.getpid() % 20000
        self.spindle_is_stopped(f"listen:{port}", f"tcp:127.0.0.1:{port}", signal.SIGKILL)


if __name__ == "__main__":
    unittest.main()
