# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""Ordinary packets on a TDMA segment, between two processes through their TAP interfaces: ping, TCP, and what can be in the way."""
import hashlib
import os
import shutil
import subprocess
import sys
import unittest

from harness import HAL, wait_until
from segment import Segment, enter, ip

# Cycles and guards that a busy machine keeps, so that what is lost was lost by the tunnel.
CELL = """cycle 5000
speed 1000
guard 400
lost 1000
rounds 10

master:
name m
ip 10.9.0.1
slot 0 500 1/1 46
slot 1 1500 1/1 1500

slave:
name x
ip 10.9.0.2
slot 0 2500 1/1 46
slot 1 3500 1/1 {size}
"""

NETLIST = """loadrt threads name1=servo period1=5000000
loadrt tdma link=eth:wire0 config=cell.tdma station={name} {tunnel}
addf tdma.0.receive servo 1
addf tdma.0.transmit servo -1
"""

SERVER = """import hashlib, socket
s = socket.create_server(("10.9.0.1", 5000))
print("listens", flush=True)
c, _ = s.accept()
got = b""
while len(got) < {size} and (part := c.recv(65536)): got += part
c.sendall(got[::-1])
c.close()
print(hashlib.sha256(got).hexdigest())
"""

CLIENT = """import hashlib, socket, sys
given = open("given", "rb").read()
s = socket.create_connection(("10.9.0.1", 5000), timeout=200)
s.sendall(given)
got = b""
while part := s.recv(65536): got += part
print(hashlib.sha256(got[::-1]).hexdigest())
"""

GRANT = (
    "needs the capability CAP_NET_ADMIN; grant it with: sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw,cap_net_admin=ep "
    f"{HAL.resolve()}; or create it once: "
)
WITHOUT_ADMIN = ("setpriv", "--bounding-set=-net_admin", "--inh-caps=-net_admin")


