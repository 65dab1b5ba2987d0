# SPDX-License-Identifier: MIT
# packages: ethercat
"""What keeps an EtherCAT master from its slaves on a real interface: no carrier, no privilege, no such interface, another master."""
import shutil
import subprocess
import sys
import unittest

from harness import Case, HAL
from own_network import own_network

CONFIG = """[bus]
link  = eth:wire0
cycle = 1ms
clock = none
[slave 0 x]
vendor  = 0x00ffffff
device  = cia402
outputs = 6040 607A
inputs  = 6041 6064
"""
NETLIST = """loadrt threads name1=bus period1=1000000
loadrt ethercat names=machine config=machine.ethercat
addf machine.receive bus
addf machine.transmit bus
start
"""
WITHOUT_RAW = ("setpriv", "--bounding-set=-net_raw", "--inh-caps=-net_raw")


def ip(*words):
    subprocess.run(["ip", *words], check=True, stdin=subprocess.DEVNULL, capture_output=True)


class EthercatLink(Case):
    def setUp(self):
        super().setUp()
        (self.folder / "machine.ethercat").write_text(CONFIG)
        (self.folder / "machine.hal").write_text(NETLIST)
        try:
            ip("link", "add", "wire0", "type", "veth", "peer", "name", "wire1")
        except (OSError, subprocess.CalledProcessError):
            self.skipTest("no virtual Ethernet here")
        self.addCleanup(ip, "link", "del", "wire0")
        ip("link", "set", "wire0", "up")

    def run_machine(self, *before, netlist="machine.hal"):
        return subprocess.Popen(
            [*before, HAL, "run", netlist],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def lines_until(self, machine, last):
        """The messages of the master up to one that contains some words; the machine is stopped then."""
        lines = []
        for line in machine.stdout:
            if line.startswith("machine:"):  # others are of the faults
                lines.append(line)
                if last in line:
                    break
        machine.terminate()
        machine.communicate(timeout=60)
        return lines

    def test_an_interface_without_carrier_is_reported_once_and_used_when_it_has_one(self):
        machine = self.run_machine()
        first = machine.stdout.readline()
        while first and not first.startswith("machine:"):
            first = machine.stdout.readline()
        self.assertEqual(
            "machine: eth:wire0 has no link; check the cable to the first slave\n", first
        )
        ip("link", "set", "wire1", "up")
        self.assertEqual(
            [
                "machine: eth:wire0 has a link again\n",
                "machine: no slave answers on eth:wire0; check cable and supply of the first slave\n",
            ],
            self.lines_until(machine, "no slave answers"),
        )

    def test_a_missing_privilege_names_the_command_that_grants_it(self):
        if not shutil.which("setpriv"):
            self.skipTest("no setpriv here")
        machine = self.run_machine(*WITHOUT_RAW)
        text, _ = machine.communicate(timeout=60)
        self.assertEqual(1, machine.returncode, text)
        self.assertEqual(1, text.count("raw Ethernet needs the capability CAP_NET_RAW"), text)
        self.assertRegex(
            text,
            r"'machine' \(ethercat\) cannot start: .*raw Ethernet needs the capability CAP_NET_RAW; grant it with: .*--cap-add=NET_RAW in the command that starts this container.*; "
            r"to see the capabilities: hal doctor",
        )

    def test_an_unknown_interface_names_those_that_exist(self):
        (self.folder / "machine.ethercat").write_text(CONFIG.replace("wire0", "wire7"))
        text, _ = self.run_machine().communicate(timeout=60)
        self.assertRegex(
            text,
            r"'machine' \(ethercat\) cannot start: eth:wire7: no interface 'wire7'; interfaces are .*wire0",
        )

    def test_functions_in_different_threads_send_nothing(self):
        (self.folder / "machine.ethercat").write_text(CONFIG.replace("eth:wire0", "sim:line"))
        (self.folder / "apart.hal").write_text(
            NETLIST.replace(
                "period1=1000000", "period1=1000000 name2=other period2=1000000"
            ).replace("machine.transmit bus", "machine.transmit other")
        )
        machine = self.run_machine(netlist="apart.hal")
        fault = next((line for line in machine.stdout if line.startswith("fault:")), "")
        machine.terminate()
        machine.communicate(timeout=60)
        self.assertRegex(
            fault,
            r"^fault: machine: 'machine.receive' and 'machine.transmit' are in different threads at cycle [\d ]+; nothing is sent; "
            r"type: delf machine.transmit THREAD, and add it to the thread of the other; see: show pin machine",
        )

    def test_two_masters_on_one_interface_name_each_other(self):
        ip("link", "set", "wire1", "up")
        (self.folder / "two.hal").write_text(
            NETLIST.replace(
                "names=machine config=machine.ethercat",
                "names=machine,other config=machine.ethercat,other.ethercat",
            ).replace("start", "addf other.receive bus\naddf other.transmit bus\nstart")
        )
        (self.folder / "other.ethercat").write_text(CONFIG.replace("wire0", "wire1"))
        lines = self.lines_until(self.run_machine(netlist="two.hal"), "another EtherCAT master")
        self.assertRegex(
            lines[-1],
            r"^machine: another EtherCAT master sends on eth:wire0 \(\d+ of its frames in a second\): stop it, or give each "
            r"master its own link$",
        )


if __name__ == "__main__":
    if not own_network():
        print("skipped: no network namespaces here")
        sys.exit(77)
    unittest.main()
