#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""halfiles/yair in two processes over udp: the robot and its PC."""
import unittest

from harness import ROOT, Case, wait_until
from own_network import own_network

YAIR = ROOT / "halfiles/yair"


class TwoProcesses(Case):
    def machine(self, name):
        self.start("run", "-i", "udp.ini", YAIR / f"{name}-alone.hal", "--name", name, instance=name, loaded=False)
        wait_until(lambda: self.value("node.threadbeat", name) not in ("", "0"), f"the {name} runs")

    def test_drives_stops_on_an_alarm_and_without_its_pc(self):
        self.write("udp.ini", "[PC]\nLINK = udp:239.74.163.7%lo:43217\n")
        self.machine("robot")
        self.machine("pc")
        wait_until(lambda: self.value("pc-position.valid", "pc") == "TRUE", "positions arrive")
        self.shell("setp", "estop.reset", "TRUE", instance="pc")
        wait_until(lambda: float(self.value("body.y", "robot")) > 0.8, "the robot drives")
        self.shell("sets", "emergency", "TRUE", instance="robot")
        wait_until(lambda: self.value("estop.ok-out", "pc") == "FALSE", "the PC takes the alarm")
        wait_until(lambda: abs(float(self.value("wheel-a.speed", "robot"))) < 0.02, "the robot rests")


if __name__ == "__main__":
    own_network()
    unittest.main()
