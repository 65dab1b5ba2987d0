#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_kickcat_test.py HAL: the Python package kickcat (KickCAT) is master of `hal node ethercat` over a veth pair: scan, SDO, mapping, process data
in OP. 77: the package or network namespaces are missing."""
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import ethercat_line  # noqa: E402
import peers  # noqa: E402
from checks import check, checked  # noqa: E402
from ethercat_line import wait_for  # noqa: E402

(kickcat,) = peers.package("kickcat")
HAL = sys.argv[1]


def initialise(bus, attempts=5):
    """KickCAT waits for a frame for 2 ms, which a busy machine does not keep."""
    for attempt in range(attempts):
        try:
            return bus.init(5.0)
        except RuntimeError:
            if attempt + 1 == attempts:
                raise


def run(log):
    link = kickcat.create_link("m0", "")
    link.set_timeout(0.1)
    bus = kickcat.Bus(link)
    initialise(bus)
    slaves = bus.slaves()
    check("three slaves", len(slaves) == 3, len(slaves))
    servo, outputs, inputs = slaves
    read = lambda index, sub, size: int.from_bytes(
        bus.read_sdo(servo, index, sub, kickcat.Access.PARTIAL, size, 2.0)[:size], "little"
    )
    check("vendor of 1018h", read(0x1018, 1, 4) == 0xFFFFFF, hex(read(0x1018, 1, 4)))
    check("supported modes", read(0x6502, 0, 4) == 0x3EF, hex(read(0x6502, 0, 4)))
    try:
        read(0x2FFF, 0, 4)
        check("an object that does not exist is an error", False)
    except Exception as problem:  # its own type is not exported
        check("an object that does not exist is an error", True, problem)
    bus.create_mapping()
    check(
        "sizes of the process data",
        [(s.input_size, s.output_size) for s in slaves] == [(13, 13), (0, 1), (1, 0)],
        [(s.input_size, s.output_size) for s in slaves],
    )
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, 10.0)
    check("SAFE-OP", all(bus.get_state(s) == kickcat.State.SAFE_OP for s in slaves))
    servo.set_output_bytes(bytes(13))
    outputs.set_output_bytes(b"\xa5")
    bus.process_data()
    bus.request_state(kickcat.State.OPERATIONAL)
    bus.wait_for_state(kickcat.State.OPERATIONAL, 10.0, bus.process_data)
    check("OP", all(bus.get_state(s) == kickcat.State.OPERATIONAL for s in slaves))

    def cycle():
        bus.process_data()
        time.sleep(0.001)
        return True

    check(
        "outputs arrive",
        wait_for(
            lambda: cycle() and "slave 1 (digital_out): outputs 10100101\n" in log.read_text()
        ),
        log.read_text(),
    )

    def statusword_is(control, bits):
        servo.set_output_bytes(
            control.to_bytes(2, "little")
            + b"\x09"
            + bytes(4)
            + (20_000).to_bytes(4, "little")
            + bytes(2)
        )
        cycle()
        return int.from_bytes(servo.input_data[:2], "little") & 0x6F == bits

    for name, control, status in (
        ("ready to switch on", 6, 0x21),
        ("switched on", 7, 0x23),
        ("operation enabled", 15, 0x27),
    ):
        check(name, wait_for(lambda: statusword_is(control, status)), servo.input_data.hex())
    position = lambda: int.from_bytes(servo.input_data[3:7], "little", signed=True)
    began = position()
    check(
        "the drive turns",
        wait_for(lambda: cycle() and position() - began > 1000),
        began,
        position(),
    )
    check("the line prints the state", "slave 0 (servo): OP" in log.read_text(), log.read_text())


ethercat_line.network()
with ethercat_line.line(HAL, "servo\ndigital_out bits=8\ndigital_in bits=8\n") as node:
    run(node.log)
sys.exit(checked())
