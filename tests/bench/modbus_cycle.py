# SPDX-License-Identifier: MIT
"""Measures what 20 slaves on Modbus TCP cost a cycle of 1 kHz: modbus_cycle.py HAL... [READINGS]. Prints figures without limits.

Each slave has two values that are read every 20 ms and a set-point. The emulated slaves are a process of their own. The figures are medians of
`receive.time` and `transmit.time`, each of which is that of one cycle. The measurement itself is in both: an `and2` beside them shows how much.
Several programs are measured in turn.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

READINGS = int(sys.argv.pop()) if sys.argv[-1].isdigit() else 300
SLAVES = 20
PORT = 15020
FUNCTIONS = ("modbus.0.receive", "modbus.0.transmit", "and2.0")

BUS = f"[bus]\nlink = tcp:127.0.0.1:{PORT}\nguardian = no\n" + "".join(
    f"[slave {n} s{n}]\nread a = holding 0x10 u16 every 20ms\nread b = holding 0x11 s16 scale 0.1 every 20ms\n"
    f"write w = holding 0x20 s16 scale 0.1\n"
    for n in range(1, SLAVES + 1)
)
NETLIST = """newthread servo 1000000
loadrt modbus config=bus.modbus
addf modbus.0.receive servo
addf modbus.0.transmit servo
loadrt and2
addf and2.0 servo
start
"""


def shell(hal, environment, folder, given):
    done = subprocess.run(
        [hal, "shell"],
        cwd=folder,
        env=environment,
        input=given,
        capture_output=True,
        text=True,
    )
    return done.stdout.split()


def readings(hal):
    """The times of receive, transmit and and2 in some cycles, in ns."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"XDG_RUNTIME_DIR": folder, "HOME": folder}
        Path(folder, "bus.modbus").write_text(BUS)
        Path(folder, "machine.hal").write_text(NETLIST)
        silent = {
            "cwd": folder,
            "env": environment,
            "stdin": subprocess.DEVNULL,
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
        }
        nodes = subprocess.Popen([hal, "node", "modbus", "bus.modbus"], **silent)
        machine = subprocess.Popen([hal, "run", "machine.hal"], **silent)
        try:
            while shell(hal, environment, folder, "getp modbus.0.online\n") != ["TRUE"]:
                time.sleep(0.1)
            asked = "".join(f"getp {name}.time\n" for name in FUNCTIONS)
            rows = []
            while len(rows) < READINGS:
                values = [int(value) for value in shell(hal, environment, folder, asked * 10)]
                rows += zip(*(values[n :: len(FUNCTIONS)] for n in range(len(FUNCTIONS))))
                time.sleep(0.003)
            return rows
        finally:
            for process in (machine, nodes):
                process.terminate()
                process.wait(30)


def main():
    programs = [str(Path(name).resolve()) for name in sys.argv[1:]]
    for number in range(1, 6):
        for hal in programs:
            receive, transmit, empty = map(statistics.median, zip(*readings(hal)))
            print(
                f"run {number}: {hal}: receive {receive:.0f}, transmit {transmit:.0f}, and2 {empty:.0f} ns: "
                f"{SLAVES} slaves cost {receive + transmit - 2 * empty:.0f} ns",
                flush=True,
            )


main()
