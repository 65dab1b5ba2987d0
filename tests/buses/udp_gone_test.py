#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""udp_gone_test.py BUS_TESTS: the interface below a `udp:` bus goes down, is removed and created again; in a network namespace of its own.
The link reports that it is down and recovers by itself. 77: namespaces are not allowed here."""
import os
import socket
import struct
import subprocess
import sys
import time

GROUP, PORT, PATIENCE = "239.74.163.90", 43190, 30.0


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def datagram(identifier):
    """A frame as python-can packs it (msgpack, eleven keys)."""

    def key(name):
        return bytes([0xA0 | len(name)]) + name.encode()

    return (
        b"\x8b"
        + key("timestamp")
        + b"\xcb"
        + bytes(8)
        + key("arbitration_id")
        + b"\xcd"
        + struct.pack(">H", identifier)
        + key("is_extended_id")
        + b"\xc2"
        + key("is_remote_frame")
        + b"\xc2"
        + key("is_error_frame")
        + b"\xc2"
        + key("channel")
        + b"\xc0"
        + key("dlc")
        + b"\x01"
        + key("data")
        + b"\xc4\x01\x07"
        + key("is_fd")
        + b"\xc2"
        + key("bitrate_switch")
        + b"\xc2"
        + key("error_state_indicator")
        + b"\xc2"
    )


def peer():
    """A socket in the group, as the interface is now."""
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    end.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    end.bind(("", PORT))
    end.setsockopt(
        socket.IPPROTO_IP,
        socket.IP_ADD_MEMBERSHIP,
        socket.inet_aton(GROUP) + socket.inet_aton("10.9.0.1"),
    )
    end.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("10.9.0.1"))
    end.settimeout(0.2)
    return end


def answered(identifier):
    """`bus_tests --echo` sends back what it hears with another identifier. Frames are repeated until it does: UDP loses what it likes."""
    end = time.monotonic() + PATIENCE
    with peer() as us:
        while time.monotonic() < end:
            us.sendto(datagram(identifier), (GROUP, PORT))
            try:
                while True:
                    if datagram(identifier ^ 1)[30:45] in us.recv(500):
                        return True
            except TimeoutError:
                pass
    return False


def plug():
    ip("link", "add", "bus0", "type", "veth", "peer", "name", "bus1")
    ip("link", "set", "bus1", "up")
    up()


def up():
    ip("link", "set", "bus0", "up", "multicast", "on")
    ip("addr", "replace", "10.9.0.1/24", "dev", "bus0")
    ip("route", "replace", "224.0.0.0/4", "dev", "bus0")


def inside(program):
    ip("link", "set", "lo", "up")
    plug()
    ours = subprocess.Popen(
        [program, "--echo", f"udp:{GROUP}:{PORT}"], stdout=subprocess.PIPE, text=True
    )
    try:
        line = ours.stdout.readline().strip()
        if line != "open":
            return print(line) or 1
        steps = [
            ("as it was opened", lambda: None),
            (
                "after it was down",
                lambda: (ip("link", "set", "bus0", "down"), time.sleep(0.1), up()),
            ),
            (
                "after it was taken away",
                lambda: (ip("link", "delete", "bus0"), time.sleep(0.1), plug()),
            ),
        ]
        for number, (what, does) in enumerate(steps):
            does()
            if not answered(0x120 + 2 * number):
                return print(f"no answer {what}") or 1
            print(f"it answers {what}", flush=True)
        return 0
    finally:
        ours.kill()
        ours.wait()


def main():
    if os.environ.get("HALCYON_NAMESPACE"):
        return inside(sys.argv[1])
    can = subprocess.run(
        ["unshare", "-rn", "ip", "link", "add", "bus0", "type", "veth", "peer", "name", "bus1"],
        check=False,
        capture_output=True,
        text=True,
    )
    if can.returncode != 0:
        print(f"no network namespace of our own: {can.stderr.strip()}")
        return 77
    return subprocess.run(
        ["unshare", "-rn", sys.executable, __file__, *sys.argv[1:]],
        env={**os.environ, "HALCYON_NAMESPACE": "1"},
        check=False,
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
