#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_gateway_test.py HAL: the Python package pyetg1510, a client of mailbox gateways (ETG.8200), reads the dictionary of a running master
(ETG.1510) over UDP: the list of objects, the descriptions of objects and entries, and the values. 77: the package is missing."""
import asyncio
import ctypes
import logging
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import peers
from checks import check, checked

peers.package("pyetg1510")
from pyetg1510 import ETG1510Profile, EtherCATMasterConnection, MasterODSpecification  # noqa: E402
from pyetg1510.mailbox.mailbox_gateway import SDOMessage  # noqa: E402

SLAVE = """[slave {0} drive{0}]
vendor  = 0x00ffffff
device  = cia402
outputs = 6040 607A
inputs  = 6041 6064
"""
CONFIG = "[bus]\nlink = sim:line\ncycle = 1ms\ngateway = 127.0.0.1:{}\n"
NETLIST = """loadrt threads name1=bus period1=1000000
loadrt ethercat_segment devices="servo, servo" link=sim:line
loadrt ethercat config=two.ethercat
addf ethercat.0.receive bus
addf ethercat.0.transmit bus
addf ethercat-segment.0.update bus
start
"""
HAL = sys.argv[1]
LIMIT_S = 60
HEADER = (("Length", 11), ("Reserved", 1), ("DataType", 4))
COE_HEADER = (("Number", 9), ("Reserved", 3), ("Service", 4))


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class EthernetHeader(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint16, bits) for name, bits in HEADER]


class CoeHeader(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint16, bits) for name, bits in COE_HEADER]


def prepared(message, own=SDOMessage.__post_init__):
    """Two headers of the package are structures of bit fields of different types, which only a compiler of Microsoft places as meant; without these
    it sends zeros here."""
    own(message)
    message.ethercat_header, message.coe_header = EthernetHeader(), CoeHeader()


async def read_all(port):
    """What the client reads: its object dictionary, and the values of each object."""
    specification = MasterODSpecification(EtherCATMasterConnection("127.0.0.1", port))
    await specification.get_object_dictionary()
    values = {}
    async for index, data in ETG1510Profile(specification):
        values[index] = data.values
    return specification.sdo_data_entity.entries, values


def run(port):
    entries, values = asyncio.run(read_all(port))
    check(
        "objects",
        sorted(entries) == [0x1000, 0x1008, 0x1018, 0x8000, 0x8001, 0xF020],
        [hex(index) for index in entries],
    )
    for index, field, name in (
        (0x1008, "DeviceName", "Device name"),
        (0x8000, "FixedStationAddress", "Fixed station address"),
        (0x8001, "VendorId", "Vendor ID"),
    ):
        entry = getattr(entries[index], field, None)
        check(f"entry {name}", entry is not None and entry.enable and entry.name == name, entry)
    check("modular device", values[0x1000]["DeviceType"] == 5000, values[0x1000])
    check("device name", "Halcyon EtherCAT master" in values[0x1008].values(), values[0x1008])
    for slave in (0, 1):
        row = values[0x8000 + slave]
        check(f"slave {slave}: station", row["FixedStationAddress"] == 0x1001 + slave, row)
        check(f"slave {slave}: vendor", row["VendorId"] == 0x00FFFFFF, row)
        check(f"slave {slave}: product", row["ProductCode"] == 0x04020001, row)
    addresses = values[0xF020]
    check("number of slaves", addresses["NumberofSlaves"] == 2, addresses)
    check("addresses", addresses["ConfiguredAddress"][:2] == [0x1001, 0x1002], addresses)


def machine(folder, port):
    (folder / "two.ethercat").write_text(
        CONFIG.format(port) + "".join(SLAVE.format(n) for n in (0, 1))
    )
    (folder / "two.hal").write_text(NETLIST)
    log = folder / "log.txt"
    with open(log, "w", encoding="utf-8") as out:
        program = subprocess.Popen(
            [Path(HAL).resolve(), "run", "two.hal"],
            cwd=folder,
            env={**os.environ, "XDG_RUNTIME_DIR": str(folder)},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
        )
    end = time.monotonic() + LIMIT_S
    while (
        program.poll() is None
        and len(re.findall("is operational", log.read_text())) < 2
        and time.monotonic() < end
    ):
        time.sleep(0.05)
    if program.poll() is not None:
        sys.exit(log.read_text())
    return program, log


logging.disable(logging.CRITICAL)
SDOMessage.__post_init__ = prepared
with tempfile.TemporaryDirectory(prefix="hal-gateway-") as name:
    port = free_port()
    program, log = machine(Path(name), port)
    try:
        run(port)
        check("the machine runs", program.poll() is None, log.read_text())
    finally:
        program.terminate()
        program.wait(LIMIT_S)
sys.exit(checked())
