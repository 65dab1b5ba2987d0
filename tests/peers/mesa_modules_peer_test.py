#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: mesa linuxcnc
"""mesa_modules_peer_test.py HAL: LinuxCNC's compiled hm2_eth and our driver, one after the other, on the same emulated cards: both have the same pins and parameters, and
see the same index, probe, counts and three-phase PWM. HAL_RTMOD_DIR names the folder of the modules, if it is not that of the Debian package linuxcnc-uspace. 77: the
modules or network namespaces are missing.
"""

import re

from checks import check, wait_for
from mesa_machine import HAL, Machine, drive_machine, hm2_eth_netlist, native_netlist

MOTOR = """[motor x]
stepgen = 0
scale = 200
start = 2
index-every = 5
[switch touch]
motor = x
above = 9
terminal = gpio 18
"""
LATCH_CARD = (
    "[card]\ntype = 7i76e\nremotes = none\nstepgen-version = 0xC2\nencoder-version = 0x83\n" + MOTOR
)
BRIDGE_CARD = """[card]
type = 7i76e
remotes = none
3pwmgens = 2
[input overcurrent]
terminal = gpio 42
initial = yes
[output enable-not]
terminal = gpio 41
[output high-a]
terminal = gpio 35
[output low-a]
terminal = gpio 38
"""
MUXED_CARD = """[card]
type = 7i95
encoder-version = 0x84
[motor x]
stepgen = 0
scale = 200
encoder = 3
encoder-scale = 1000
index-every = 5
[input touch]
terminal = inmux 20
initial = yes
[output relay]
terminal = ssr 3
"""
DRIVERS = (("hm2_eth", hm2_eth_netlist), ("mesa", native_netlist))

# Ours alone; the page names them.
OURS = {"online", "fault", "positions-valid", "requests", "lost-requests", "lost-writes"}
OURS |= {"unexpected", "losses", "resets", "hold-cycles", "position-valid", "restarts", "online"}
# The version of Debian does not have these yet.
OURS |= {"no_clear_on_index", "position-interpolated"}
# Of hm2_eth alone: table-driven steps are not supported, times are those of functions of the runtime, and `0.debug` is a count of the discovery.
THEIRS = re.compile(r"(time|tmax|tmax-increased|table-data-\d|^\d\.debug)$")
# Parameters of outputs, which hm2_eth shows by one of their two names, cut off where that is too long.
DRIVERS_OF_PINS = re.compile(r"\.(invert_output|is_opendrain|invert|is_ope)$")
# hm2_eth keeps the pins of a smart-serial port with all channels off.
SERIAL_PINS = {"hm2_7i76e.0": range(10, 14), "hm2_7i95.0": range(35, 41)}
TYPES = ("s32", "u32", "bit", "float")


class Machines(Machine):
    def names(self, card):
        """Type and initial value of all pins and parameters of the card, without its prefix."""
        found = {}
        for kind in ("pin", "param"):
            shown = self.run(HAL, "shell", "-s", "show", kind, card).stdout
            for line in shown.splitlines():
                words = line.split()
                named = [word for word in words if word.startswith(card + ".")]
                if not named:
                    continue
                at = words.index(named[0])
                types = [word for word in words[:at] if word in TYPES]
                found[named[0].removeprefix(card + ".")] = types[0] if types else "?"
        return found

    def get_number(self, pin):
        return float(self.get(pin) or "nan")

    def wait_cycles(self, card, cycles):
        """Waits for cycles of our driver."""
        end = self.get_number(f"{card}.requests") + cycles
        wait_for(lambda: self.get_number(f"{card}.requests") > end, 20)


def is_excepted(card, name, serial_is_off):
    words = name.split(".")
    is_serial = words[0] == "gpio" and int(words[1]) in SERIAL_PINS[card]
    is_ours = words[-1] in OURS or (is_serial and serial_is_off)
    return is_ours or THEIRS.search(name) or DRIVERS_OF_PINS.search(name)


def compare_names(card, seen, serial_is_off):
    theirs, ours = seen["hm2_eth"], seen["mesa"]
    check(f"{card}: hm2_eth has pins", len(theirs) > 100, len(theirs))
    missing = [n for n in theirs if n not in ours and not is_excepted(card, n, serial_is_off)]
    check(f"{card}: every pin and parameter of hm2_eth exists", not missing, missing[:20])
    more = [n for n in ours if n not in theirs and not is_excepted(card, n, serial_is_off)]
    check(f"{card}: there are no others", not more, more[:20])
    other = [(n, theirs[n], ours[n]) for n in theirs if n in ours and theirs[n] != ours[n]]
    check(f"{card}: they have the same types", not other, other[:20])


def with_both(machine, text, prefix, config, use):
    """Calls use(driver) with each driver, on a card that has just got its power. Returns what it returns, by driver."""
    seen = {}
    names = {}
    for driver, netlist in DRIVERS:
        card = machine.start_card(text)
        run = machine.load(netlist(prefix, config))
        if run is None:
            return seen
        names[driver] = machine.names(prefix)
        seen[driver] = use(driver)
        machine.stop(run)
        machine.stop(card)
    compare_names(prefix, names, config.endswith("xxxxxxxx"))
    return seen


