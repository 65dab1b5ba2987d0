#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: dds
"""Cyclone DDS, an independent implementation, reads and writes our topics: dds_cyclone_test.py HAL. Loopback only."""
import os
import sys
import unittest
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "dds"))
from peers import package  # noqa: E402

os.environ["CYCLONEDDS_URI"] = (
    "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
    "<Discovery><Peers><Peer address='127.0.0.1'/></Peers><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex></Discovery>"
)
package("cyclonedds")
if len(sys.argv) > 1:
    os.environ["HAL_BIN"] = sys.argv.pop(1)

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.annotations import final  # noqa: E402
from cyclonedds.idl.types import float64, int32, sequence, uint32, uint64  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402
from rig import DOMAIN, DdsCase, wait_until  # noqa: E402


@dataclass
@final
class State(IdlStruct, typename="test::State"):
    ready: bool
    angle: float64
    count: int32
    number: uint64


@dataclass
@final
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: float64


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(16))
ALL = Qos(Policy.Reliability.Reliable(duration(seconds=60)), Policy.History.KeepAll)
THREAD = "loadrt threads name1=servo period1=1000000\n"
FIELDS = "fields=ready:bit,angle:float,count:s32,number:u64"


class Cyclone(DdsCase):
    def setUp(self):
        super().setUp()
        self.participant = DomainParticipant(DOMAIN)

    def reader(self, name, kind):
        return DataReader(self.participant, Topic(self.participant, name, kind), qos=RELIABLE)

    def writer(self, name, kind):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=ALL)

    def first(self, reader):
        return wait_until(lambda: reader.take(1), "a sample comes")[0]

    def test_it_reads_a_group_of_pins(self):
        reader = self.reader("state", State)
        self.machine(
            "ours",
            f"{THREAD}loadrt dds_publish names=pub topic=state type=test::State {FIELDS} domain={DOMAIN}\n"
            "setp pub.ready 1\nsetp pub.angle -2.5\nsetp pub.count -7\nsetp pub.number 123456789012345\naddf pub servo\n",
        )
        sample = self.first(reader)
        self.assertEqual(
            (True, -2.5, -7, 123456789012345),
            (sample.ready, sample.angle, sample.count, sample.number),
        )
        self.becomes("pub.matched", "1", "ours")

    def test_it_writes_a_group_of_pins(self):
        self.machine(
            "ours",
            f"{THREAD}loadrt dds_subscribe names=sub topic=state type=test::State {FIELDS} domain={DOMAIN} timeout_ms=60000 depth=200\naddf sub servo\n",
        )
        writer = self.writer("state", State)
        self.becomes("sub.matched", "1", "ours")
        wait_until(lambda: writer.get_matched_subscriptions(), "Cyclone has found us")
        for i in range(200):
            writer.write(State(i % 2 == 1, i / 4, -i, 10**12 + i))
        self.becomes("sub.count", "-199", "ours")
        self.assertEqual(
            ["TRUE", "49.75", "200", "0"],
            [self.value("sub." + pin, "ours") for pin in ("ready", "angle", "received", "lost")],
        )

    def test_it_reads_and_writes_messages_of_ros(self):
        floats, joints = self.reader("rt/arm/angle", Float64), self.reader(
            "rt/joint_states", JointState
        )
        self.machine(
            "ours",
            f"{THREAD}loadrt dds_publish names=angle topic=/arm/angle ros=std_msgs/Float64 domain={DOMAIN}\n"
            f"loadrt dds_publish names=joints topic=/joint_states ros=sensor_msgs/JointState joints=shoulder,elbow frame=base domain={DOMAIN}\n"
            f"loadrt dds_subscribe names=wanted topic=/wanted ros=sensor_msgs/JointState joints=shoulder,elbow domain={DOMAIN} timeout_ms=60000\n"
            "setp angle.data 0.5\nsetp joints.elbow-position 1.25\nsetp joints.shoulder-effort -3\n"
            "addf angle servo\naddf joints servo\naddf wanted servo\n",
        )
        self.assertEqual(0.5, self.first(floats).data)
        state = self.first(joints)
        self.assertEqual(
            (["shoulder", "elbow"], [0, 1.25], [-3, 0], "base"),
            (state.name, state.position, state.effort, state.header.frame_id),
        )
        self.assertGreater(state.header.stamp.sec, 1_600_000_000)
        writer = self.writer("rt/wanted", JointState)
        self.becomes("wanted.matched", "1", "ours")
        wait_until(lambda: writer.get_matched_subscriptions(), "Cyclone has found us")
        writer.write(
            JointState(
                Header(Time(1, 2), "a frame of another length"),
                ["elbow", "tool", "shoulder"],
                [1.0, 2.0, 3.0],
                [],
                [4.0, 5.0, 6.0],
            )
        )
        self.becomes("wanted.elbow-position", "1", "ours")
        self.assertEqual(
            ["3", "6", "0"],
            [
                self.value("wanted." + pin, "ours")
                for pin in ("shoulder-position", "shoulder-effort", "elbow-velocity")
            ],
        )


if __name__ == "__main__":
    unittest.main()
