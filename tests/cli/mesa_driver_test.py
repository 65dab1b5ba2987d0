# SPDX-License-Identifier: MIT
# packages: mesa
"""The driver of Mesa cards against hal node mesa on the loopback interface: an ordinary user, real time, a card that stops and returns."""

import signal
import subprocess
import sys
import unittest

from harness import TIMEOUT, Case, free_port, wait_until
from mesa_node import MesaNode
from own_network import own_network

CARD = """[card]
type = 7i92
address = sim:card
remotes = none
[motor x]
stepgen = 0
scale = 200
encoder = 0
encoder-scale = 1000
[output lamp]
terminal = gpio 20
"""

NETLIST = """loadrt threads name1=servo period1=1000000
loadrt mesa board=eth:{host} config="num_stepgens=1 num_encoders=1 sserial_port_0=xxxxxxxx"
addf hm2_7i92.0.read servo
addf hm2_7i92.0.write servo
setp hm2_7i92.0.hold-cycles 200
setp hm2_7i92.0.watchdog.timeout_ns 1000000000
setp hm2_7i92.0.stepgen.00.position-scale 200
setp hm2_7i92.0.stepgen.00.steplen 2500
setp hm2_7i92.0.stepgen.00.stepspace 2500
setp hm2_7i92.0.stepgen.00.dirsetup 1000
setp hm2_7i92.0.stepgen.00.dirhold 1000
setp hm2_7i92.0.stepgen.00.maxaccel 1000
setp hm2_7i92.0.stepgen.00.enable TRUE
setp hm2_7i92.0.encoder.00.scale 1000
setp hm2_7i92.0.gpio.020.is_output TRUE
start
"""


class MesaDriver(MesaNode, Case):
    def setUp(self):
        super().setUp()
        self.write("card.mesa", CARD)
        self.host = f"127.0.0.1:{free_port()}"
        self.netlist = self.write("m.hal", NETLIST.format(host=self.host))

    def move(self, position):
        self.say("setp", "hm2_7i92.0.stepgen.00.position-cmd", position)
        there = float(position)
        pins = ("hm2_7i92.0.encoder.00.position", "hm2_7i92.0.stepgen.00.velocity-fb")

        def is_there():
            position, velocity = (float(self.value(pin)) for pin in pins)
            return abs(position - there) < 0.01 and abs(velocity) < 0.001

        wait_until(is_there, f"the axis stands at {position}")

    def test_a_card_that_stops_and_returns(self):
        node = self.node("--verbose")
        machine = self.start("run", self.netlist)
        self.comes("hm2_7i92.0.online", "TRUE")
        self.say("setp", "hm2_7i92.0.gpio.020.out", "TRUE")
        self.move("10")
        node.send_signal(signal.SIGSTOP)
        self.comes("hm2_7i92.0.online", "FALSE")
        node.send_signal(signal.SIGCONT)
        self.comes("hm2_7i92.0.online", "TRUE")
        # it stood, so nothing is lost, and it goes on
        self.move("0")
        self.end(machine)

    def test_a_card_that_is_replaced(self):
        node = self.node("--verbose")
        machine = self.start("run", self.netlist)
        self.comes("hm2_7i92.0.online", "TRUE")
        node.kill()
        node.wait(timeout=TIMEOUT)
        self.comes("hm2_7i92.0.online", "FALSE")
        self.node("--verbose")
        self.comes("hm2_7i92.0.online", "TRUE")
        self.assertEqual("1", self.value("hm2_7i92.0.resets"))
        self.move("5")
        self.end(machine)

    def test_a_card_has_one_master(self):
        self.node("--verbose")
        machine = self.start("run", self.netlist)
        self.comes("hm2_7i92.0.online", "TRUE")
        error = self.bad("run", "--name", "second", self.netlist)
        self.assertRegex(
            error,
            rf"eth:{self.host} \(7I92\): another program uses this card "
            r"\(\d+ requests in 20 ms\); stop it first: a card has one master",
        )
        self.assertEqual("TRUE", self.value("hm2_7i92.0.online"))
        self.end(machine)

    def test_no_card(self):
        error = self.bad("check", self.netlist)
        self.assertIn(
            f"eth:{self.host}: no answer from a card (3 requests, 20 ms each); check its power, "
            "its cable, its jumpers for the address; to look for cards: hal mesa scan",
            error,
        )

    def test_a_card_in_another_subnet(self):
        for command in (
            "ip link add lan0 type veth peer name lan1",
            "ip address add 192.168.7.5/24 dev lan0",
            "ip link set lan0 up",
            "ip link set lan1 up",
            "ip route add default via 192.168.7.1",
        ):
            subprocess.run(command.split(), check=True)
        self.addCleanup(subprocess.run, "ip link delete lan0".split(), check=True)
        error = self.bad("check", self.write("m.hal", "loadrt mesa board=eth:10.10.10.10\n"))
        self.assertIn(
            "eth:10.10.10.10: no answer from a card (3 requests, 20 ms each); 10.10.10.10 is in "
            "another subnet than 192.168.7.5/24 of lan0; give the interface of the card an address "
            "in the subnet of the card",
            error,
        )

    def test_outputs_are_off_when_the_machine_ends(self):
        self.node("--verbose")
        machine = self.start("run", self.netlist)
        self.comes("hm2_7i92.0.online", "TRUE")
        self.say("setp", "hm2_7i92.0.gpio.020.out", "TRUE")
        wait_until(lambda: self.log().rstrip().endswith("lamp on"), "the lamp is on")
        self.end(machine)
        wait_until(lambda: "watchdog has bitten" in self.log().rstrip().split("\n")[-1], "a bite")
        self.assertTrue(self.log().rstrip().endswith("lamp off"), self.log())


if __name__ == "__main__":
    if not own_network():
        print("no network namespaces: skipped")
        sys.exit(77)
    unittest.main()
