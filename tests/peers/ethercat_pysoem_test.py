#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_pysoem_test.py HAL: the Python package pysoem (SOEM) is master of `hal node ethercat` over a veth pair: scan, SDO, FoE, other PDOs,
distributed clocks, process data in OP, and what the slaves do when it stops. 77: the package or network namespaces are missing."""
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
import ethercat_line  # noqa: E402
import peers  # noqa: E402
from checks import check, checked  # noqa: E402
from ethercat_line import wait_for  # noqa: E402

(pysoem,) = peers.package("pysoem")
HAL = sys.argv[1]


def abort_code(transfer):
    """The abort code with which a transfer is rejected; 0: it is not."""
    try:
        transfer()
    except pysoem.SdoError as rejected:
        return rejected.abort_code
    return 0


def map_servo(_):
    """Other entries than those of the device, as a configuration function of SOEM: on the way from PRE-OP to SAFE-OP."""
    servo = master.slaves[0]
    write = lambda index, sub, value, size: servo.sdo_write(
        index, sub, value.to_bytes(size, "little")
    )
    write(0x1C12, 0, 0, 1)
    write(0x1600, 0, 0, 1)
    write(0x1600, 1, 0x60400010, 4)
    write(0x1600, 2, 0x60FF0020, 4)
    write(0x1600, 0, 2, 1)
    write(0x1C12, 1, 0x1600, 2)
    write(0x1C12, 0, 1, 1)


def exchange(times=1):
    wkc = 0
    for _ in range(times):
        master.send_processdata()
        wkc = master.receive_processdata(20_000)
        time.sleep(0.001)
    return wkc


def state():
    exchange(5)
    return master.state_check(pysoem.OP_STATE, 2_000)


def run(log):
    names = [(s.name, s.man) for s in master.slaves]
    check(
        "names and vendors",
        [n for n, _ in names]
        == ["servo", "mailbox_device", "digital_out", "digital_in", "analog_in", "analog_out"],
        names,
    )
    servo, mailbox, outputs, inputs, analog_in, analog_out = master.slaves
    check(
        "vendor of 1018h is that of the EEPROM",
        int.from_bytes(servo.sdo_read(0x1018, 1), "little") == servo.man,
    )
    servo.sdo_write(0x6060, 0, b"\x09")
    check("a value is read back", servo.sdo_read(0x6060, 0) == b"\x09")
    check("a segmented upload", len(servo.sdo_read(0x1008, 0)) > 4, servo.sdo_read(0x1008, 0))
    check(
        "a constant cannot be written",
        abort_code(lambda: servo.sdo_write(0x1000, 0, bytes(4))) == 0x06010002,
    )
    check(
        "an object that does not exist", abort_code(lambda: servo.sdo_read(0x2FFF, 0)) == 0x06020000
    )
    listed = {entry.index for entry in servo.od}
    check(
        "the list of objects has the drive's",
        {0x1000, 0x1018, 0x6040, 0x6041, 0x607A} <= listed,
        sorted(map(hex, listed)),
    )
    content = bytes(range(256)) * 5
    mailbox.foe_write("parameters", 0, content, 2_000_000)
    got = bytes(mailbox.foe_read("parameters", 0, 4096, 2_000_000))
    check("a file is read back", got == content, len(got), got[:16].hex(), got[-16:].hex())

    servo.config_func = map_servo
    check("there are clocks", master.config_dc())
    master.config_map()
    check(
        "SAFE-OP",
        wait_for(lambda: master.state_check(pysoem.SAFEOP_STATE, 50_000) == pysoem.SAFEOP_STATE),
    )
    check("controlword and target velocity only", len(servo.output) == 6, len(servo.output))
    check(
        "8 terminals",
        (len(outputs.output), len(inputs.input)) == (1, 1),
        len(outputs.output),
        len(inputs.input),
    )
    check(
        "channels of the analog terminals",
        (len(analog_in.input), len(analog_out.output)) == (8, 4),
        len(analog_in.input),
        len(analog_out.output),
    )
    outputs.output = b"\xa5"
    exchange(20)
    master.state = pysoem.OP_STATE
    master.write_state()
    check(
        "OP",
        wait_for(lambda: state() == pysoem.OP_STATE),
        [(s.state, hex(s.al_status)) for s in master.slaves],
    )
    check(
        "working counter", wait_for(lambda: exchange() == master.expected_wkc), master.expected_wkc
    )
    check(
        "outputs arrive",
        wait_for(
            lambda: exchange() and "slave 2 (digital_out): outputs 10100101\n" in log.read_text()
        ),
        log.read_text(),
    )

    def statusword_is(bits):
        exchange()
        return int.from_bytes(servo.input[:2], "little") & 0x6F == bits

    for name, control, status in (
        ("ready to switch on", 6, 0x21),
        ("switched on", 7, 0x23),
        ("operation enabled", 15, 0x27),
    ):
        servo.output = control.to_bytes(2, "little") + (20_000).to_bytes(4, "little")
        check(name, wait_for(lambda: statusword_is(status)), servo.input[:2].hex())
    position = lambda: int.from_bytes(servo.input[3:7], "little", signed=True)
    began = position()
    check(
        "the drive turns",
        wait_for(lambda: exchange() and position() - began > 1000),
        began,
        position(),
    )
    for line in ("slave 0 (servo): OP", "slave 3 (digital_in): OP"):
        check(
            f"the line prints: {line}",
            wait_for(lambda: exchange() and line in log.read_text()),
            log.read_text(),
        )
    check(
        "without frames the watchdog turns the outputs off",
        wait_for(lambda: "slave 2 (digital_out): outputs 00000000\n" in log.read_text()),
        log.read_text(),
    )
    check(
        "and it is printed",
        wait_for(
            lambda: re.search(r"slave 2 \(digital_out\): SAFE-OP, error 0x001B", log.read_text())
        ),
        log.read_text(),
    )


ethercat_line.network()
with ethercat_line.line(
    HAL,
    "servo\nmailbox_device\ndigital_out bits=8\ndigital_in bits=8\nanalog_in channels=4\nanalog_out channels=2\n",
) as node:
    master = pysoem.Master()
    try:
        master.open("m0")
        check("six slaves", wait_for(lambda: master.config_init() == 6), len(master.slaves))
        run(node.log)
    finally:
        master.close()
sys.exit(checked())
