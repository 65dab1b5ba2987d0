#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: mesa linuxcnc
"""mesa_hm2_eth_test.py HAL: LinuxCNC's compiled hm2_eth, unmodified, drives our emulated 7I76E over a veth pair: it finds the smart-serial device, three
axes home on their switches and run a program, the spindle turns. The steps of each motor must be those that the driver counts. HAL_RTMOD_DIR names the
folder of the modules, if it is not that of the Debian package linuxcnc-uspace. 77: the modules or network namespaces are missing.
"""

import re

from checks import check, wait_for
from mesa_machine import Machine, drive_machine, hm2_eth_netlist

SCALE = 100
AXES = ("x", "y", "z")
CARD = "[card]\ntype = 7i76e\n" + "".join(f"""[motor {axis}]
stepgen = {n}
scale = {SCALE}
start = {3 + n}
min = -5
[switch {axis}-home]
motor = {axis}
below = 0
terminal = remote 0 {n}
""" for n, axis in enumerate(AXES))
CARD += """[spindle main]
drive = remote 0
max-speed = 24000
encoder = 0
[output coolant]
terminal = remote 0 3
"""
CARD_NAME = "hm2_7i76e.0"
SETTINGS = f"""setp {CARD_NAME}.encoder.00.scale 4096
setp {CARD_NAME}.7i76.0.0.spinout-scalemax 24000
setp {CARD_NAME}.7i76.0.0.spinout-maxlim 24000
setp {CARD_NAME}.7i76.0.0.spinout 24000
setp {CARD_NAME}.7i76.0.0.spinena TRUE
setp {CARD_NAME}.7i76.0.0.output-03 TRUE
"""
for n, axis in enumerate(AXES):
    SETTINGS += f"net {axis}-command {axis}.out => hm2_7i76e.0.stepgen.{n:02}.position-cmd\n"
    for name, value in (
        ("position-scale", SCALE),
        ("steplen", 5000),
        ("stepspace", 5000),
        ("dirsetup", 5000),
        ("dirhold", 5000),
        ("maxvel", 60),
        ("maxaccel", 600),
        ("control-type", "TRUE"),
        ("velocity-cmd", -10),
        ("enable", "TRUE"),
    ):
        SETTINGS += f"setp hm2_7i76e.0.stepgen.{n:02}.{name} {value}\n"
    SETTINGS += f"setp {axis}.maxv 30\nsetp {axis}.maxa 300\n"
NETLIST = hm2_eth_netlist(
    CARD_NAME,
    "num_encoders=1 num_stepgens=3 sserial_port_0=00xxxxxx",
    "loadrt limit3 names=x,y,z\n" + "\n".join(f"addf {axis} servo" for axis in AXES),
    SETTINGS,
)
PROGRAM = ((10, 5, -2), (10, 15, -4), (-1.37, 15, 0.01), (0, 0, 0))


class Mill(Machine):
    def card_get(self, pin):
        return self.get(f"hm2_7i76e.0.{pin}")

    def counts(self):
        return [int(self.card_get(f"stepgen.{n:02}.counts")) for n in range(len(AXES))]

    def steps(self):
        """What the card prints of its motors."""
        last = self.log("card.log").splitlines()[-1]
        at = {name: float(value) for name, value in re.findall(r"([xyz]) (-?[\d.]+)", last)}
        return [round(at[axis] * SCALE) for axis in AXES]

    def standing(self):
        """(counts, steps) when nothing has moved for some time."""
        seen = []

        def stands():
            seen.append((self.counts(), self.steps()))
            return len(seen) >= 4 and seen[-4:] == [seen[-1]] * 4

        check("the axes stand", wait_for(stands, 60), seen[-4:])
        return seen[-1]

    def home(self, n, axis):
        step = f"hm2_7i76e.0.stepgen.{n:02}"
        closes = wait_for(lambda: self.card_get(f"7i76.0.0.input-0{n}") == "TRUE", 60)
        check(f"{axis} reaches its switch", closes, self.log("card.log")[-300:])
        self.set(f"{step}.velocity-cmd", 0)

    def follow(self, n, axis):
        """Position mode, from where the axis stands."""
        step = f"hm2_7i76e.0.stepgen.{n:02}"
        position = self.get(f"{step}.position-fb")
        self.set(f"{axis}.in", position)
        self.set(f"{axis}.load", "TRUE")
        self.set(f"{axis}.load", "FALSE")
        self.set(f"{step}.control-type", "FALSE")
        return float(position)


def drive(machine):
    machine.start_card(CARD)
    run = machine.load(NETLIST)
    if run is None:
        return
    check("hm2_eth finds the device", "hm2_7i76e.0.7i76.0.0" in machine.log("hal.log"))
    for n, axis in enumerate(AXES):
        machine.home(n, axis)
    counts_home, steps_home = machine.standing()
    check("home is at the switches", all(-200 < at < 0 for at in steps_home), steps_home)
    zero = [machine.follow(n, axis) for n, axis in enumerate(AXES)]
    for targets in PROGRAM:
        for axis, target, offset in zip(AXES, targets, zero):
            machine.set(f"{axis}.in", target + offset)
        counts, steps = machine.standing()
        moved = [now - before for now, before in zip(steps, steps_home)]
        counted = [now - before for now, before in zip(counts, counts_home)]
        check(
            f"at {targets}: steps of the motors are those counted", moved == counted, moved, counted
        )
        wanted = [target * SCALE for target in targets]
        near = all(abs(a - b) <= 1 for a, b in zip(moved, wanted))
        check(f"at {targets}: the axes are there", near, moved, wanted)
    rpm = float(machine.card_get("encoder.00.velocity-rpm"))
    check("the spindle turns", abs(rpm - 24000) < 100, rpm)
    last = machine.log("card.log").splitlines()[-1]
    check("coolant is on", "coolant on" in last, last)
    check("no watchdog has bitten", "watchdog has bitten" not in machine.log("card.log"))
    run.terminate()
    run.wait(60)
    wait_for(lambda: "watchdog has bitten" in machine.log("card.log"), 10)
    check("the end of hm2_eth bites", "watchdog has bitten" in machine.log("card.log"))


drive_machine(Mill, drive)
