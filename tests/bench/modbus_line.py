# SPDX-License-Identifier: MIT
"""Measures how much of a Modbus line of 19 200 baud a master uses: modbus_line.py HAL [SECONDS]. Prints figures without limits.

The line is a pseudo terminal with a slave that is as slow as the line (tests/cli/modbus_drive.py). One register is read as often as the master
can, by the component `modbus`, LinuxCNC's mb2hal and pymodbus, in turn. The use is the share of the time in which there is a telegram, the time of
the slave to think, or a silence of 3.5 characters in front of a telegram; above 100 %: the master leaves out silences. LinuxCNC's mb2hal and
pymodbus are left out where they are not installed.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
from modbus_drive import SILENCE, Drive  # noqa: E402

BAUD = 19200
THINKING = 0.002
REQUEST, ANSWER = 8, 7  # characters
CHARACTER = 10 / BAUD
TELEGRAM = (2 * SILENCE + REQUEST + ANSWER) * CHARACTER + THINKING
HAL = str(Path(sys.argv[1]).resolve())
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 10.0
MB2HAL = "/usr/bin/mb2hal"

BUS = f"[bus]\nbaud = {BAUD}\n[slave 1 meter]\nread value = holding 0x2103 every 1ms\n"
MODBUS = """newthread servo 1000000
loadrt modbus config=bus.modbus link=serial:line
addf modbus.0.receive servo
addf modbus.0.transmit servo
start
"""
INI = f"""[MB2HAL_INIT]
INIT_DEBUG=1
VERSION=1.1
SLOWDOWN=0.0
TOTAL_TRANSACTIONS=1
[TRANSACTION_00]
LINK_TYPE=serial
SERIAL_PORT=line
SERIAL_BAUD={BAUD}
SERIAL_BITS=8
SERIAL_PARITY=none
SERIAL_STOP=1
SERIAL_DELAY_MS=0
MB_SLAVE_ID=1
FIRST_ELEMENT=8451
NELEMENTS=1
MB_TX_CODE=fnct_03_read_holding_registers
MB_RESPONSE_TIMEOUT_MS=500
MB_BYTE_TIMEOUT_MS=500
MAX_UPDATE_RATE=0.0
DEBUG=1
"""
LINUXCNC = f"newthread servo 1000000\nloadusr -W {MB2HAL} config=mb2hal.ini\nstart\n"
PYMODBUS = f"""from pymodbus.client import ModbusSerialClient
client = ModbusSerialClient("line", baudrate={BAUD})
client.connect()
while True:
    client.read_holding_registers(0x2103, count=1, device_id=1)
"""


class Meter(Drive):
    """Counts the requests that it answers."""

    def __init__(self, link):
        self.requests = 0
        super().__init__(link, BAUD, THINKING)

    def answer(self, frame):
        super().answer(frame)
        self.requests += 1


def rate(folder, *command):
    """Requests per second of a program, or nothing if it makes none."""
    drive = Meter(str(folder / "line"))
    environment = os.environ | {"XDG_RUNTIME_DIR": str(folder), "HOME": str(folder)}
    program = subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        limit = time.monotonic() + 20
        while drive.requests < 20 and time.monotonic() < limit and program.poll() is None:
            time.sleep(0.05)
        before, since = drive.requests, time.monotonic()
        time.sleep(SECONDS)
        count, passed = drive.requests - before, time.monotonic() - since
        return count / passed if count else None
    finally:
        program.terminate()
        program.wait(30)
        drive.close()


def main():
    python = os.environ.get("HALCYON_PYTHON", sys.executable)
    masters = {
        "modbus": (HAL, "run", "modbus.hal"),
        "mb2hal of LinuxCNC": (HAL, "run", "mb2hal.hal"),
        "pymodbus": (python, "client.py"),
    }
    files = {"bus.modbus": BUS, "modbus.hal": MODBUS, "mb2hal.ini": INI, "mb2hal.hal": LINUXCNC}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in (files | {"client.py": PYMODBUS}).items():
            (folder / file).write_text(text)
        for number in range(1, 4):
            for master, command in masters.items():
                measured = rate(folder, *command)
                figure = "no requests: is it installed?"
                if measured is not None:
                    figure = f"{measured:.1f} telegrams/s, use {100 * measured * TELEGRAM:.1f} %"
                print(f"run {number}: {master}: {figure}", flush=True)


main()
