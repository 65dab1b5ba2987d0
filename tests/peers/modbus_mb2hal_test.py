#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: modbus linuxcnc
"""modbus_mb2hal_test.py HAL: LinuxCNC's compiled mb2hal (with libmodbus), unmodified, and our program of this name read the same file and exchange it
with the same emulated slaves: on a pseudo terminal and on TCP. Pins, types, directions and values must be equal. MB2HAL names LinuxCNC's program, if it is
not that of the Debian package linuxcnc-uspace. 77: it is missing.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked, skip, wait_for

HAL = str(Path(sys.argv[1]).resolve())
THEIRS = Path(os.environ.get("MB2HAL", "/usr/bin/mb2hal"))
PORT = 21000 + os.getpid() % 20000
SLAVES = """[bus]
link = sim:unused
baud = 38400
[slave 1 drive]
read status = holding 0x100
read more = holding 0x101
read level = input 7
read ready = discrete 4
read alarm = discrete 5
write command = holding 0x200
write speed = holding 0x201
write torque = holding 0x202
write lamp = coil 16
write pump = coil 17
write light = coil 18
"""
SETTINGS = ("drive.status=1234", "drive.more=65535", "drive.level=40000", "drive.alarm=1")
LINKS = {
    "pty:line": "LINK_TYPE=serial\nSERIAL_PORT=line\nSERIAL_BAUD=38400\nSERIAL_BITS=8\n"
    "SERIAL_PARITY=none\nSERIAL_STOP=2\n",
    f"listen:{PORT}": f"LINK_TYPE=tcp\nTCP_IP=127.0.0.1\nTCP_PORT={PORT}\n",
}
# function, first element, elements, name
TRANSACTIONS = (
    ("fnct_03_read_holding_registers", 0x100, "NELEMENTS=2", "state"),
    ("fnct_04_read_input_registers", 7, "PIN_NAMES=level", ""),
    ("fnct_02_read_discrete_inputs", 4, "PIN_NAMES=ready,alarm", "flags"),
    ("fnct_06_write_single_register", 0x200, "NELEMENTS=1", "command"),
    ("fnct_16_write_multiple_registers", 0x201, "PIN_NAMES=speed,torque", "set"),
    ("fnct_05_write_single_coil", 16, "NELEMENTS=1", ""),
    ("fnct_15_write_multiple_coils", 17, "NELEMENTS=2", "coils"),
    ("fnct_03_read_holding_registers", 0x200, "NELEMENTS=3", "back"),
    ("fnct_01_read_coils", 16, "NELEMENTS=3", "lit"),
)
INPUTS = {
    "command.00.float": ("3.9", "-3.9", "70000", "65535.5"),
    "command.00.int": ("0", "4", "-1", "100000"),
    "set.speed.int": ("1000", "65535", "7", "0"),
    "set.torque.float": ("0.4", "65536", "-12.6", "70000"),
    "05.00.bit": ("TRUE", "FALSE", "TRUE", "FALSE"),
    "coils.01.bit": ("FALSE", "TRUE", "TRUE", "FALSE"),
}


# without VERSION = 1.1, mb2hal does not have the functions 01 and 05
OLD = [row for row in TRANSACTIONS if not row[0].startswith(("fnct_01", "fnct_05"))]


def ini(link, version):
    transactions = TRANSACTIONS if version else OLD
    text = "[MB2HAL_INIT]\nINIT_DEBUG=1\n"
    text += f"VERSION={version}\n" if version else ""
    text += f"SLOWDOWN=0.0\nTOTAL_TRANSACTIONS={len(transactions)}\n"
    for number, (function, first, elements, name) in enumerate(transactions):
        text += f"\n[TRANSACTION_{number:02}]\n{LINKS[link]}MB_SLAVE_ID=1\nFIRST_ELEMENT={first}\n"
        text += f"{elements}\nMB_TX_CODE={function}\nMB_RESPONSE_TIMEOUT_MS=500\n"
        text += "MB_BYTE_TIMEOUT_MS=500\nMAX_UPDATE_RATE=0.0\nDEBUG=1\n"
        text += f"HAL_TX_NAME={name}\n" if name else ""
    return text


class Machine:
    """The slaves, and a machine with one of the two programs."""

    def __init__(self, folder, link, program):
        self.folder = folder
        self.environment = os.environ | {"XDG_RUNTIME_DIR": str(folder), "HOME": str(folder)}
        settings = [word for setting in SETTINGS for word in ("--set", setting)]
        self.running = [self.start("node", "modbus", "slaves.modbus", "--link", link, *settings)]
        wait_for(lambda: "1 slave on" in (folder / "node.log").read_text())
        (folder / "a.hal").write_text(
            "loadrt threads name1=servo period1=1000000\n"
            f"loadusr -W {program} config=a.ini\nstart\n"
        )
        self.running.append(self.start("run", "a.hal"))

    def start(self, *words):
        with open(self.folder / f"{words[0]}.log", "w") as log:
            return subprocess.Popen(
                [HAL, *words],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def shell(self, *words):
        done = subprocess.run(
            [HAL, "shell", *words], capture_output=True, text=True, env=self.environment
        )
        return done.stdout.strip()

    def pins(self):
        """Name: type and direction."""
        listed = self.shell("--json", "show", "pin", "mb2hal.")
        return {one["name"]: (one["type"], one["dir"]) for one in json.loads(listed or "[]")}

    def value(self, name):
        return self.shell("getp", name)

    def end(self):
        for process in reversed(self.running):
            process.terminate()
            process.wait()


def exchanged(machine, step):
    """The values of all pins that are read, after inputs were set."""
    for name, values in INPUTS.items():
        machine.shell("setp", f"mb2hal.{name}", values[step])
    # a marker, behind which all values are new: the torque is read as the last of all registers
    read = [name for name, (_, direction) in machine.pins().items() if direction == "OUT"]
    last = {}

    def is_steady():
        nonlocal last
        before = last
        last = {name: machine.value(name) for name in read if "num_errors" not in name}
        return before == last

    wait_for(lambda: machine.value("mb2hal.back.01.int") == INPUTS["set.speed.int"][step])
    wait_for(is_steady)
    return last


def compare(link, version):
    seen = []
    for program in ("mb2hal", str(THEIRS)):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "slaves.modbus").write_text(SLAVES)
            (folder / "a.ini").write_text(ini(link, version))
            machine = Machine(folder, link, program)
            try:
                wait_for(lambda: machine.value("mb2hal.state.01.float") == "65535", 20)
                values = [exchanged(machine, step) for step in range(4)] if version else []
                seen.append((machine.pins(), values))
            finally:
                machine.end()
    what = f"{link.split(':')[0]}, version {version or '1.0'}"
    ours, theirs = seen
    check(f"{what}: {len(theirs[0])} pins", ours[0] == theirs[0] != {}, ours[0], theirs[0])
    for step, (one, other) in enumerate(zip(ours[1], theirs[1])):
        differs = {
            name: (one.get(name), other[name]) for name in other if one.get(name) != other[name]
        }
        check(f"{what}: {len(other)} values, step {step}", not differs and other, differs)


def main():
    if not THEIRS.exists() or THEIRS.resolve().name == "hal":
        skip("LinuxCNC's mb2hal is missing; type: apt-get install linuxcnc-uspace")
    for link in LINKS:
        for version in ("1.1", ""):
            compare(link, version)
    return checked()


if __name__ == "__main__":
    sys.exit(main())
