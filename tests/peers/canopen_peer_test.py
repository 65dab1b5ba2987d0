#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""canopen_peer_test.py CANOPEN_PEER: our device under the Python package `canopen` as master, and its device under our SDO client
and our NMT master, all on the `udp:` bus. 77: the package or multicast is missing."""
import subprocess
import sys
import threading

import peers
from checks import check, checked, wait_for

can, canopen = peers.packages()

GROUP, PORT = "239.74.163.78", 43178
ADDRESS = f"udp:{GROUP}:{PORT}"
SIZES = [1, 4, 5, 7, 8, 14, 21, 889, 890, 1000, 10000]


def pattern(size, seed):
    return bytes((n * 7 + seed + (n >> 8)) & 0xFF for n in range(size))


def dictionary():
    od = canopen.ObjectDictionary()

    def add(index, data_type, name, sub=None):
        variable = canopen.objectdictionary.ODVariable(name, index, sub or 0)
        variable.data_type = data_type
        variable.pdo_mappable = True
        if sub is None:
            od.add_object(variable)
        return variable

    types = canopen.objectdictionary.datatypes
    add(0x1000, types.UNSIGNED32, "Device type")
    add(0x1017, types.UNSIGNED16, "Producer heartbeat time").access_type = "rw"
    add(0x2000, types.UNSIGNED32, "Value")
    add(0x2001, types.INTEGER16, "Small")
    add(0x2005, types.VISIBLE_STRING, "Text")
    add(0x2006, types.DOMAIN, "Data")
    for base, size in ((0x1400, 5), (0x1800, 6), (0x1600, 8), (0x1A00, 8)):
        record = canopen.objectdictionary.ODRecord(f"PDO {base:X}", base)
        for sub in range(size + 1):
            variable = canopen.objectdictionary.ODVariable(f"sub {sub}", base, sub)
            if base >= 0x1800 and base < 0x1A00 or base < 0x1600:
                variable.data_type = {
                    1: types.UNSIGNED32,
                    3: types.UNSIGNED16,
                    5: types.UNSIGNED16,
                }.get(sub, types.UNSIGNED8)
            else:
                variable.data_type = types.UNSIGNED32 if sub else types.UNSIGNED8
            record.add_member(variable)
        od.add_object(record)
    return od


def abort_code(action):
    try:
        action()
    except canopen.SdoAbortedError as error:
        return error.code
    return 0


def our_device(program, network):
    seen_boot = threading.Event()
    network.subscribe(0x705, lambda can_id, data, timestamp: data[0] == 0 and seen_boot.set())
    ours = subprocess.Popen([program, "device", ADDRESS, "5"], stdout=subprocess.PIPE, text=True)
    try:
        line = ours.stdout.readline().strip()
        if line != "open":
            print(line)
            return
        node = network.add_node(canopen.RemoteNode(5, dictionary()))
        node.sdo.RESPONSE_TIMEOUT = 2.0
        check("boot-up message", seen_boot.wait(5))
        check("device type", node.sdo.upload(0x1000, 0) == bytes.fromhex("91010000"))
        check("vendor", node.sdo.upload(0x1018, 1) == bytes.fromhex("34120000"))
        check("segmented text", node.sdo.upload(0x2005, 0) == b"hello world")
        check("abort no object", abort_code(lambda: node.sdo.upload(0x2FFF, 0)) == 0x06020000)
        check("abort no sub-index", abort_code(lambda: node.sdo.upload(0x1018, 9)) == 0x06090011)
        check(
            "abort read only",
            abort_code(lambda: node.sdo.download(0x1000, 0, b"1234")) == 0x06010002,
        )
        for size in SIZES:
            data = pattern(size, 1)
            node.sdo.download(0x2006, 0, data, force_segment=size > 4)
            check(f"segmented {size} down and up", node.sdo.upload(0x2006, 0) == data)
            data = pattern(size, 2)
            with node.sdo.open(0x2006, 0, "wb", size=size, block_transfer=True) as stream:
                stream.write(data)
            with node.sdo.open(0x2006, 0, "rb", block_transfer=True) as stream:
                check(f"block {size} down and up", stream.read() == data)
        node.sdo.download(0x1017, 0, (50).to_bytes(2, "little"))
        beats = []
        node.nmt.add_heartbeat_callback(beats.append)
        node.nmt.state = "OPERATIONAL"
        check("heartbeat, operational", wait_for(lambda: beats.count(5) >= 3), beats)
        node.tpdo.read()
        node.rpdo.read()
        check("mapping is read", [v.index for v in node.tpdo[1].map] == [0x2001, 0x2000])
        node.rpdo[1][0x2000].raw, node.rpdo[1][0x2001].raw = 0xCAFE, -5
        node.rpdo[1].transmit()
        check("RPDO arrives", wait_for(lambda: node.sdo.upload(0x2000, 0) == b"\xfe\xca\x00\x00"))
        arrived = []
        node.tpdo[1].add_callback(arrived.append)
        for n in range(10):
            network.sync.transmit()
            wait_for(lambda: len(arrived) > n)
        check("TPDO after SYNC, 10 of 10", len(arrived) == 10, len(arrived))
        check(
            "values of the TPDO",
            (node.tpdo[1][0x2001].raw, node.tpdo[1][0x2000].raw) == (-5, 0xCAFE),
        )
        node.rpdo[1][0x2000].raw = 0xE
        node.rpdo[1].transmit()
        check("EMCY", wait_for(lambda: [e.code for e in node.emcy.log] == [0x5030]), node.emcy.log)
        node.sdo.download(0x2000, 0, bytes(4))
        check(
            "EMCY is over",
            wait_for(lambda: len(node.emcy.log) == 2 and not node.emcy.active),
            node.emcy.log,
        )
        node.nmt.state = "STOPPED"
        check("stopped", wait_for(lambda: beats[-1] == 4))
        seen_boot.clear()
        node.nmt.state = "RESET COMMUNICATION"
        check("reset communication boots", seen_boot.wait(5))
    finally:
        ours.kill()
        ours.wait()


def our_client(program, network):
    od = dictionary()
    node = network.add_node(canopen.LocalNode(9, od))
    node.nmt.send_command(0)
    node.sdo[0x1000].raw = 0x1234
    node.sdo[0x2000].raw = 77
    ours = subprocess.Popen(
        [program, "client", ADDRESS, "9"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )

    def ask(line):
        print(line, file=ours.stdin, flush=True)
        return ours.stdout.readline().strip()

    try:
        check("client opens the bus", ours.stdout.readline().strip() == "open")
        check("client reads", (got := ask("read 1000 0 segmented")) == "ok 34120000", got)
        check(
            "client writes",
            ask("write 2000 0 segmented 0d000000") == "ok" and node.sdo[0x2000].raw == 13,
        )
        check(
            "client gets the abort",
            (got := ask("read 2fff 0 segmented")).startswith("abort 06020000"),
            got,
        )
        for size in SIZES:
            for mode in (
                "segmented",
                "block",
            ):  # the package has no block server: our client falls back to segments
                data = pattern(size, 3)
                wrote = ask(f"write 2006 0 {mode} {data.hex()}")
                check(
                    f"client {mode} {size}",
                    wrote == "ok" and ask(f"read 2006 0 {mode}") == f"ok {data.hex()}",
                    wrote,
                )
        ask("nmt 1")
        check("client starts the node", wait_for(lambda: node.nmt.state == "OPERATIONAL"))
    finally:
        ours.kill()
        ours.wait()


def our_master(program, network):
    od = dictionary()
    node = network.add_node(canopen.LocalNode(10, od))
    node.sdo[0x1000].raw = 0x1234
    node.sdo[0x2001].raw = -5
    ours = subprocess.Popen([program, "master", ADDRESS, "10"], stdout=subprocess.PIPE, text=True)
    lines = []
    threading.Thread(
        target=lambda: lines.extend(iter(ours.stdout.readline, "")), daemon=True
    ).start()

    def steps():
        return [line.strip() for line in lines[-12:]]

    try:
        check(
            "master boots a node of the package",
            wait_for(lambda: steps()[-1:] == ["running"], 20),
            steps(),
        )
        check(
            "its objects are configured",
            (node.sdo[0x2000].raw, node.sdo[0x2005].raw) == (4711, "a long text"),
        )
        check(
            "its PDO is mapped",
            [node.sdo[0x1A00][n].raw for n in range(3)] == [2, 0x20010010, 0x20000020],
            steps(),
        )
        check(
            "its PDO is on",
            (node.sdo[0x1800][1].raw & 0xBFFFFFFF, node.sdo[0x1800][2].raw) == (0x18A, 1),
        )
        check("its heartbeat is set", node.sdo[0x1017].raw == 100)
        check("it is operational", node.nmt.state == "OPERATIONAL")
        node.nmt.stop_heartbeat()
        check(
            "its silence is noticed",
            wait_for(lambda: any(" sent no heartbeat within " in s for s in steps())),
            steps(),
        )
        check("it is booted again", wait_for(lambda: steps()[-1:] == ["running"], 20), steps())
        node.nmt.state = "PRE-OPERATIONAL"
        check(
            "that it left operational is noticed",
            wait_for(lambda: any(" left the operational state " in s for s in steps())),
            steps(),
        )
        check("it is brought back", wait_for(lambda: steps()[-1:] == ["running"], 20), steps())
    finally:
        ours.kill()
        ours.wait()


def main():
    network = canopen.Network()
    try:
        network.connect(interface="udp_multicast", channel=GROUP, port=PORT)
    except (OSError, can.CanError) as error:
        print(f"no multicast on this machine: {error}")
        return 77
    for part in (our_device, our_client, our_master):
        part(sys.argv[1], network)
    network.disconnect()
    return checked()


if __name__ == "__main__":
    sys.exit(main())
