#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""master_peer_test.py HAL: two devices of the Python package `canopen` under our master component in a running netlist, on the `udp:` bus
and over a serial line (slcan). 77: the package is missing. A transport that this machine does not have is left out with a message."""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import peers
from checks import SKIPPED, check, checked, wait_for

can, canopen = peers.packages()
types = canopen.objectdictionary.datatypes

HAL = sys.argv[1]
FOLDER = Path(tempfile.mkdtemp(prefix="hal-master-"))
ENVIRONMENT = {
    **os.environ,
    "HOME": str(FOLDER),
    "XDG_RUNTIME_DIR": str(FOLDER),
    "LC_ALL": "C.UTF-8",
    "TERM": "dumb",
}
CONFIGURATION = """[bus]
link = {link}
sync = 50ms
[defaults]
device-type = 0x1234
vendor      = 0x77
heartbeat   = 200ms
tpdo1       = 0x2001 s16, 0x2000 u32
rpdo1       = 0x2002 u32
rpdo1.transmission = event
write 0x2003 u32 = 4711
retry       = 200ms
watch-master = none
[node 10 first]
[node 11 second]
mandatory   = no
"""
NETLIST = """loadrt threads name1=servo period1=5000000
loadrt canopen config=net.canopen
addf canopen.0.receive  servo
addf canopen.0.transmit servo
start
"""


def shell(*words):
    done = subprocess.run(
        [HAL, "shell", *words],
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout.strip()


def pin(name):
    return shell("getp", "canopen.0." + name)


def number(name):
    """A pin's value; None while the machine does not answer."""
    try:
        return int(pin(name), 0)
    except ValueError:
        return None


def dictionary():
    od = canopen.ObjectDictionary()

    def variable(index, data_type, name, value, sub=0):
        it = canopen.objectdictionary.ODVariable(name, index, sub)
        it.data_type, it.default, it.access_type = data_type, value, "rw"
        return it

    for row in (
        (0x1000, types.UNSIGNED32, "Device type", 0x1234),
        (0x1017, types.UNSIGNED16, "Producer heartbeat time", 0),
        (0x2000, types.UNSIGNED32, "Count", 0),
        (0x2001, types.INTEGER16, "Small", 0),
        (0x2002, types.UNSIGNED32, "Wish", 0),
        (0x2003, types.UNSIGNED32, "Setting", 0),
    ):
        od.add_object(variable(*row))

    def record(index, name, *rows):
        it = canopen.objectdictionary.ODRecord(name, index)
        it.add_member(variable(index, types.UNSIGNED8, "Highest sub-index", len(rows)))
        for sub, (data_type, value) in enumerate(rows, 1):
            it.add_member(variable(index, data_type, f"Sub {sub}", value, sub))
        od.add_object(it)

    u32, u16, u8 = types.UNSIGNED32, types.UNSIGNED16, types.UNSIGNED8
    record(0x1018, "Identity", (u32, 0x77), (u32, 1), (u32, 1), (u32, 1))
    record(0x1400, "RPDO 1 parameters", (u32, 0x80000000), (u8, 255))
    record(0x1800, "TPDO 1 parameters", (u32, 0x80000000), (u8, 255), (u16, 0), (u8, 0), (u16, 0))
    record(0x1600, "RPDO 1 mapping", *[(u32, 0)] * 8)
    record(0x1A00, "TPDO 1 mapping", *[(u32, 0)] * 8)
    return od


