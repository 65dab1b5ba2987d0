#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_terminals_test.py [--master NAME] [--devices A,B] [--all] [--together] HAL [FOLDER]: the masters of others (pysoem, kickcat, ethercrab)
bring emulated terminals to OP, each terminal alone and all in one line. Without FOLDER these are 20 devices of our own; with a folder of device
descriptions (ESI) the terminals of TERMINALS, or those of --devices, or all. Prints each terminal that does not reach OP, and the counts. 77: a
package, cargo or network namespaces are missing."""
import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cli"))
import ethercat_line  # noqa: E402
import esi_corpus  # noqa: E402
import ethercrab_program  # noqa: E402
import peers  # noqa: E402

BUILT_IN = """coupler
digital_in bits=1
digital_in bits=4
digital_in bits=8
digital_in bits=16
digital_in bits=64
digital_out bits=1
digital_out bits=4
digital_out bits=8
digital_out bits=16
digital_out bits=64
analog_in channels=1
analog_in channels=4
analog_in channels=8
analog_out channels=2
analog_out channels=8
mailbox_device
servo
servo axes=2
servo axes=4"""
TERMINALS = (
    "EK1100 EL1008 EL1018 EL1252 EL1809 EL1904 EL2008 EL2809 EL2872 EL3152 "
    "EL4132 EL5101 EL6001 EJ2521-0224 EJ3104 EJ3202 EPP3314-0002 EJ4002 EJ7047 AX5103-0000-0210"
).split()
STATE_NAMES = {1: "INIT", 2: "PRE-OP", 4: "SAFE-OP", 8: "OP"}
LIMIT_S = 20.0
ATTEMPTS = 3  # these masters wait for milliseconds, which a busy machine does not keep


def until(condition):
    """Calls `condition` until it is true, or for LIMIT_S."""
    end = time.monotonic() + LIMIT_S
    while not condition() and time.monotonic() < end:
        time.sleep(0.001)


def with_pysoem(interface):
    (pysoem,) = peers.package("pysoem")
    master = pysoem.Master()
    master.open(interface)
    try:
        found = master.config_init()
        if found <= 0:
            raise RuntimeError(f"config_init returns {found}")
        try:
            master.config_map()
        except pysoem.ConfigMapError:
            pass  # it also reports each of 8 drives that a slave with SoE does not have
        master.state_check(pysoem.SAFEOP_STATE, 5_000_000)
        master.send_processdata()
        master.receive_processdata(20_000)
        master.state = pysoem.OP_STATE
        master.write_state()

        def operational():
            master.send_processdata()
            master.receive_processdata(20_000)
            return master.state_check(pysoem.OP_STATE, 2_000) == pysoem.OP_STATE

        until(operational)
        master.read_state()
        return [(slave.state == pysoem.OP_STATE, hex(slave.al_status)) for slave in master.slaves]
    finally:
        master.close()


def with_kickcat(interface):
    (kickcat,) = peers.package("kickcat")
    link = kickcat.create_link(interface, "")
    link.set_timeout(0.02)
    bus = kickcat.Bus(link)
    for attempt in range(5):  # it waits for an EEPROM for 2 ms, which a busy machine does not keep
        try:
            bus.init(5.0)
            break
        except RuntimeError:
            if attempt == 4:
                raise
    bus.create_mapping()
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, LIMIT_S)
    for slave in bus.slaves():
        slave.set_output_bytes(bytes(slave.output_size))
    bus.process_data()
    bus.request_state(kickcat.State.OPERATIONAL)
    bus.wait_for_state(kickcat.State.OPERATIONAL, LIMIT_S, bus.process_data)
    states = [bus.get_state(slave) for slave in bus.slaves()]
    return [(state == kickcat.State.OPERATIONAL, str(state)) for state in states]


def with_ethercrab(interface):
    done = subprocess.run(
        [ethercrab_program.build(), interface, "to-op"], capture_output=True, text=True, timeout=60
    )
    if done.returncode != 0:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no message"])[-1])
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    return [(state == "Op", code) for state, code, _ in rows]


MASTERS = {"pysoem": with_pysoem, "kickcat": with_kickcat, "ethercrab": with_ethercrab}


def reason_not_in_op(master, line, slaves):
    """Why one of so many slaves is not in OP, after ATTEMPTS; None: all are."""
    for _ in range(ATTEMPTS):
        reason = attempt(master, line, slaves)
        if reason is None:
            break
    return reason


def attempt(master, line, slaves):
    """The same for one attempt. The master runs in a process of its own, which may end early."""
    try:
        with ethercat_line.line(HAL, line + "\n"):
            done = subprocess.run(
                [sys.executable, __file__, "--child", master, HAL],
                capture_output=True,
                text=True,
                timeout=90,
            )
    except (AssertionError, subprocess.TimeoutExpired) as problem:
        return str(problem).strip().splitlines()[-1]
    if done.returncode != 0:
        words = (done.stdout + done.stderr).strip().splitlines() or ["no message"]
        return f"the master ended with {done.returncode}: {words[-1][:200]}"
    states = json.loads(done.stdout.splitlines()[-1])
    if len(states) != slaves:
        return f"{len(states)} of {slaves} slaves found"
    failed = [f"slave {n} ({code})" for n, (good, code) in enumerate(states) if not good]
    return "not in OP: " + ", ".join(failed) if failed else None


def quoted(text):
    return "'" + str(text).replace("'", "''") + "'"


def described(folder, wanted):
    """The lines of the terminals of a folder of ESI files, and those without a description."""
    known = {}
    for path in sorted(folder.rglob("*.[xX][mM][lL]")):
        for selector in esi_corpus.devices_of(path):
            known.setdefault(selector, path)
    order = [name for name in known if not wanted or name in wanted]
    if wanted:
        order.sort(key=wanted.index)
    lines = [f"esi file={quoted(known[name])} device={quoted(name)}" for name in order]
    return lines, [name for name in wanted or () if name not in known]


def run(master, lines):
    """Returns how many of the lines, each alone, reach OP; and why those in one line do not."""
    good = 0
    alone = [] if options.together else lines
    for line in alone:
        reason = reason_not_in_op(master, line, 1)
        good += reason is None
        if reason is not None:
            print(f"{master}: {line.rsplit('device=', 1)[-1]}: {reason}", flush=True)
    together = reason_not_in_op(master, "\n".join(lines), len(lines))
    if alone:
        print(f"{master}: {good} of {len(alone)} terminals reach OP, each alone", flush=True)
    print(f"{master}: {len(lines)} terminals in one line: {together or 'OP'}", flush=True)
    return good == len(alone) and together is None


def main():
    lines, missing = BUILT_IN.splitlines(), []
    if options.folder:
        wanted = None if options.all else options.devices or TERMINALS
        lines, missing = described(options.folder.resolve(), wanted)
        if missing:
            print("no description of " + " ".join(missing))
        if not lines:
            sys.exit("no terminals")
    peers.package("pysoem", "kickcat")
    ethercrab_program.build()
    ethercat_line.network()
    results = [run(master, lines) for master in options.master or MASTERS]
    return 0 if all(results) and not missing else 1


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--master", action="append", choices=MASTERS)
parser.add_argument("--devices", type=lambda text: text.split(","), help="order codes")
parser.add_argument("--all", action="store_true", help="all terminals of the folder")
parser.add_argument("--together", action="store_true", help="only all terminals in one line")
parser.add_argument("--child", choices=MASTERS, help=argparse.SUPPRESS)
parser.add_argument("hal")
parser.add_argument("folder", type=Path, nargs="?")
options = parser.parse_args()
HAL = str(Path(options.hal).resolve())
if options.child:
    print(json.dumps(MASTERS[options.child]("m0")))
else:
    sys.exit(main())
