#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""devices_peer_test.py HAL: the Python package `canopen` is master of all devices of `hal node`, each described by its own EDS, on the
`udp:` bus. 77: the package or multicast is missing."""
import os
import struct
import subprocess
import sys
import tempfile
import threading
import zlib

import peers
from checks import check, checked, wait_for

can, canopen = peers.packages()

GROUP, PORT = "239.74.163.79", 43179
HAL = sys.argv[1]
TEMPORARY = tempfile.TemporaryDirectory(prefix="hal-devices-")  # gone at the end of the program
FOLDER = TEMPORARY.name


class Device:
    """One `hal node` process and the master's node of it."""

    def __init__(self, network, kind, node_id, *words):
        self.network, self.id = network, node_id
        eds = os.path.join(FOLDER, kind + ".eds")
        with open(eds, "w", encoding="utf-8") as out:
            subprocess.run([HAL, "node", kind, "--eds", *words], stdout=out, check=True)
        booted = threading.Event()
        network.subscribe(
            0x700 + node_id, lambda can_id, data, timestamp: data[0] == 0 and booted.set()
        )
        self.process = subprocess.Popen(
            [HAL, "node", kind, "--link", f"udp:{GROUP}:{PORT}", "--id", str(node_id), *words],
            stdout=subprocess.DEVNULL,
        )
        check(f"{kind}: boot-up", booted.wait(20))
        network.unsubscribe(0x700 + node_id)
        self.node = network.add_node(canopen.RemoteNode(node_id, eds))
        self.node.sdo.RESPONSE_TIMEOUT = 5.0
        self.booted = booted

    def __enter__(self):
        return self.node

    def __exit__(self, *_):
        del self.network[self.id]
        self.process.terminate()
        check("ends with 0", self.process.wait(20) == 0)


def abort_code(action):
    try:
        action()
    except canopen.SdoAbortedError as error:
        return error.code
    return 0


def beating(node, milliseconds=20):
    """Lets the node's heartbeat be heard, which the package takes its state from."""
    node.sdo["Producer heartbeat time"].raw = milliseconds
    node.nmt.wait_for_heartbeat(20)


def start(node):
    beating(node)
    node.nmt.state = "OPERATIONAL"
    check("operational", wait_for(lambda: node.nmt.state == "OPERATIONAL"), node.nmt.state)


def io(network):
    with Device(network, "io", 5) as node:
        check("io: device type", node.sdo["Device type"].raw == 0x000F0191)
        check("io: name", node.sdo["Manufacturer device name"].raw == "Halcyon I/O")
        check("io: serial number", node.sdo["Identity object"]["Serial number"].raw == 1)
        check(
            "io: abort of a value too high",
            abort_code(lambda: node.sdo.download(0x6421, 1, bytes([99]))) == 0x06090031,
        )
        node.tpdo.read()
        node.rpdo.read()
        check("io: mapping of RPDO 1", [v.index for v in node.rpdo[1].map] == [0x6200] * 8)
        start(node)
        for n in range(8):
            node.rpdo[1].map[n].raw = 1 << n
        node.rpdo[1].transmit()
        check(
            "io: outputs",
            wait_for(lambda: node.sdo[0x6320][1].raw == 0x08040201),
            hex(node.sdo[0x6320][1].raw),
        )
        heard = []
        node.tpdo[1].add_callback(heard.append)
        node.sdo[0x6002][1].raw = 0x0F  # polarity: the inputs change, and TPDO 1 sends them
        check(
            "io: TPDO on change", wait_for(lambda: heard) and node.tpdo[1].map[0].raw == 0x0F, heard
        )
        node.sdo[0x1016][1].raw = 0x007F0000 | 200  # the master's heartbeat, 200 ms
        node.sdo[0x6207][1].raw = 0xA5
        network.send_message(0x77F, b"\x05")
        check(
            "io: EMCY when the master is offline",
            wait_for(lambda: [e.code for e in node.emcy.log] == [0x8130]),
            node.emcy.log,
        )
        check("io: error values", node.sdo[0x6200][1].raw == 0xA5, node.sdo[0x6200][1].raw)
        check(
            "io: pre-operational",
            wait_for(lambda: node.nmt.state == "PRE-OPERATIONAL"),
            node.nmt.state,
        )