class Device:
    """A LocalNode that does what a device's own program does: takes its PDOs when it is started, sends one with each SYNC."""

    def __init__(self, network, node_id):
        self.network, self.id, self.syncs, self.live = network, node_id, 0, False
        self.node = network.add_node(canopen.LocalNode(node_id, dictionary()))
        network.subscribe(0x80, self.on_sync)
        network.subscribe(0x200 + node_id, self.on_wish)
        self.wish = None
        self.node.nmt.send_command(0)  # the package's boot-up message

    def on_wish(self, _, data, __):
        self.wish = int.from_bytes(data, "little")

    def on_sync(self, *_):
        if self.node.nmt.state != "OPERATIONAL" or not self.live:
            return
        self.syncs += 1
        self.node.sdo[0x2000].raw, self.node.sdo[0x2001].raw = self.syncs, -self.id
        cob = self.node.sdo[0x1800][1].raw
        mapping = [self.node.sdo[0x1A00][n].raw for n in range(1, self.node.sdo[0x1A00][0].raw + 1)]
        data = b"".join(
            self.node.get_data(entry >> 16, entry >> 8 & 0xFF)[: (entry & 0xFF) // 8]
            for entry in mapping
        )
        self.network.send_message(cob & 0x7FF, data)


def run(what, network, link):
    (FOLDER / "net.canopen").write_text(CONFIGURATION.format(link=link))
    (FOLDER / "net.hal").write_text(NETLIST)
    devices = [Device(network, 10), Device(network, 11)]
    machine = subprocess.Popen(
        [HAL, "run", "net.hal"],
        cwd=FOLDER,
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        up = wait_for(lambda: pin("nodes-operational") == "2")
        check(f"{what}: both devices are operational", up, shell("show", "pin", "canopen.0"))
        if not up:
            return
        first, second = devices
        check(
            f"{what}: as they know it",
            wait_for(lambda: [d.node.nmt.state for d in devices] == ["OPERATIONAL"] * 2),
        )
        check(
            f"{what}: objects were written", [d.node.sdo[0x2003].raw for d in devices] == [4711] * 2
        )
        check(
            f"{what}: PDOs were mapped",
            [first.node.sdo[0x1A00][n].raw for n in range(3)] == [2, 0x20010010, 0x20000020],
        )
        for d in devices:
            d.live = True
        check(
            f"{what}: what they send are pins",
            wait_for(lambda: pin("first.0x2001") == "-10" and (number("second.0x2000") or 0) > 3),
            pin("first.0x2001"),
            pin("second.0x2000"),
        )
        shell("setp", "canopen.0.first.0x2002", "77")
        check(
            f"{what}: a pin is sent to the device", wait_for(lambda: first.wish == 77), first.wish
        )
        first.node.emcy.send(0x5030, 0x81)
        check(
            f"{what}: emergency",
            wait_for(
                lambda: number("first.emcy") == 0x5030 and number("first.error-register") == 0x81
            ),
        )
        first.node.emcy.reset()
        check(f"{what}: the error is gone", wait_for(lambda: number("first.emcy") == 0))
        second.node.nmt.stop_heartbeat()
        check(f"{what}: silence is a fault", wait_for(lambda: (number("second.retries") or 0) > 0))
        check(
            f"{what}: the fault is reported",
            wait_for(lambda: "node 11 (second): no heartbeat for" in shell("show", "fault")),
            shell("show", "fault"),
        )
        check(
            f"{what}: and the device is brought back",
            wait_for(lambda: pin("second.operational") == "TRUE"),
        )
        first.node.nmt.state = "PRE-OPERATIONAL"
        check(
            f"{what}: who leaves operational is brought back",
            wait_for(
                lambda: (number("first.retries") or 0) > 0 and pin("first.operational") == "TRUE"
            ),
        )
    finally:
        machine.terminate()
        check(f"{what}: the machine ends in order", machine.wait(120) == 0, machine.stdout.read())
    check(
        f"{what}: its nodes are pre-operational",
        wait_for(lambda: [d.node.nmt.state for d in devices] == ["PRE-OPERATIONAL"] * 2),
        [d.node.nmt.state for d in devices],
    )


def udp():
    network = canopen.Network()
    try:
        network.connect(interface="udp_multicast", channel="239.74.163.80", port=43180)
    except (OSError, can.CanError) as error:
        return print(f"udp: left out, there is no multicast on this machine: {error}")
    try:
        run("udp", network, "udp:239.74.163.80:43180")
    finally:
        network.disconnect()


def slcan():
    if shutil.which("socat") is None:
        return print("slcan: left out, socat is missing; type: apt install socat")
    ends = [str(FOLDER / side) for side in "ab"]
    relay = subprocess.Popen(
        ["socat", f"pty,raw,echo=0,link={ends[0]}", f"pty,raw,echo=0,link={ends[1]}"]
    )
    network = canopen.Network()
    try:
        if not wait_for(lambda: all(map(os.path.exists, ends))):
            return print("slcan: left out, there are no ptys")
        network.connect(interface="slcan", channel=ends[0], sleep_after_open=0.1)
        run("slcan", network, f"slcan:{ends[1]}")
        network.disconnect()
    finally:
        relay.kill()
        relay.wait()


def main():
    udp()
    slcan()
    shutil.rmtree(FOLDER)
    return checked(if_none=SKIPPED)


if __name__ == "__main__":
    sys.exit(main())
