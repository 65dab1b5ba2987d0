#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Two machines on a topic and their faults: a killed publisher, another type, a flood, a wrong clock, malformed samples."""

import contextlib
import os
import re
import signal
import unittest

from pathlib import Path

from rig import DOMAIN, FIELDS, PUBLISH, SANITIZED, SUBSCRIBE, DdsCase, wait_until

# The participant uses loopback only; the writer's QoS is incompatible with dds_subscribe's readers.
PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>local</transport_id>
      <type>UDPv4</type>
      <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
    </transport_descriptor>
  </transport_descriptors>
  <participant profile_name="machine">
    <rtps>
      <userTransports><transport_id>local</transport_id></userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>
    </rtps>
  </participant>
  <data_writer profile_name="arm/state">
    <qos><ownership><kind>EXCLUSIVE</kind></ownership></qos>
  </data_writer>
</profiles>
"""


JOINTS = """loadrt threads name1=servo period1=1000000
loadrt {component} topic=/js ros=sensor_msgs/JointState domain={domain} {arguments}
addf j servo
{more}
"""


class Topics(DdsCase):
    def joints(self, instance, component, arguments, more=""):
        return self.machine(
            instance,
            JOINTS.format(
                component=component, domain=DOMAIN, arguments="names=j " + arguments, more=more
            ),
        )

    def test_a_joint_of_a_publisher_that_was_lost_makes_the_topic_invalid(self):
        self.joints("subscriber", "dds_subscribe", "joints=c,b timeout_ms=500 silence_ms=500")
        self.joints("arm", "dds_publish", "joints=a,b rate=100", "setp j.b-position 2")
        self.becomes("j.b-position", "2")
        self.prints("no sample contains joint 'c'; compare joints= with the names")
        self.assertEqual("FALSE", self.value("j.valid", "subscriber"))
        self.assertEqual("inf", self.value("j.age-ms", "subscriber"))
        gripper = self.joints("gripper", "dds_publish", "joints=c rate=100", "setp j.c-position 3")
        self.becomes("j.valid", "TRUE")
        self.assertEqual("3", self.value("j.c-position", "subscriber"))
        gripper.kill()
        gripper.wait()
        self.becomes("j.valid", "FALSE")
        self.assertRegex(
            self.shell("show", "fault", instance="subscriber").stdout,
            r"j: no value of joint 'c' in topic '/js' for 0\.\d+ s \(timeout 500 ms\)",
        )

    def test_a_killed_publisher_makes_the_pins_invalid_and_its_successor_makes_them_valid(self):
        publisher = self.publisher(1.5)
        self.subscriber(more="timeout_ms=300")
        self.becomes("sub.valid", "TRUE")
        self.shows("1.5", "TRUE", "0", "-5")
        self.becomes("sub.matched", "1")
        self.becomes("pub.matched", "1", "publisher")
        wait_until(
            lambda: 0 < float(self.value("sub.age-ms", "subscriber")) < 300,
            "the age of a sample is within the timeout",
        )

        publisher.send_signal(signal.SIGKILL)
        publisher.wait()
        self.becomes("sub.valid", "FALSE")
        self.assertEqual(
            ["-1", "FALSE", "0", "-5"],
            [
                self.value("sub." + pin, "subscriber")
                for pin in ("angle", "ready", "count-0", "count-1")
            ],
        )
        self.assertRegex(
            self.shell("show", "fault", instance="subscriber").stdout,
            r"no sample of topic 'arm/state' for \d+\.\d+ s \(timeout 300 ms\)",
        )

        self.publisher(2.5)
        self.shows("2.5", "TRUE")
        self.prints("sub: topic 'arm/state' is valid again\n")

    def publish(self, value):
        done = self.shell("setp", "pub.angle", value, instance="publisher")
        self.assertEqual(0, done.returncode, done.stderr)

    def test_a_sample_that_is_not_finite_makes_the_pins_invalid(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=5000")
        self.shows("1.5", "TRUE")
        for value in ("nan", "inf"):
            self.publish(value)
            self.becomes("sub.valid", "FALSE")
            self.becomes("sub.angle", "-1")
            self.assertIn(
                "sub: a sample of topic 'arm/state' has a value that is NaN or infinite",
                self.shell("show", "fault", instance="subscriber").stdout,
            )
            self.assertGreater(int(self.value("sub.not-finite", "subscriber")), 0)
            self.publish("2.5")
            self.shows("2.5", "TRUE")
            self.becomes("sub.valid", "TRUE")

    def test_finite_0_sets_the_values_as_they_are(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=5000 finite=0")
        self.shows("1.5", "TRUE")
        self.publish("inf")
        self.becomes("sub.angle", "inf")
        self.assertEqual("TRUE", self.value("sub.valid", "subscriber"))

    def test_a_reliable_subscriber_loses_nothing(self):
        self.subscriber(
            more="timeout_ms=60000 depth=4000"
        )  # as many may wait here for a retransmitted one
        self.rogue("rate=2000", "count=4000", "depth=4000")  # all are kept until they are delivered
        self.becomes("sub.received", "4000")
        self.becomes("sub.lost", "0")
        self.becomes("sub.seq", "4000")

    def test_a_second_publisher_is_ignored_and_reported(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=2000")
        self.becomes("sub.valid", "TRUE")
        rogue = self.rogue("rate=100", "value=9")
        self.becomes("sub.second-publisher", "TRUE")
        self.assertEqual(
            "1.5", self.value("sub.angle", "subscriber"), "the first publisher owns the topic"
        )
        self.assertGreater(int(self.value("sub.ignored", "subscriber")), 0)
        self.prints("sub: topic 'arm/state': second publisher ")
        self.assertRegex(
            self.words("subscriber"),
            r"second publisher (\S+ \()?[0-9a-f]{24}\)? in addition to (\S+ \()?[0-9a-f]{24}\)?; its samples are ignored",
        )
        self.assertRegex(
            self.shell("show", "fault", instance="subscriber").stdout,
            r"a second publisher writes topic 'arm/state' at cycle [\d ]+; its samples are ignored",
        )
        self.end_rogue(rogue)
        self.becomes("sub.second-publisher", "FALSE")
        self.assertEqual(
            ["1.5", "TRUE"], [self.value("sub." + pin, "subscriber") for pin in ("angle", "valid")]
        )

    def test_exclusive_0_accepts_the_samples_of_all_publishers(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=2000 exclusive=0")
        self.becomes("sub.valid", "TRUE")
        self.rogue("rate=200", "value=9")
        self.becomes("sub.angle", "9")
        self.prints("; the samples of both are accepted: to accept only the first, use exclusive=1")
        self.assertEqual("0", self.value("sub.ignored", "subscriber"))

    def test_another_type_is_reported_on_both_sides(self):
        self.publisher()
        self.subscriber("angle:float,ready:bit")
        self.prints("sub: topic 'arm/state' has type ")
        self.becomes("sub.wrong-type", "TRUE")
        self.becomes("pub.wrong-type", "TRUE", "publisher")
        line = next(l for l in self.words("subscriber").splitlines() if "has type" in l)
        names = [w for w in line.split() if w.startswith("hal::Pins_")]
        self.assertEqual(2, len(set(names)), line)
        self.assertEqual(
            f"sub: topic 'arm/state' has type {names[0]} here and {names[1]} at another publisher; no data is exchanged with it",
            line,
        )
        self.prints(
            f"pub: topic 'arm/state' has type {names[1]} here and {names[0]} at another subscriber; no data is exchanged with it",
            "publisher",
        )
        self.assertEqual("FALSE", self.value("sub.valid", "subscriber"))

    def test_an_incompatible_QoS_is_reported_on_both_sides(self):
        self.publisher(more="reliable=0")
        self.subscriber()
        self.prints(
            "sub: topic 'arm/state': a publisher does not offer the requested QoS: reliability (offered best effort, requested reliable)\n"
        )
        self.prints(
            "pub: topic 'arm/state': a subscriber requests a QoS that is not offered: reliability",
            "publisher",
        )

    def test_a_flood_and_its_end_are_reported(self):
        self.subscriber(more="timeout_ms=60000 flood_limit=500 reliable=0")
        flood = self.rogue("rate=0", "reliable=0", "value=4")
        self.prints("sub: topic 'arm/state': flood of ")
        self.becomes("sub.flood", "TRUE")
        self.assertNotEqual("0", self.value("servo.threadbeat", "subscriber"))
        self.end_rogue(flood)
        self.rogue("rate=20", "reliable=0", "value=5")
        self.becomes("sub.angle", "5")
        self.prints("sub: topic 'arm/state': flood ended: ")
        self.becomes("sub.flood", "FALSE")

    def test_samples_skipped_in_a_flood_do_not_count_as_lost(self):
        self.subscriber(more="timeout_ms=60000 flood_limit=500 depth=4000")
        self.rogue("rate=0", "count=4000", "depth=4000")
        wait_until(
            lambda: int(self.value("sub.received", "subscriber"), 0) > 3900,
            "almost all are counted: the last may be skipped",
        )
        self.assertEqual("0", self.value("sub.lost", "subscriber"))

    def test_a_wrong_publisher_clock_affects_neither_age_nor_validity(self):
        self.subscriber(more="timeout_ms=1000")
        ahead = self.rogue("clock=3600.5", "value=1")
        self.becomes("sub.valid", "TRUE")
        self.prints(
            " s ahead of this machine's; age-ms now counts from the reception of a sample\n"
        )
        self.assertRegex(
            self.words("subscriber"),
            r"sub: topic 'arm/state': the publisher's clock is 3[56]\d\d\.\d{3} s ahead of",
        )
        self.becomes("sub.clock-differs", "TRUE")
        age = float(self.value("sub.age-ms", "subscriber"))
        self.assertTrue(0 <= age < 60000, age)
        self.end_rogue(ahead)
        self.becomes("sub.valid", "FALSE")
        behind = self.rogue("clock=-3600", "value=2")
        self.becomes("sub.angle", "2")
        self.becomes("sub.valid", "TRUE")
        self.assertEqual("TRUE", self.value("sub.clock-differs", "subscriber"))
        self.end_rogue(behind)
        self.rogue("value=3")
        self.becomes("sub.angle", "3")
        self.becomes("sub.clock-differs", "FALSE")
        self.prints(
            "sub: topic 'arm/state': the publisher's clock agrees with this machine's again\n"
        )

    def test_malformed_samples_are_dropped_and_counted(self):
        self.subscriber(more="timeout_ms=60000")
        wrong = self.rogue("bytes=0001000001020304")
        self.prints("sub: topic 'arm/state': dropped a malformed sample of 8 bytes; expected type ")
        wait_until(
            lambda: int(self.value("sub.malformed", "subscriber"), 0) > 2, "they are counted"
        )
        self.assertEqual("FALSE", self.value("sub.valid", "subscriber"))
        self.end_rogue(wrong)
        self.rogue("value=6")
        self.becomes("sub.angle", "6")

    def test_a_publisher_that_sends_nothing_is_reported(self):
        self.publisher()
        self.shell("setp", "pub.enable", "0", instance="publisher")
        self.subscriber(more="silence_ms=200")
        self.becomes("sub.silent", "TRUE")
        self.prints(
            "sub: topic 'arm/state': no sample from the matched publisher for 200 ms; check that it is enabled, "
        )
        self.shell("setp", "pub.enable", "1", instance="publisher")
        self.becomes("sub.silent", "FALSE")
        self.becomes("sub.valid", "TRUE")

    def test_a_program_of_another_origin_reads_what_is_published(self):
        self.publisher(2.25)
        self.assertRegex(self.reads_a_sample(self.rogue("listen")), r"^sample \d+ 2\.250000\n$")

    def test_shared_memory_is_used_on_request_and_cleaned_up_after_a_kill(self):
        publisher = self.publisher(1.5, more="shared_memory=1")
        subscriber = self.subscriber(more="shared_memory=1")
        self.becomes("sub.valid", "TRUE")
        self.assertIn(
            "/dev/shm/fastrtps_", (Path("/proc") / str(publisher.pid) / "maps").read_text()
        )

        def segments(process):
            """The segments that it created: it holds their lock files."""
            held = []
            for fd in (Path("/proc") / str(process.pid) / "fd").iterdir():
                with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                    held.append(str(fd.readlink()))
            return [
                lock[: -len("_el")]
                for lock in held
                if re.fullmatch(r"/dev/shm/fastrtps_[0-9a-f]+_el", lock)
            ]

        left = segments(publisher)
        self.assertTrue(left)

        publisher.send_signal(signal.SIGKILL)
        publisher.wait()
        for path in left:
            self.assertTrue(os.path.exists(path), path)
            os.utime(path + "_el", (1, 1))  # an owner may not have locked a new one yet
        self.publisher(2.5, more="shared_memory=1")
        self.shows("2.5")
        self.assertEqual([], [path for path in left if os.path.exists(path)])
        self.assertRegex(
            self.words("publisher"),
            r"dds: removed \d shared memory segments? of killed processes from /dev/shm \(\d\.\d MB\)\n",
        )
        self.assertTrue(all(map(os.path.exists, segments(subscriber))), "segments in use are kept")

    def test_a_profile_of_Fast_DDS_is_applied(self):
        self.write("profile.xml", PROFILE)
        self.publisher(1.5, more="profile=profile.xml:machine")
        self.subscriber()
        self.prints(
            "sub: topic 'arm/state': a publisher does not offer the requested QoS: ownership"
        )

    def test_invalid_arguments_are_rejected_with_the_reason(self):
        for arguments, reason in (
            ("fields=a:float", "missing topic name; write topic=NAME"),
            (
                "topic=t",
                "missing fields; write fields=angle:float,ready:bit or ros=std_msgs/Float64",
            ),
            (
                "topic=t fields=a:real",
                "fields: 'a:real': unknown type 'real'; types are bit, float, s32, u32, s64, u64 [bad-argument]",
            ),
            (
                "topic=t ros=sensor_msgs/JointState joints=a,b,a",
                "joints: duplicate joint 'a' [bad-argument]",
            ),
            (
                "topic=t ros=std_msgs/Float64 fields=a:bit",
                "ros= cannot be combined with fields= or type=; remove them",
            ),
            (
                "topic=t ros=sensor_msgs/JointState",
                "ros=sensor_msgs/JointState: missing joint names; write joints=shoulder,elbow [bad-argument]",
            ),
            ("topic=t fields=a:bit domain=300", "domain=300 is outside 0..232"),
            ("topic=t fields=a:bit lease_ms=-1", "lease_ms=-1 is outside 0..86400000"),
            (
                f"topic={'t' * 251} fields=a:bit",
                "topic= has 251 characters (limit 250) [bad-argument]",
            ),
            (
                f"topic=t type={'t' * 251} fields=a:bit",
                "type= has 251 characters (limit 250) [bad-argument]",
            ),
            ("topic=t fields=valid:bit", "'sub.valid'"),
        ):
            self.write("bad.hal", f"loadrt dds_subscribe names=sub {arguments}\n")
            self.assertIn(reason, self.bad("check", "bad.hal"), arguments)
        self.write("profile.xml", PROFILE)
        self.write("empty.xml", "no profile\n")
        self.write("bad.hal", "loadrt dds_publish names=pub topic=t fields=a:bit rate=-1\n")
        self.assertIn(
            "rate= is negative; write samples per second, or 0 for every cycle",
            self.bad("check", "bad.hal"),
        )
        for arguments, reason in (
            (
                "interfaces=nosuch0",
                "interfaces: unknown interface or address 'nosuch0'; this machine has ",
            ),
            ("peers=here", "peers: invalid address 'here'; write one like 192.168.1.7"),
            (
                "server=10.0.0.1",
                "server=10.0.0.1: expected ADDRESS:PORT, for example 192.168.1.7:11811",
            ),
            ("security=nowhere", "security: no such folder: "),
            ("profile=none.xml", "profile: no such file: "),
            ("profile=empty.xml", "empty.xml; see its own message"),
            (
                "profile=profile.xml:robot",
                "profile.xml has no participant profile 'robot'; write profile=",
            ),
            (
                "\nloadrt dds_subscribe names=two topic=t fields=a:float",
                "topic 't' is already in use in this process with type hal::Pins_",
            ),
        ):
            self.write(
                "bad.hal",
                f"loadrt threads name1=servo period1=1000000\nloadrt dds_subscribe names=sub topic=t fields=a:bit {arguments}\n",
            )
            self.assertIn(
                reason, self.run_program("run", "--for", "10ms", "bad.hal").stderr, arguments
            )

    @unittest.skipIf(SANITIZED, "a sanitizer has the functions of the clock")
    def test_what_was_received_is_executed_again_from_the_journal(self):
        more = f"domain={DOMAIN} timeout_ms=200"
        journaled = ["--values", "*", "--journal"]
        publisher = self.machine(
            "publisher", PUBLISH.format(angle=2.5, more=f"domain={DOMAIN}"), *journaled, "out.mcap"
        )
        subscriber = self.machine(
            "subscriber", SUBSCRIBE.format(fields=FIELDS, more=more), *journaled, "in.mcap"
        )
        self.shows("2.5", "TRUE", "0", "-5")
        self.good("shell", "--name", "publisher", given="setp pub.angle 3.5\n")
        self.shows("3.5", "TRUE", "0", "-5")
        wait_until(lambda: int(self.value("pub.sent", "publisher")) > 100, "samples")
        self.end_quietly(publisher)
        self.becomes("sub.valid", "FALSE")
        self.end_quietly(subscriber)
        self.environment["HALCYON_LINKS_INSIDE"] = "1"  # no DDS
        for journal in ("out.mcap", "in.mcap"):
            done = self.run_program("replay", "--exact", journal)
            self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
            self.assertRegex(done.stdout, r"\nno difference, \d{4,} values compared\n$")


if __name__ == "__main__":
    unittest.main()