def drive(network):
    with Device(network, "drive", 2, "--axes", "2", "--motor", "endless:1") as node:
        check("drive: device type", node.sdo[0x1000].raw & 0xFFFF == 402)
        start(node)
        for axis in (0, 0x800):
            node.sdo[0x6060 + axis].raw = 1  # profile position
            node.sdo[0x6081 + axis].raw = 40000
            for command, mask, state in ((6, 0x6F, 0x21), (7, 0x6F, 0x23), (0xF, 0x6F, 0x27)):
                node.sdo[0x6040 + axis].raw = command
                check(
                    f"drive: statusword {state:02x}",
                    wait_for(lambda: node.sdo[0x6041 + axis].raw & mask == state),
                )
            node.sdo[0x607A + axis].raw = 5000
            node.sdo[0x6040 + axis].raw = 0x1F
        for axis in (0, 0x800):
            check(
                "drive: target reached",
                wait_for(
                    lambda: node.sdo[0x6041 + axis].raw & 0x400
                    and abs(node.sdo[0x6064 + axis].raw - 5000) < 20
                ),
                node.sdo[0x6064 + axis].raw,
            )
        node.tpdo.read()
        node.tpdo[3].trans_type = 1
        node.tpdo[3].enabled = True
        node.tpdo[3].save()
        heard = []
        node.tpdo[3].add_callback(heard.append)
        for n in range(10):
            network.sync.transmit()
            wait_for(lambda: len(heard) > n)
        check(
            "drive: TPDO 3 with every SYNC",
            len(heard) == 10 and abs(node.tpdo[3][0x6064].raw - 5000) < 20,
            len(heard),
        )


def jr3(network):
    with Device(network, "jr3", 0x50, "--set", "fx=30", "--set", "mz=-1") as node:
        beating(node)
        node.tpdo.read()
        check(
            "jr3: async PDOs are closed",
            [node.tpdo[n].enabled for n in (1, 2, 3, 4)] == [False, True, False, True],
        )
        start(node)
        heard = {2: [], 4: []}
        for n in heard:
            node.tpdo[n].add_callback(heard[n].append)
        check(
            "jr3: calibration memory by blocks",
            wait_for(lambda: abort_code(lambda: node.sdo.upload(0x2104, 0)) == 0),
        )
        with node.sdo.open(0x2104, 0, "rb", block_transfer=True) as stream:
            memory = stream.read()
        check("jr3: memory", len(memory) == 4096 and memory[:8] == b"JR3 CAL\x01")
        for n in range(5):
            network.sync.transmit()
            wait_for(lambda: len(heard[2]) > n and len(heard[4]) > n)
        check(
            "jr3: forces and torques with SYNC",
            abs(node.tpdo[2].map[0].raw - 3000) < 5 and abs(node.tpdo[4].map[2].raw + 1000) < 5,
            node.tpdo[2].map[0].raw,
            node.tpdo[4].map[2].raw,
        )
        check("jr3: of one sample", node.tpdo[2].map[4].raw == node.tpdo[4].map[4].raw)
        opened = []
        node.tpdo[1].add_callback(opened.append)
        network.subscribe(0x1D0, node.tpdo[1].on_message)
        node.sdo[0x1800][1].raw = 0x1D0
        node.sdo[0x6139][1].raw = 0x65726174
        check(
            "jr3: tared",
            wait_for(lambda: abs(node.sdo[0x7140][1].raw) < 5),
            node.sdo[0x7140][1].raw,
        )
        check("jr3: opened PDO speaks", wait_for(lambda: opened))


def bootloader(network):
    image = subprocess.run(
        [HAL, "node", "bootloader", "--make-image", "2.1"], stdout=subprocess.PIPE, check=True
    ).stdout
    device = Device(network, "bootloader", 4)
    with device as node:
        check(
            "bootloader: version",
            node.sdo[0x100A].raw == "1.0" and node.sdo[0x1018][3].raw == 0x10000,
        )
        node.sdo[0x1F51][1].raw = 0
        check("bootloader: stopped", wait_for(lambda: node.sdo[0x100A].raw == "bootloader"))
        node.sdo[0x1F51][1].raw = 3
        check("bootloader: cleared", wait_for(lambda: node.sdo[0x1F57][1].raw == 2))
        with node.sdo.open(0x1F50, 1, "wb", size=len(image), block_transfer=True) as stream:
            stream.write(image)
        check("bootloader: identification", node.sdo[0x1F56][1].raw == zlib.crc32(image))
        check("bootloader: no error", node.sdo[0x1F57][1].raw == 0)
        node.sdo[0x1F51][1].raw = 1
        check(
            "bootloader: new version",
            wait_for(lambda: node.sdo[0x1018][3].raw == struct.unpack_from("<I", image, 8)[0]),
        )
        check("bootloader: new text", node.sdo[0x100A].raw == "2.1")


def main():
    network = canopen.Network()
    try:
        network.connect(interface="udp_multicast", channel=GROUP, port=PORT)
    except (OSError, can.CanError) as error:
        print(f"no multicast on this machine: {error}")
        return 77
    for part in (io, drive, jr3, bootloader):
        part(network)
    network.disconnect()
    return checked()


if __name__ == "__main__":
    sys.exit(main())