def move(machine, step, velocity):
    settings = (
        ("position-scale", 200),
        ("steplen", 5000),
        ("stepspace", 5000),
        ("dirsetup", 5000),
        ("dirhold", 5000),
        ("maxaccel", 1000),
        ("control-type", 1),
        ("velocity-cmd", velocity),
        ("enable", 1),
    )
    for name, value in settings:
        machine.set(f"{step}.{name}", value)


def latch(machine):
    card = "hm2_7i76e.0"
    step = f"{card}.stepgen.00"

    def use(driver):
        at = {}
        machine.set(f"{step}.index-invert", 1)
        machine.set(f"{step}.index-enable", 1)
        move(machine, step, 4)
        passed = wait_for(lambda: machine.get(f"{step}.index-enable") == "FALSE", 20)
        check(f"{driver}: the index is found", passed)
        at["index"] = machine.get_number(f"{step}.position-latch")
        machine.set(f"{step}.probe-invert", 1)
        machine.set(f"{step}.probe-enable", 1)
        passed = wait_for(lambda: machine.get(f"{step}.probe-enable") == "FALSE", 20)
        check(f"{driver}: the probe is found", passed)
        at["probe"] = machine.get_number(f"{step}.position-latch")
        return at

    config = "num_stepgens=2 num_encoders=1 sserial_port_0=xxxxxxxx"
    seen = with_both(machine, LATCH_CARD, card, config, use)
    for driver, at in seen.items():
        # the step on which the switch closes is the one above 9, from the index at 5
        check(f"{driver}: the index is 3 from the start", abs(at["index"] - 3) < 0.001, at)
        check(f"{driver}: the probe is 4 from the index", abs(at["probe"] - 4.005) < 0.001, at)


def bridge(machine):
    card = "hm2_7i76e.0"
    unit = f"{card}.3pwmgen.00"

    def shows(*texts):
        last = machine.log("card.log").splitlines()[-1]
        return all(text in last for text in texts)

    def use(driver):
        machine.set(f"{unit}.A-value", 0.5)
        machine.set(f"{unit}.enable", 1)
        on = ("enable-not off", "high-a on", "low-a off")
        check(f"{driver}: the bridge is on", wait_for(lambda: shows(*on), 20))
        machine.set(f"{unit}.A-value", -0.5)
        on = ("enable-not off", "high-a off", "low-a on")
        check(f"{driver}: the other gate is on", wait_for(lambda: shows(*on), 20))
        machine.set(f"{unit}.fault-invert", 1)
        tripped = wait_for(lambda: machine.get(f"{unit}.fault") == "TRUE", 20)
        check(f"{driver}: the fault input switches it off", tripped)
        machine.set(f"{unit}.fault-invert", 0)
        if driver == "mesa":
            machine.wait_cycles(card, 50)
            check("mesa: it stays off when the fault is over", shows("enable-not on"))
            machine.set(f"{unit}.enable", 0)
            machine.wait_cycles(card, 2)
            machine.set(f"{unit}.enable", 1)
        check(f"{driver}: it is on again", wait_for(lambda: shows("enable-not off"), 20))

    config = "num_stepgens=0 num_3pwmgens=1 sserial_port_0=xxxxxxxx"
    with_both(machine, BRIDGE_CARD, card, config, use)


def muxed(machine):
    card = "hm2_7i95.0"
    counter = f"{card}.encoder.03"

    def use(driver):
        at = {}
        machine.set(f"{counter}.scale", 1000)
        at["skew"] = machine.get(f"{card}.encoder.muxed-skew")
        at["other"] = machine.get(f"{card}.encoder.02.count")
        at["input"] = machine.get(f"{card}.inmux.00.input-20")
        at["width"] = machine.get(f"{card}.inmux.00.scan_width")
        machine.set(f"{card}.ssr.00.out-03", 1)
        relay = wait_for(lambda: "relay on" in machine.log("card.log").splitlines()[-1], 20)
        check(f"{driver}: the relay is on", relay)
        machine.set(f"{counter}.index-enable", 1)
        move(machine, f"{card}.stepgen.00", 4)
        turns = wait_for(lambda: abs(machine.get_number(f"{counter}.velocity") - 4) < 0.05, 20)
        check(f"{driver}: the velocity is 4", turns, machine.get(f"{counter}.velocity"))
        passed = wait_for(lambda: machine.get(f"{counter}.index-enable") == "FALSE", 20)
        check(f"{driver}: the index is found", passed)
        machine.set(f"{card}.stepgen.00.velocity-cmd", 0)
        stands = wait_for(lambda: machine.get(f"{counter}.velocity") == "0", 20)
        check(f"{driver}: it stands", stands)
        raw = machine.get_number(f"{counter}.rawcounts")
        at["zero"] = raw - machine.get_number(f"{counter}.count")
        return at

    seen = with_both(
        machine, MUXED_CARD, card, "num_encoders=4 num_stepgens=1 sserial_port_0=xxxxxxxx", use
    )
    for driver, at in seen.items():
        check(f"{driver}: the index is at 5000 counts", at["zero"] == 5000, at)
    if len(seen) == 2:
        check("both see the same", seen["hm2_eth"] == seen["mesa"], seen)


def serial(machine):
    """Channels without a device are GPIO, those of a port without any as well."""
    for remotes in ("none", "0"):
        text = f"[card]\ntype = 7i76e\nremotes = {remotes}\n"
        with_both(machine, text, "hm2_7i76e.0", "sserial_port_0=00xxxxxx", lambda driver: None)


drive_machine(Machines, serial, latch, bridge, muxed)
