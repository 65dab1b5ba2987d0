#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: modbus
"""modbus_pymodbus_test.py HAL: the Python package pymodbus is the slave of our master and of `hal modbus`, and the master of `hal node modbus`, on
pseudo terminals (RTU) and on TCP. 77: the package is missing."""

import asyncio
import os
import pty
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import peers  # noqa: E402

(pymodbus,) = peers.package("pymodbus")
from pymodbus.client import ModbusSerialClient, ModbusTcpClient  # noqa: E402
from pymodbus.datastore import (
    ModbusDeviceContext,
    ModbusSequentialDataBlock,
    ModbusServerContext,
)  # noqa: E402
from pymodbus.framer import FramerType  # noqa: E402
from pymodbus.server import ModbusSerialServer, ModbusTcpServer  # noqa: E402

HAL = sys.argv[1]
FOLDER = Path(tempfile.mkdtemp(prefix="hal-modbus-"))
ENVIRONMENT = {**os.environ, "HOME": str(FOLDER), "XDG_STATE_HOME": str(FOLDER)}
checks = []


def check(name, holds, *seen):
    checks.append(bool(holds))
    print(
        f"{'ok  ' if holds else 'FAIL'} {name} {' '.join(map(str, seen)) if not holds else ''}",
        flush=True,
    )


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class NullModem:
    """Two pseudo terminals, and a thread that carries bytes between them."""

    def __init__(self):
        (self.a, slave_a), (self.b, slave_b) = pty.openpty(), pty.openpty()
        self.held = slave_a, slave_b  # their master ends read EIO while nobody has them
        for end in (self.a, self.b, slave_a, slave_b):
            tty.setraw(end)
        self.names = os.ttyname(slave_a), os.ttyname(slave_b)
        for source, sink in ((self.a, self.b), (self.b, self.a)):
            threading.Thread(target=self.carry, args=(source, sink), daemon=True).start()

    @staticmethod
    def carry(source, sink):
        while data := os.read(source, 512):
            os.write(sink, data)


def serve(make_server, context):
    """Runs a server of pymodbus in a thread."""

    async def run():
        await make_server(context).serve_forever()

    threading.Thread(target=lambda: asyncio.run(run()), daemon=True).start()


def device():
    """A slave with all tables: holding register n has the value n, and so on."""
    return ModbusDeviceContext(
        di=ModbusSequentialDataBlock(1, [n % 3 == 0 for n in range(100)]),
        co=ModbusSequentialDataBlock(1, [False] * 100),
        hr=ModbusSequentialDataBlock(1, list(range(200))),
        ir=ModbusSequentialDataBlock(1, [1000 + n for n in range(100)]),
    )


