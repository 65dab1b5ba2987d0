#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: scocan
"""halfiles/yair in two processes over udp: the robot and its PC."""
import signal
import unittest

from harness import ROOT, Case, wait_until
from own_network import own_network

YAIR = ROOT / "halfiles/yair"


class TwoProcesses(Case):
    def machine(self, name):
        started = self.start(
            "run",
            "-i",
            "udp.ini",
            YAIR / f"{name}-alone.hal",
            "--name",
            name,
            instance=name,
            loaded=False,
        )
        wait_until(lambda: self.value("node.threadbeat", name) not in ("", "0"), f"the {name} runs")
        return started

    def rests(self):
        return (
            abs(float(self.value("wheel-a.speed", "robot"))) < 0.02
            and abs(float(self.value("wheel-b.speed", "robot"))) < 0.02
        )

    def beats(self, cycles):
        """Waits for so many cycles of the PC."""
        last = int(self.value("control.threadbeat", "pc")) + cycles
        wait_until(
            lambda: int(self.value("control.threadbeat", "pc")) > last,
            f"{cycles} cycles have passed",
        )

    def drives_after_a_reset(self):
        """Presses reset, for at least a cycle: the latch looks for a rising edge. On a busy host positions may come too late again."""
        for level in ("FALSE", "TRUE"):
            self.shell("setp", "estop.reset", level, instance="pc")
            self.beats(2)
        self.beats(50)
        return not self.rests()

    def test_drives_stops_on_an_alarm_and_without_its_pc(self):
        self.write("udp.ini", "[PC]\nLINK = udp:239.74.163.7%lo:43217\n")
        self.machine("robot")
        pc = self.machine("pc")
        wait_until(lambda: self.value("pc-position.valid", "pc") == "TRUE", "positions arrive")
        wait_until(
            lambda: self.drives_after_a_reset() and float(self.value("body.y", "robot")) > 0.8,
            "the robot drives",
        )
        self.shell("sets", "emergency", "TRUE", instance="robot")
        wait_until(lambda: self.value("estop.ok-out", "pc") == "FALSE", "the PC takes the alarm")
        wait_until(self.rests, "the robot rests")
        # the alarm is over; it drives again, by infrared and ultrasound
        self.shell("sets", "emergency", "FALSE", instance="robot")
        wait_until(
            lambda: self.value("pc-alarm.bits", "pc") in ("0", "0x00000000"),
            "the PC takes the end of the alarm",
        )
        wait_until(self.drives_after_a_reset, "the robot drives again")
        wait_until(
            lambda: int(self.value("sonar.bursts", "pc")) > 5,
            "ultrasonic bursts are complete behind the bridge",
        )
        # the PC is killed: no velocities, standstill; another one drives on
        self.end(pc, signal.SIGKILL)
        wait_until(self.rests, "the robot rests without its PC")
        self.machine("pc")
        wait_until(
            lambda: self.value("pc-position.valid", "pc") == "TRUE", "positions arrive again"
        )
        self.assertTrue(self.rests(), "it does not start by itself")
        wait_until(self.drives_after_a_reset, "the robot drives with the new PC")


if __name__ == "__main__":
    own_network()
    unittest.main()
