#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The Python package mcap reads what `hal sim --record` writes, with all CRCs, decodes it as ROS 2 messages, and finds a time window through the
index: recording_mcap_test.py PROGRAM."""
import math
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

package("mcap", "mcap_ros2", "zstandard")
from mcap.reader import make_reader  # noqa: E402
from mcap_ros2.decoder import DecoderFactory  # noqa: E402

NETLIST = """loadrt threads name1=servo-thread period1=1000000 name2=slow period2=10000000
loadrt siggen names=wave
loadrt comp names=above
loadrt sum2 names=late
setp wave.frequency 2
setp late.in0 3
addf wave.update servo-thread
addf above servo-thread
addf late slow
net sine wave.sine => above.in1
net high above.out
net slow-sum late.out
newsig no-thread s32
sets no-thread -7
start
"""


class Counted:
    """A file that counts the bytes that are read."""

    def __init__(self, path):
        self.file, self.bytes = open(path, "rb"), 0

    def read(self, size=-1):
        data = self.file.read(size)
        self.bytes += len(data)
        return data

    def __getattr__(self, name):
        return getattr(self.file, name)


with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "run.mcap"
    (Path(folder) / "a.hal").write_text(NETLIST)
    subprocess.run(
        [
            sys.argv[1],
            "sim",
            "a.hal",
            "--for",
            "5s",
            "--record",
            "run.mcap",
            "--values",
            "sine,high,slow-sum,no-thread,wave.frequency",
        ],
        cwd=folder,
        check=True,
    )
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        check(
            "the header names the writer",
            reader.get_header().library == "halcyon",
            reader.get_header(),
        )
        summary = reader.get_summary()
        topics = {channel.topic: channel for channel in summary.channels.values()}
        check(
            "a topic per thread",
            {"/hal/servo-thread", "/hal/slow", "/hal/no-thread", "/hal/events"} <= set(topics),
            sorted(topics),
        )
        servo = topics["/hal/servo-thread"]
        check(
            "true names and units",
            servo.metadata["pin.wave_frequency"] == "wave.frequency"
            and servo.metadata["unit.wave_frequency"] == "Hz",
            servo.metadata,
        )
        check(
            "statistics",
            summary.statistics.channel_message_counts[servo.id] == 5000,
            summary.statistics,
        )
        rows = [
            (message, decoded)
            for _, channel, message, decoded in reader.iter_decoded_messages(
                topics=["/hal/servo-thread"]
            )
        ]
        check("every cycle", len(rows) == 5000, len(rows))
        check(
            "in steps of a period",
            {b.log_time - a.log_time for (a, _), (b, _) in zip(rows, rows[1:])} == {1_000_000},
        )
        check(
            "numbered by cycle",
            {b.sequence - a.sequence for (a, _), (b, _) in zip(rows, rows[1:])} == {1},
        )
        check(
            "values of one cycle",
            all(row.high == (row.sine > 0) for _, row in rows if row.sine != 0),
        )
        check("a sine of amplitude 1", 0.999 < max(row.sine for _, row in rows) <= 1.0001)
        check("a parameter", {row.wave_frequency for _, row in rows} == {2.0})
        slow = [decoded for _, _, _, decoded in reader.iter_decoded_messages(topics=["/hal/slow"])]
        check("the slow thread", len(slow) == 500 and slow[-1].slow_sum == 3.0, len(slow))
        alone = [
            decoded for _, _, _, decoded in reader.iter_decoded_messages(topics=["/hal/no-thread"])
        ]
        check("a value without a thread", [row.no_thread for row in alone] == [-7], alone)
        check(
            "metadata",
            any(
                one.name == "halcyon" and "version" in one.metadata
                for one in reader.iter_metadata()
            ),
        )
    counted = Counted(path)
    reader = make_reader(counted, validate_crcs=False, decoder_factories=[DecoderFactory()])
    begin = rows[2500][0].log_time
    window = list(
        reader.iter_decoded_messages(
            topics=["/hal/servo-thread"], starting_at=begin, ending_before=begin + 100_000_000
        )
    )
    check(
        "a time window",
        [message.sequence for _, _, message, _ in window]
        == [message.sequence for message, _ in rows[2500:2600]],
        len(window),
    )
    check(
        "without reading the whole file",
        counted.bytes < path.stat().st_size / 3,
        f"{counted.bytes} of {path.stat().st_size} bytes",
    )
    (Path(folder) / "axis.hal").write_text(
        "loadrt threads name1=servo period1=1000000\nloadrt two_mass names=axis\nsetp axis.torque 0.1\naddf axis.update servo\n"
    )
    subprocess.run(
        [
            sys.argv[1],
            "sim",
            "axis.hal",
            "--for",
            "1s",
            "--record",
            "axis.mcap",
            "--values",
            "axis.*",
        ],
        cwd=folder,
        check=True,
    )
    with open(Path(folder) / "axis.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        rows = {
            message.log_time: decoded
            for _, _, message, decoded in reader.iter_decoded_messages(topics=["/hal/servo"])
        }
        joints = [
            (message, decoded)
            for _, channel, message, decoded in reader.iter_decoded_messages(
                topics=["/hal/servo/joints"]
            )
        ]
        check("joints 50 times a second", len(joints) == 50, len(joints))
        check(
            "of the values with units",
            {tuple(joint.name) for _, joint in joints} == {("axis.load", "axis.motor", "axis")},
            [joint.name for _, joint in joints[:1]],
        )
        check(
            "at the time of their row",
            all(
                message.log_time == joint.header.stamp.sec * 10**9 + joint.header.stamp.nanosec
                for message, joint in joints
            ),
        )
        check(
            "with its values",
            all(
                list(joint.position)
                == [
                    rows[m.log_time].axis_load_angle,
                    rows[m.log_time].axis_motor_angle,
                    rows[m.log_time].axis_twist,
                ]
                and list(joint.velocity)[:2]
                == [rows[m.log_time].axis_load_velocity, rows[m.log_time].axis_motor_velocity]
                for m, joint in joints
            ),
        )
        check(
            "NaN for a missing quantity",
            all(
                math.isnan(joint.velocity[2])
                and math.isnan(joint.effort[1])
                and joint.effort[0] == 0
                for _, joint in joints
            ),
        )
    said = subprocess.run(
        [sys.argv[1], "replay", "axis.mcap", "axis.hal"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ).stdout
    check("replay does not mention the second copy", "not read" not in said, said)
sys.exit(checked())