CONFIGURATION = """[bus]
baud = 115200
[slave 1 s]
every = 20ms
read a = holding 10
read b = holding 20 u32
read c = input 3
read d = discrete 6
read e = discrete 7
write x = holding 30
write y = holding 31 s32
write z = coil 5
stop = coil 5 0, holding 30 77
"""
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt modbus config={configuration} link={link}
addf modbus.0.receive servo
addf modbus.0.transmit servo
setp modbus.0.s.x 4711
setp modbus.0.s.y -70000
setp modbus.0.s.z TRUE
start
loadusr -w sleep 1.5
getp modbus.0.s.online
getp modbus.0.s.a
getp modbus.0.s.b
getp modbus.0.s.c
getp modbus.0.s.d
getp modbus.0.s.e
getp modbus.0.s.exceptions
getp modbus.0.s.errors
"""


def run(*words):
    return subprocess.run(
        [HAL, *words], env=ENVIRONMENT, cwd=FOLDER, capture_output=True, text=True, timeout=60
    )


def our_master(name, link):
    (FOLDER / f"{name}.modbus").write_text(CONFIGURATION)
    (FOLDER / f"{name}.hal").write_text(NETLIST.format(configuration=f"{name}.modbus", link=link))
    done = run("run", f"{name}.hal", "--for", "1s")
    values = done.stdout.split()[:8]
    wanted = ["TRUE", "10", str(20 << 16 | 21), "1003", "TRUE", "FALSE", "0", "0"]
    check(f"{name}: our master reads pymodbus's registers", values == wanted, values, done.stderr)
    address = link + ("?baud=115200" if name == "rtu" else "")
    written = read(address, "holding", "31", "2")
    check(f"{name}: writes a number of 32 bits", written == ["65534", "61072"], written)
    stopped = read(address, "holding", "30") + read(address, "coil", "5")
    check(f"{name}: stops at its end", stopped == ["77", "0"], stopped)


def read(link, *words):
    """The values that pymodbus has, as `hal modbus read` prints them."""
    lines = run("modbus", "read", link, "1", *words).stdout.splitlines()
    return [line.split()[2 if words[0] == "holding" else 1] for line in lines]


def by_hand(name, link):
    done = run("modbus", "read", link, "1", "holding", "10", "3")
    check(f"{name}: hal modbus read", done.stdout.split()[2::3] == ["10", "11", "12"], done)
    done = run("modbus", "write", link, "1", "holding", "40", "1", "2", "0xFFFF")
    check(f"{name}: hal modbus write", done.returncode == 0, done)
    done = run("modbus", "read", link, "1", "holding", "40", "3")
    check(f"{name}: reads it back", "0xFFFF" in done.stdout, done)
    done = run("modbus", "read", link, "1", "holding", "5000")
    check(
        f"{name}: an exception in words", "illegal data address (exception 2)" in done.stderr, done
    )


def our_slaves(name, link, make_client):
    (FOLDER / "node.modbus").write_text(
        "[bus]\n[slave 3 s]\nread a = holding 10\nread b = holding 12 f32\nread c = discrete 2\n"
        "write d = coil 4\nwrite e = holding 20\n"
    )
    words = ["node", "modbus", "node.modbus", "--link", link, "--set", "s.a=1234"]
    node = subprocess.Popen(
        [HAL, *words, "--set", "s.b=2.5", "--set", "s.c=1"], env=ENVIRONMENT, cwd=FOLDER
    )
    try:
        time.sleep(1)
        client = make_client()
        check(f"{name}: pymodbus connects", client.connect())
        words = client.read_holding_registers(10, count=4, device_id=3).registers
        value = client.convert_from_registers(words[2:], client.DATATYPE.FLOAT32)
        check(f"{name}: reads our registers", (words[0], value) == (1234, 2.5), words)
        bits = client.read_discrete_inputs(2, count=1, device_id=3).bits
        check(f"{name}: reads our bits", bits[0] is True, bits)
        client.write_coil(4, True, device_id=3)
        client.write_registers(20, [55], device_id=3)
        check(
            f"{name}: writes",
            client.read_coils(4, count=1, device_id=3).bits[0]
            and client.read_holding_registers(20, count=1, device_id=3).registers == [55],
        )
        wrong = client.read_holding_registers(900, count=1, device_id=3)
        check(f"{name}: gets an exception", wrong.isError() and wrong.exception_code == 2, wrong)
        client.close()
    finally:
        node.terminate()
        node.wait()


modem = NullModem()
rtu = ModbusServerContext(devices={1: device()}, single=False)
serve(
    lambda context: ModbusSerialServer(
        context, framer=FramerType.RTU, port=modem.names[0], baudrate=115200
    ),
    rtu,
)
tcp_port = free_port()
tcp = ModbusServerContext(devices={1: device()}, single=False)
serve(lambda context: ModbusTcpServer(context, address=("127.0.0.1", tcp_port)), tcp)
time.sleep(1)
our_master("rtu", f"serial:{modem.names[1]}")
our_master("tcp", f"tcp:127.0.0.1:{tcp_port}")
by_hand("rtu", f"serial:{modem.names[1]}?baud=115200")
by_hand("tcp", f"tcp:127.0.0.1:{tcp_port}")
terminal = str(FOLDER / "terminal")
our_slaves("rtu", f"pty:{terminal}", lambda: ModbusSerialClient(terminal, baudrate=19200))
port = free_port()
our_slaves("tcp", f"listen:{port}", lambda: ModbusTcpClient("127.0.0.1", port=port))
sys.exit(0 if all(checks) else 1)
