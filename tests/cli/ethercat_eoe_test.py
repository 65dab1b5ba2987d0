# SPDX-License-Identifier: MIT
# packages: ethercat
"""Ethernet over EtherCAT: an emulated slave answers ARP and ping through the TAP interface of its master."""

import contextlib
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import time
import unittest

from harness import HAL, SANITIZED, Case, wait_until
from own_network import own_network

CONFIG = """[bus]
link  = sim:line
cycle = 1ms
{bus}
[defaults]
vendor  = 0x00ffffff
outputs = 7000 u64
inputs  = 6000 u64
[slave 0 a]
eoe = {first}
[slave 1 b]
eoe = {second}
"""
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt ethercat_segment devices="mailbox_device, mailbox_device" link=sim:line
loadrt ethercat names=machine config=machine.ethercat
addf machine.receive servo
addf machine.transmit servo
addf ethercat-segment.0.update servo
start
"""
WITHOUT_ADMIN = ("setpriv", "--bounding-set=-net_admin", "--inh-caps=-net_admin")


def checksum(data):
    data += b"\0" * (len(data) % 2)
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def echo_request(identifier, number, data):
    head = struct.pack("!BBHHH", 8, 0, 0, identifier, number)
    return struct.pack("!BBHHH", 8, 0, checksum(head + data), identifier, number) + data


def ping(address, size, count=1, timeout=20.0):
    """Sends echo requests, each once the one before was answered; how many were. One that is lost is sent again."""
    answered, deadline = 0, time.monotonic() + timeout
    with socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP) as raw:
        raw.settimeout(1.0)
        while answered < count and time.monotonic() < deadline:
            data = bytes((answered + n) % 256 for n in range(size))
            request = echo_request(os.getpid() & 0xFFFF, answered, data)
            raw.sendto(request, (address, 0))
            try:
                while True:
                    packet, sender = raw.recvfrom(65536)
                    icmp = packet[20:]
                    if (
                        sender[0] == address
                        and icmp[0] == 0
                        and icmp[4:] == request[4:]
                        and checksum(icmp) == 0
                    ):
                        answered += 1
                        break
            except OSError:
                pass  # timeout, or the host is not reachable yet
    return answered


class Eoe(Case):
    def setUp(self):
        super().setUp()
        if SANITIZED:
            self.skipTest("a master under a sanitizer misses its cycles")
        if not os.path.exists("/dev/net/tun"):
            self.skipTest("no /dev/net/tun here")
        self.write("machine.hal", NETLIST)

    def configure(self, first="yes", second="no", bus=""):
        self.write("machine.ethercat", CONFIG.format(first=first, second=second, bus=bus))

    def run_machine(self, *before):
        log = self.folder / "log.txt"
        with open(log, "w", encoding="utf-8") as out:
            machine = subprocess.Popen(
                [*before, HAL, "run", "--name", "eoe", "--no-picture", "machine.hal"],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                text=True,
            )
        self.addCleanup(lambda: (machine.terminate(), machine.wait(60)))
        return machine

    def said(self):
        return (self.folder / "log.txt").read_text()

    def begin(self):
        machine = self.run_machine()
        wait_until(
            lambda: self.said().count("is operational") == 2 or machine.poll() is not None,
            "both slaves are operational",
        )
        self.assertIsNone(machine.poll(), self.said())
        return machine

    def pin(self, name):
        return int(self.run_program("shell", "--name", "eoe", "-s", "getp", name).stdout)

    @staticmethod
    def shown(name):
        return subprocess.run(["ip", "addr", "show", name], capture_output=True, text=True).stdout

    def test_ping_passes_beside_the_process_data(self):
        self.configure(
            "192.168.2.10/24 host 192.168.2.1 gateway 192.168.2.1 interface eoe0",
            "192.168.3.10/24 host 192.168.3.1 mac 02:00:00:00:00:77",
        )
        machine = self.begin()
        lost, incomplete = self.pin("machine.frames-lost"), self.pin("machine.cycles-incomplete")
        self.assertIn("inet 192.168.2.1/24", self.shown("eoe0"))
        wait_until(
            lambda: "LOWER_UP" in self.shown("eoe0") and "LOWER_UP" in self.shown("eoe-b"),
            "the interfaces have a carrier",
        )
        self.assertEqual(20, ping("192.168.2.10", 56, 20))
        self.assertEqual(3, ping("192.168.2.10", 1472, 3), "in fragments of the mailbox")
        self.assertEqual(3, ping("192.168.3.10", 56, 3))
        neighbours = subprocess.run(["ip", "neigh"], capture_output=True, text=True).stdout
        self.assertRegex(neighbours, r"192\.168\.2\.10 dev eoe0 lladdr 02:ec:a7:[0-9a-f]{2}:00:00 ")
        self.assertIn("192.168.3.10 dev eoe-b lladdr 02:00:00:00:00:77 ", neighbours)
        self.assertEqual(
            (lost, incomplete),
            (self.pin("machine.frames-lost"), self.pin("machine.cycles-incomplete")),
            "cycles without process data",
        )
        machine.terminate()
        machine.wait(60)
        self.assertEqual("", self.shown("eoe0"), "the interface ends with the machine")

    def test_a_switch_connects_all_slaves_to_one_interface(self):
        self.configure("192.168.2.10/24", "192.168.2.11/24", "eoe-switch = eoe9 192.168.2.1/24")
        self.begin()
        self.assertEqual(5, ping("192.168.2.10", 56, 5))
        self.assertEqual(5, ping("192.168.2.11", 300, 5))
        self.assertEqual("", self.shown("eoe-a"))

    def test_the_carrier_is_lost_with_the_slave(self):
        self.configure("192.168.2.10/24 host 192.168.2.1")
        self.begin()
        self.assertEqual(1, ping("192.168.2.10", 56))
        self.run_program(
            "shell", "--name", "eoe", "-s", "setp", "ethercat-segment.0.slave-0.power", "FALSE"
        )
        wait_until(lambda: "NO-CARRIER" in self.shown("eoe-a"), "no carrier")
        self.run_program(
            "shell", "--name", "eoe", "-s", "setp", "ethercat-segment.0.slave-0.power", "TRUE"
        )
        self.assertEqual(2, ping("192.168.2.10", 56, 2, 60), "its address was written again")

    def test_a_stopped_machine_has_no_carrier_and_drops_what_is_sent(self):
        self.configure("192.168.2.10/24 host 192.168.2.1")
        self.begin()
        self.assertEqual(1, ping("192.168.2.10", 56))
        self.run_program("shell", "--name", "eoe", "stop")
        with socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP) as raw:
            raw.settimeout(0.2)
            for number in range(6):
                raw.sendto(echo_request(77, number, b""), ("192.168.2.10", 0))
            wait_until(lambda: "NO-CARRIER" in self.shown("eoe-a"), "no carrier")
            self.run_program("shell", "--name", "eoe", "start")
            self.assertEqual(2, ping("192.168.2.10", 56, 2, 60), "it goes on")
            self.assertGreater(self.pin("machine.eoe-dropped"), 0)
            late = []
            with contextlib.suppress(TimeoutError):
                while True:
                    packet = raw.recv(2000)[20:]
                    if packet[0] == 0 and packet[4:6] == struct.pack("!H", 77):
                        late.append(packet)
            self.assertEqual([], late, "answers to what was sent during the stop")

    def test_a_missing_privilege_names_what_to_type(self):
        if not shutil.which("setpriv"):
            self.skipTest("no setpriv here")
        self.configure("192.168.2.10/24 host 192.168.2.1")
        machine = self.run_machine(*WITHOUT_ADMIN)
        self.assertEqual(1, machine.wait(60), self.said())
        found = re.findall(r"cannot start: (eoe: .*) \[start-failed\]", self.said())
        self.assertEqual(
            [
                "eoe: interface eoe-a needs the capability CAP_NET_ADMIN; grant it with: sudo setcap "
                f"cap_sys_nice,cap_ipc_lock,cap_net_raw,cap_net_admin=ep {HAL.resolve()}; or create it once: sudo ip tuntap add dev eoe-a mode tap user "
                "$USER; sudo ip link set eoe-a up; sudo ip addr add 192.168.2.1/24 dev eoe-a"
            ],
            found,
            self.said(),
        )

    def test_an_interface_of_an_administrator_needs_no_privilege(self):
        if not shutil.which("setpriv"):
            self.skipTest("no setpriv here")
        for words in (
            "tuntap add dev eoe-a mode tap user root",
            "link set eoe-a up",
            "addr add 192.168.2.1/24 dev eoe-a",
        ):
            if subprocess.run(["ip", *words.split()], capture_output=True).returncode != 0:
                self.skipTest("no TAP interface can be created here")
        self.addCleanup(subprocess.run, ["ip", "link", "delete", "eoe-a"])
        self.configure("192.168.2.10/24 host 192.168.2.1")
        machine = self.run_machine(*WITHOUT_ADMIN)
        wait_until(
            lambda: self.said().count("is operational") == 2 or machine.poll() is not None,
            "both slaves are operational",
        )
        self.assertIsNone(machine.poll(), self.said())
        self.assertEqual(2, ping("192.168.2.10", 56, 2))


if __name__ == "__main__":
    if not own_network():
        print("skipped: no network namespaces here")
        sys.exit(77)
    unittest.main()
