#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""Logs of the Python package can: hal can dump reads its .log files, names its other formats, and reads what can_logconvert makes of them:
can_logs_peer_test.py PROGRAM. Where can-utils are installed, log2long prints candump's terminal format, which is read too."""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

(can,) = package("can")

HAL = sys.argv[1]


def messages(flexible=True):
    """Frames of every kind, 10 ms apart; sent and received."""
    begin = 1_700_000_000.0
    data = [
        can.Message(arbitration_id=0x123, is_extended_id=False, data=[1, 2, 0xAB]),
        can.Message(arbitration_id=0x7FF, is_extended_id=False),
        can.Message(arbitration_id=0x18FF0001, data=range(8)),
        can.Message(arbitration_id=0x12, is_extended_id=True, data=[5]),
        can.Message(arbitration_id=0x321, is_extended_id=False, is_remote_frame=True),
    ]
    if flexible:
        data += [
            can.Message(arbitration_id=0x124, is_extended_id=False, is_fd=True, data=range(12)),
            can.Message(
                arbitration_id=0x125,
                is_extended_id=False,
                is_fd=True,
                bitrate_switch=True,
                data=[1],
            ),
            can.Message(
                arbitration_id=0x126,
                is_fd=True,
                bitrate_switch=True,
                error_state_indicator=True,
                data=range(64),
            ),
            can.Message(is_error_frame=True),
        ]
    for at, message in enumerate(data):
        message.timestamp = begin + at * 0.01
        message.is_rx = at % 2 == 0
        message.channel = (0, "vcan0", None, "PCAN_USBBUS1")[at % 4]
    return data


def expected(message):
    if message.is_error_frame:
        return {"error": True}
    flags = (
        {
            "fd": True,
            "bit_rate_switch": message.bitrate_switch,
            "error_state": message.error_state_indicator,
        }
        if message.is_fd
        else {}
    )
    remote = {"remote": True} if message.is_remote_frame else {}
    return {
        "id": message.arbitration_id,
        "extended": message.is_extended_id,
        "data": bytes(message.data).hex().upper(),
        **flags,
        **remote,
    }


def dump(file):
    done = subprocess.run(
        [HAL, "can", "dump", f"replay:{file}", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    frames = [json.loads(line) for line in done.stdout.splitlines()[:-1]]
    keys = ("id", "extended", "data", "fd", "bit_rate_switch", "error_state", "remote")
    return [
        {"error": True} if frame.get("error") else {key: frame[key] for key in keys if key in frame}
        for frame in frames
    ], done.stderr


def write(path, data):
    with can.Logger(path) as logger:
        for message in data:
            logger(message)


with tempfile.TemporaryDirectory() as temporary:
    place = Path(temporary)
    everything = messages()
    wanted = [expected(message) for message in everything]
    write(str(place / "a.log"), everything)
    check("a .log of can.Logger", dump(place / "a.log")[0] == wanted, dump(place / "a.log"))
    for message in everything:
        message.timestamp -= 1_700_000_000
    write(str(place / "zero.log"), everything)
    check(
        "a .log that begins with 0", dump(place / "zero.log")[0] == wanted, dump(place / "zero.log")
    )
    for message in everything:
        message.timestamp += 1_700_000_000
    classic = messages(flexible=False)
    named = {
        "asc": "a Vector log (.asc)",
        "blf": "a Vector log (.blf)",
        "csv": "a table of python-can (.csv)",
        "trc": "a PCAN trace (.trc)",
        "db": "a database of python-can (.db)",
    }
    for ending, name in named.items():
        other = place / f"other.{ending}"
        data = [
            message for message in classic if not (ending == "trc" and message.is_remote_frame)
        ]  # left out there
        write(str(other), data)
        frames, error = dump(other)
        check(
            f".{ending} is named",
            not frames
            and f"not a candump log: it is {name}; convert it with: can_logconvert FILE FILE.log"
            in error,
            error,
        )
        back = place / f"back-{ending}.log"
        converted = subprocess.run(
            [Path(sys.executable).with_name("can_logconvert"), other, back],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        check(
            f".{ending} is read once it is converted",
            dump(back)[0] == [expected(message) for message in data],
            (converted.stdout, dump(back)),
        )
    write(str(place / "printed.txt"), everything)
    frames, error = dump(place / "printed.txt")
    check(
        "the terminal output is named",
        not frames
        and "the terminal output of python-can; record with: can_logger -f FILE.log" in error,
        error,
    )
    if shutil.which("log2long"):
        with open(place / "a.log") as source, open(place / "long.txt", "w") as target:
            subprocess.run(["log2long"], stdin=source, stdout=target, check=True)
        frames, error = dump(place / "long.txt")
        without_flags = [
            {
                **frame,
                **({"bit_rate_switch": False, "error_state": False} if frame.get("fd") else {}),
            }
            for frame in wanted
        ]
        check("candump's terminal format of log2long", frames == without_flags, (frames, error))
sys.exit(checked())
