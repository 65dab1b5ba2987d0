#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What the network does: a partition and its end, which packets leave the machine, a discovery server; in a network namespace of its own. Skipped
where none can be created."""
import json
import shutil
import signal
import subprocess
import sys
import unittest

from rig import DdsCase, own_network, wait_until

if not own_network():
    print("cannot create a network namespace (unshare --net)")
    sys.exit(77)


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def sent_packets(interface):
    found = json.loads(
        subprocess.run(
            ["ip", "-json", "-stats", "link", "show", interface], check=True, capture_output=True
        ).stdout
    )
    return found[0]["stats64"]["tx"]["packets"]


class Network(DdsCase):
    def test_a_partition_makes_the_pins_invalid_until_it_ends(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=300")
        self.becomes("sub.valid", "TRUE")
        ip("link", "set", "lo", "down")
        self.addCleanup(ip, "link", "set", "lo", "up")
        self.becomes("sub.valid", "FALSE")
        self.assertEqual("-1", self.value("sub.angle", "subscriber"))
        self.becomes("sub.matched", "0")  # both have dropped each other
        self.becomes("pub.matched", "0", "publisher")
        ip("link", "set", "lo", "up")
        self.becomes("sub.valid", "TRUE")
        self.shows("1.5")
        self.prints("sub: topic 'arm/state' is valid again\n")

    def test_a_suspended_process_announces_itself_again(self):
        """It uses a new identity: the state that Fast DDS 2.9 keeps of a dropped participant may be stale."""
        self.subscriber(more="timeout_ms=300")
        publisher = self.publisher(1.5)
        self.becomes("sub.valid", "TRUE")
        publisher.send_signal(signal.SIGSTOP)
        self.addCleanup(publisher.send_signal, signal.SIGCONT)
        self.becomes("sub.matched", "0")  # dropped after 5 s
        wait_until(
            lambda: float(self.value("sub.age-ms", "subscriber")) > 7000,
            "it is suspended for longer than its lease",
        )
        self.assertEqual("FALSE", self.value("sub.valid", "subscriber"))
        publisher.send_signal(signal.SIGCONT)
        # a process without CPU time for longer than its threads' limit runs its functions again after `start`
        wait_until(
            lambda: "got no CPU time" in self.shell("show", "fault", instance="publisher").stdout,
            "the thread has reported its fault",
        )
        self.good("shell", "--name", "publisher", "start")
        self.becomes("sub.valid", "TRUE")
        self.shows("1.5")
        self.becomes("pub.matched", "1", "publisher")
        self.assertRegex(
            self.words("publisher"),
            r"dds: this process was suspended for \d+\.\d s and may have been dropped by others; announcing it again\n",
        )

    def test_nothing_leaves_the_machine_without_interfaces(self):
        ip("link", "add", "out0", "type", "veth", "peer", "name", "out1")
        self.addCleanup(ip, "link", "del", "out0")
        for command in (
            ["link", "set", "out0", "address", "02:00:00:00:00:01"],
            ["addr", "add", "10.77.0.1/24", "dev", "out0"],
            ["link", "set", "out0", "up"],
            ["link", "set", "out1", "up"],
            ["route", "add", "default", "via", "10.77.0.2"],
        ):
            ip(*command)
        with open("/proc/sys/net/ipv6/conf/out0/disable_ipv6", "w") as file:
            file.write("1")  # its neighbour discovery is not ours
        before = sent_packets("out0")
        publisher = self.publisher()
        self.subscriber()
        self.becomes("sub.valid", "TRUE")
        self.assertEqual(before, sent_packets("out0"))
        self.end_quietly(publisher)
        self.publisher(more="interfaces=out0")
        wait_until(
            lambda: sent_packets("out0") > before, "it announces itself on the given interface"
        )

    def test_a_discovery_server_connects_them(self):
        if not shutil.which("fast-discovery-server"):
            self.skipTest("fast-discovery-server is not installed (fastdds-tools)")
        server = subprocess.Popen(
            ["fast-discovery-server", "-i", "0", "-l", "127.0.0.1", "-p", "11811"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=self.folder,
        )
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        self.publisher(3.5, more="server=127.0.0.1:11811")
        self.subscriber(more="server=127.0.0.1:11811")
        self.becomes("sub.valid", "TRUE")
        self.shows("3.5")


if __name__ == "__main__":
    unittest.main()
