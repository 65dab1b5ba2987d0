#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI uModbus 1.0.4: a serial server (RTU) that has one slave answers requests to all other slaves, and broadcasts, with an exception.
#
# Its routes name slave 1 only. A request to slave 2 is answered in the name of slave 2 with exception 2 (illegal data address), and a
# broadcast (slave 0) with the same. The Modbus specification lets a slave answer only what is addressed to it, and a broadcast not at all.
# Consequence: on a line of several devices the answer of the real slave 2 collides with the exception, and the master reports an
# illegal address of a register that exists, or checksum errors.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check uModbus==1.0.4 pyserial==3.5 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import importlib.metadata
import os
import pty
import select
import threading
import tty

from serial import Serial
from umodbus.client.serial.redundancy_check import get_crc
from umodbus.server.serial import get_server
from umodbus.server.serial.rtu import RTUServer

line, device = pty.openpty()
tty.setraw(line)
tty.setraw(device)
server = get_server(RTUServer, Serial(os.ttyname(device), 19200, timeout=1))


@server.route(slave_ids=[1], function_codes=[3, 6], addresses=list(range(10)))
def register(slave_id, function_code, address, value=7):
    return value


threading.Thread(target=server.serve_forever, daemon=True).start()


def answer(slave, function):
    request = bytes([slave, function, 0, 5, 0, 1])
    os.write(line, request + get_crc(request))
    received = b""
    while select.select([line], [], [], 2)[0]:
        received += os.read(line, 256)
    return received[:-2].hex()


own, other, broadcast = answer(1, 3), answer(2, 3), answer(0, 6)
print("uModbus", importlib.metadata.version("uModbus"))
print("read 1 register of slave 1:", own)
print("read 1 register of slave 2:", other)
print("write a register of all slaves:", broadcast)
same = (own, other, broadcast) == ("0103020007", "028302", "008602")
os._exit(0 if same else 1)
PYTHON