class Tunnel(Segment):
    def netlist(self, name, tunnel="tunnel=hal0"):
        return NETLIST.format(name=name, tunnel=tunnel)

    def both(self, size=1500):
        self.write("cell.tdma", CELL.format(size=size))
        for name in self.names:
            self.station(name, self.netlist(name))
        for name in self.names:
            self.wait_for(name, "tunnel-open", "TRUE")
            self.wait_for_carrier(name)

    def wait_for_carrier(self, name):
        """Packets may pass there."""
        wait_until(
            lambda: ",LOWER_UP" in self.at(name, "ip", "link", "show", "hal0").stdout,
            f"hal0 of {name} has a carrier",
        )

    def ping(self, name, to, *words):
        if not shutil.which("ping"):
            self.skipTest("no ping here; apt install iputils-ping")
        done = self.at(
            name, "ping", "-c", "5", "-i", "0.2", "-w", "100", *words, to
        )  # until five replies arrived
        print(done.stdout, file=sys.stderr)
        self.assertEqual(0, done.returncode, done.stdout + self.all_said())

    def test_ping_and_tcp_cross_the_bus_without_disturbance(self):
        self.both()
        for name, mask in (("m", "10.9.0.1/24"), ("x", "10.9.0.2/24")):
            shown = self.at(name, "ip", "addr", "show", "hal0").stdout
            for what in ("mtu 1496", self.mac(name), mask, "state UP"):
                self.assertIn(what, shown)
        self.ping("m", "10.9.0.2")
        self.ping("x", "10.9.0.1", "-s", "4000")  # in three fragments
        given = os.urandom(120_000)
        (self.folder / "given").write_bytes(given)
        server = subprocess.Popen(
            ["ip", "netns", "exec", "m", sys.executable, "-c", SERVER.format(size=len(given))],
            stdout=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.stop, server)
        self.assertEqual("listens\n", server.stdout.readline())
        self.assertEqual(
            hashlib.sha256(given).hexdigest() + "\n",
            self.at("x", sys.executable, "-c", CLIENT).stdout,
            "there and back",
        )
        self.assertEqual(
            hashlib.sha256(given).hexdigest() + "\n", server.communicate(timeout=200)[0]
        )
        for name in self.names:
            print(
                name,
                {
                    pin: self.number(name, pin)
                    for pin in (
                        "tunnel-sent",
                        "tunnel-received",
                        "tunnel-dropped",
                        "frames-late",
                        "frames-sent",
                        "syncs-lost",
                        "frames-intruding",
                    )
                },
                file=sys.stderr,
            )
            self.assertEqual(
                ["TRUE", "TRUE", "FALSE"],
                [self.pin(name, pin) for pin in ("synchronous", "running", "fault")],
                self.said(name),
            )
            self.assertEqual(
                [0] * 3,
                [self.number(name, pin) for pin in ("losses", "tunnel-rejected", "frames-foreign")],
                self.said(name),
            )
            self.assertGreater(
                self.number(name, "tunnel-sent"), 90
            )  # 120 kB are 83 packets each way; five pings
            self.assertNotIn("babbling", self.said(name))

    def test_its_mtu_is_its_slots_size(self):
        self.both(size=200)
        self.assertIn("mtu 196", self.at("x", "ip", "link", "show", "hal0").stdout)
        self.assertIn(
            "tdma.0: tunnel open for ordinary packets: hal0, MTU 196, IP 10.9.0.2\n", self.said("x")
        )
        self.ping("x", "10.9.0.1", "-s", "400")
        # The interface is removed and created with its station.
        ip("-n", "m", "link", "delete", "hal0")
        self.wait_for_words(
            "m",
            "tdma.0: interface hal0 was deleted; ordinary packets pass again after unloadrt and loadrt\n",
        )
        self.assertEqual("TRUE", self.pin("m", "running"))

    def test_a_station_without_a_file_gets_its_ip_with_its_schedule(self):
        cell = CELL.replace("name x\n", f"name x\nmac {self.mac('x')}\n").replace(
            "slot 0 500 1/1 46", "slot 0 500 1/1 300"
        )
        self.write("cell.tdma", cell.format(size=200))
        self.station("x", self.netlist("x").replace("config=cell.tdma station=x", "station=auto"))
        self.assertNotIn("ordinary packets", self.said("x"))
        self.station("m", self.netlist("m"))
        self.wait_for_words(
            "x", "tdma.0: tunnel open for ordinary packets: hal0, MTU 196, IP 10.9.0.2\n"
        )
        for name in self.names:
            self.wait_for_carrier(name)
        self.ping("m", "10.9.0.2")
        self.assertIn("mtu 196", self.at("x", "ip", "link", "show", "hal0").stdout)

    def refused(self, tunnel, *before, station="m", cell=CELL):
        """The message of the program that exits because of the tunnel."""
        self.write("cell.tdma", cell.format(size=1500))
        self.write("bad.hal", self.netlist(station, tunnel))
        done = self.at(
            "m",
            *before,
            HAL,
            "run",
            "--name",
            "test-bad",
            "--no-picture",
            "bad.hal",
            env=self.environment,
        )
        self.assertNotEqual(0, done.returncode, done.stdout)
        return next(line for line in done.stdout.splitlines() if "error: " in line).partition(
            "error: "
        )[2]

    def test_what_is_in_the_way_is_named(self):
        starts = "'tdma.0' (tdma) cannot start: tunnel: "
        self.assertEqual(
            starts
            + "interface wire0 exists, but is not a TAP interface; use another name, for example hal%d "
            "[start-failed]",
            self.refused("tunnel=wire0"),
        )
        by_hand = (
            "sudo ip tuntap add dev hal0 mode tap user $USER; sudo ip link set hal0 address "
            + self.mac("m")
            + " mtu 1496 up; sudo ip addr add 10.9.0.1/16 dev hal0"
        )
        self.assertEqual(
            starts + "interface hal0 " + GRANT + by_hand + " [start-failed]",
            self.refused("tunnel=hal0 netmask=255.255.0.0", *WITHOUT_ADMIN),
        )
        self.assertEqual(
            starts
            + "missing /dev/net/tun (No such file or directory); type: sudo modprobe tun, or for a container add: "
            "--device /dev/net/tun [start-failed]",
            self.refused(
                "tunnel=hal0",
                "unshare",
                "--mount",
                "sh",
                "-c",
                'mount -t tmpfs tmpfs /dev/net && exec "$@"',
                "sh",
            ),
        )
        self.station("m", self.netlist("m"))
        wait_until(lambda: "running until" in self.said("m"), "the master runs")
        self.assertEqual(
            starts
            + "interface hal0 is in use by another process; use another name, for example hal%d [start-failed]",
            self.refused("tunnel=hal0"),
        )

    def test_what_cannot_be_is_named_before_anything_starts(self):
        self.assertEqual(
            "component 'tdma': tunnel=hal0: ordinary packets use slot 1, and x has none; add slot 1 OFFSET to its "
            "block in cell.tdma: `hal tdma plan` shows the free time [bad-argument]",
            self.refused(
                "tunnel=hal0", station="x", cell=CELL.replace("slot 1 3500 1/1 {size}", "")
            ),
        )
        self.assertEqual(
            "component 'tdma': tunnel='a/b' is not a valid interface name; use at most 15 letters and digits, for example hal0, or "
            "hal%d for the first free number [bad-argument]",
            self.refused("tunnel=a/b"),
        )
        self.assertEqual(
            "component 'tdma': invalid netmask=255.0.255.0; write 24 or 255.255.255.0 [bad-argument]",
            self.refused("tunnel=hal0 netmask=255.0.255.0"),
        )
        self.assertEqual(
            "slot 1 carries IP packets, but its 71 bytes are too few: IP needs 68 and the RTmac header 4 [tdma-schedule]",
            self.refused("tunnel=hal0", cell=CELL.replace("1/1 1500", "1/1 71")),
        )

    def test_a_device_of_hal_node_has_one_too(self):
        self.write("cell.tdma", CELL.format(size=300))
        self.station("m", self.netlist("m"))
        node = [
            "ip",
            "netns",
            "exec",
            "x",
            HAL,
            "node",
            "axis-io",
            "--id",
            "2",
            "--link",
            "cane:wire0?to=master",
            "--tdma",
            "cell.tdma",
            "--station",
            "x",
        ]
        ended = subprocess.run(
            [*node, "--tunnel", "wire0"],
            cwd=self.folder,
            env=self.environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.assertEqual(
            (
                1,
                "hal node axis-io: --tunnel: interface wire0 exists, but is not a TAP interface; use another name, "
                "for example hal%d\n",
            ),
            (ended.returncode, ended.stderr),
        )
        process = subprocess.Popen(
            [*node, "--tunnel", "hal%d"],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.DEVNULL,
        )
        self.addCleanup(self.stop, process)
        self.wait_for("m", "running", "TRUE")
        self.wait_for_carrier("x")
        self.ping("m", "10.9.0.2")
        self.assertIn("mtu 296", self.at("x", "ip", "link", "show", "hal0").stdout)

    def test_an_interface_made_by_hand_needs_no_right(self):
        self.at("m", "ip", "tuntap", "add", "dev", "hal7", "mode", "tap", "user", "0")
        self.at("m", "ip", "link", "set", "hal7", "address", self.mac("m"), "mtu", "1496", "up")
        self.at("m", "ip", "addr", "add", "10.9.0.1/24", "dev", "hal7")
        self.write("cell.tdma", CELL.format(size=1500))
        self.write("m.hal", self.netlist("m", "tunnel=hal7"))
        process = subprocess.Popen(
            [
                "ip",
                "netns",
                "exec",
                "m",
                *WITHOUT_ADMIN,
                HAL,
                "run",
                "--name",
                "test-m",
                "--no-picture",
                "m.hal",
            ],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.stderr.close)
        self.addCleanup(self.stop, process)
        self.assertEqual(
            "tdma.0: tunnel open for ordinary packets: hal7, MTU 1496, IP 10.9.0.1\n",
            process.stderr.readline(),
        )
        self.station("x", self.netlist("x"))
        self.wait_for("x", "tunnel-open", "TRUE")
        self.ping("x", "10.9.0.1")


if __name__ == "__main__":
    enter()
    unittest.main()
