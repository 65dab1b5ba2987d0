#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""python_can_test.py BUS_TESTS: our `udp:` and `slcan:` links against python-can: it sends, `bus_tests --echo` sends back what it got."""
import os
import shutil
import subprocess
import sys
import tempfile
import time

try:
    import can
except ImportError:
    print("python-can is missing; type: python3 -m pip install python-can pyserial msgpack")
    sys.exit(77)

FRAMES = [
    dict(arbitration_id=0x123, is_extended_id=False, data=[1, 2, 3]),
    dict(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=list(range(8))),
    dict(arbitration_id=0x7FF, is_extended_id=False, data=[]),
    dict(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=1),
]
FD_FRAMES = [
    dict(
        arbitration_id=0x321, is_extended_id=False, is_fd=True, data=[7] * 64, bitrate_switch=True
    ),
    dict(arbitration_id=0x12345, is_extended_id=True, is_fd=True, data=list(range(12))),
]


def contents(frame):
    """What a bus carries of a frame: not when, where or by whom (Message.equals of older versions compares those, too)."""
    return (
        frame.arbitration_id,
        frame.is_extended_id,
        frame.is_remote_frame,
        frame.is_error_frame,
        frame.is_fd,
        frame.bitrate_switch,
        frame.error_state_indicator,
        frame.dlc,
        bytes(frame.data),
    )


def exchange(bus, program, address, frames):
    """Every frame returns with 1 added to its identifier."""
    ours = subprocess.Popen([program, "--echo", address], stdout=subprocess.PIPE, text=True)
    wrong = []
    try:
        line = ours.stdout.readline().strip()
        if line != "open":
            return [f"{address}: {line}"]
        for f in frames:
            message = can.Message(check=True, **f)
            bus.send(message)
            deadline = time.monotonic() + 10
            while (got := bus.recv(max(0.0, deadline - time.monotonic()))) is not None:
                if got.arbitration_id == message.arbitration_id ^ 1:
                    break
            if got is None:
                wrong.append(f"{address}: no answer to {message}")
                continue
            expected = can.Message(**{**f, "arbitration_id": message.arbitration_id ^ 1})
            if contents(got) != contents(expected):
                wrong.append(f"{address}: sent {message}, got {got}")
    finally:
        ours.kill()
        ours.wait()
    return wrong


def udp(program):
    with can.Bus("239.74.163.77", interface="udp_multicast", port=43177, fd=True) as bus:
        return exchange(bus, program, "udp:239.74.163.77:43177?fd", FRAMES + FD_FRAMES)


def serial_line(program):
    if shutil.which("socat") is None:
        raise OSError("socat is missing; type: sudo apt install socat")
    with tempfile.TemporaryDirectory() as folder:
        ends = [f"{folder}/{side}" for side in "ab"]
        relay = subprocess.Popen(
            ["socat", f"pty,raw,echo=0,link={ends[0]}", f"pty,raw,echo=0,link={ends[1]}"]
        )
        try:
            while not all(os.path.exists(e) for e in ends):
                time.sleep(0.05)
            with can.Bus(ends[0], interface="slcan", sleep_after_open=0.1) as bus:
                return exchange(bus, program, f"slcan:{ends[1]}", FRAMES)
        finally:
            relay.kill()
            relay.wait()


def main():
    program, wrong, ran = sys.argv[1], [], 0
    for name, part in (("udp", udp), ("slcan", serial_line)):
        try:
            found = part(program)
        except OSError as error:
            print(f"{name} is left out: {error}")
            continue
        print(f"{name}: {'; '.join(found) or 'all frames returned'}")
        wrong += found
        ran += 1
    return 1 if wrong else 0 if ran else 77


if __name__ == "__main__":
    sys.exit(main())
