#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Two machines on a topic, and what may go wrong: one is killed, one has another type, a flood, a clock that is off, bytes of nobody."""
import os
import re
import signal
import unittest

from pathlib import Path

from rig import DdsCase, wait_until

# The participant stays on this machine; the writer of the topic does not fit dds_subscribe's readers.
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


class Topics(DdsCase):
    def test_a_killed_publisher_is_noticed_and_its_successor_is_taken(self):
        publisher = self.publisher(1.5)
        self.subscriber(more="timeout_ms=300")
        self.becomes("sub.valid", "TRUE")
        self.shows("1.5", "TRUE", "0", "-5")
        self.becomes("sub.matched", "1")
        self.becomes("pub.matched", "1", "publisher")
        wait_until(lambda: 0 < float(self.value("sub.age-ms", "subscriber")) < 300, "a sample is no older than that")

        publisher.send_signal(signal.SIGKILL)
        publisher.wait()
        self.becomes("sub.valid", "FALSE")
        self.says("sub: no sample of topic 'arm/state' for more than 300 ms; its pins are not valid\n")
        self.assertEqual(["-1", "FALSE", "0", "-5"], [self.value("sub." + pin, "subscriber") for pin in ("angle", "ready", "count-0", "count-1")])
        self.assertRegex(self.shell("show", "fault", instance="subscriber").stdout, r"no sample of topic 'arm/state' for \d+\.\d+ s \(limit 300 ms\)")

        self.publisher(2.5)
        self.shows("2.5", "TRUE")
        self.says("sub: topic 'arm/state' is valid again\n")

    def test_nothing_is_lost_in_reliable_mode(self):
        self.subscriber(more="timeout_ms=60000 depth=4000")  # so many may wait here for one that is sent again
        self.stranger("rate=2000", "count=4000", "depth=4000")  # all are kept until they are there
        self.becomes("sub.received", "4000")
        self.becomes("sub.lost", "0")
        self.becomes("sub.seq", "4000")

    def test_a_second_publisher_is_ignored_and_named(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=2000")
        self.becomes("sub.valid", "TRUE")
        stranger = self.stranger("rate=100", "value=9")
        self.becomes("sub.second-publisher", "TRUE")
        self.assertEqual("1.5", self.value("sub.angle", "subscriber"), "the first one has it")
        self.assertGreater(int(self.value("sub.ignored", "subscriber")), 0)
        self.says("sub: topic 'arm/state' has a second publisher, ")
        self.assertRegex(self.words("subscriber"), r"second publisher, (\S+ \()?[0-9a-f]{24}\)?, beside (\S+ \()?[0-9a-f]{24}\)?; its samples are ignored")
        self.assertRegex(self.shell("show", "fault", instance="subscriber").stdout,
                         r"a second publisher writes topic 'arm/state' at cycle [\d ]+; its samples are ignored")
        self.end_stranger(stranger)
        self.becomes("sub.second-publisher", "FALSE")
        self.assertEqual(["1.5", "TRUE"], [self.value("sub." + pin, "subscriber") for pin in ("angle", "valid")])

    def test_samples_of_all_publishers_are_taken_when_asked_for(self):
        self.publisher(1.5)
        self.subscriber(more="timeout_ms=2000 exclusive=0")
        self.becomes("sub.valid", "TRUE")
        self.stranger("rate=200", "value=9")
        self.becomes("sub.angle", "9")
        self.says("; the samples of both are taken. To take those of one: exclusive=1")
        self.assertEqual("0", self.value("sub.ignored", "subscriber"))

    def test_another_type_is_named_on_both_sides(self):
        self.publisher()
        self.subscriber("angle:float,ready:bit")
        self.says("sub: topic 'arm/state' has the type ")
        self.becomes("sub.wrong-type", "TRUE")
        self.becomes("pub.wrong-type", "TRUE", "publisher")
        line = next(l for l in self.words("subscriber").splitlines() if "has the type" in l)
        names = [w for w in line.split() if w.startswith("hal::Pins_")]
        self.assertEqual(2, len(set(names)), line)
        self.assertEqual(f"sub: topic 'arm/state' has the type {names[0]} here and {names[1]} at a publisher elsewhere; nothing is exchanged with it", line)
        self.says(f"pub: topic 'arm/state' has the type {names[1]} here and {names[0]} at a subscriber elsewhere; nothing is exchanged with it", "publisher")
        self.assertEqual("FALSE", self.value("sub.valid", "subscriber"))

    def test_less_is_offered_than_is_asked_for(self):
        self.publisher(more="reliable=0")
        self.subscriber()
        self.says("sub: a publisher of topic 'arm/state' offers less than is asked for: reliability (best effort is offered, reliable is asked for)\n")
        self.says("pub: a subscriber of topic 'arm/state' asks for more than is offered: reliability", "publisher")

    def test_a_flood_is_said_and_ends(self):
        self.subscriber(more="timeout_ms=60000 flood_limit=500 reliable=0")
        flood = self.stranger("rate=0", "reliable=0", "value=4")
        self.says("sub: topic 'arm/state' is a flood: ")
        self.becomes("sub.flood", "TRUE")
        self.assertNotEqual("0", self.value("servo.threadbeat", "subscriber"))
        self.end_stranger(flood)
        self.stranger("rate=20", "reliable=0", "value=5")
        self.becomes("sub.angle", "5")
        self.says("sub: topic 'arm/state' is no flood any more: ")
        self.becomes("sub.flood", "FALSE")

    def test_what_of_a_flood_is_not_looked_at_is_not_lost(self):
        self.subscriber(more="timeout_ms=60000 flood_limit=500 depth=4000")
        self.stranger("rate=0", "count=4000", "depth=4000")
        wait_until(lambda: int(self.value("sub.received", "subscriber"), 0) > 3900, "almost all are shown: the last may not be looked at")
        self.assertEqual("0", self.value("sub.lost", "subscriber"))

    def test_a_clock_that_is_off_does_not_make_samples_old_or_valid(self):
        self.subscriber(more="timeout_ms=1000")
        ahead = self.stranger("clock=3600.5", "value=1")
        self.becomes("sub.valid", "TRUE")
        self.says(" s ahead of this machine's; age-ms counts from when a sample comes\n")
        self.assertRegex(self.words("subscriber"), r"sub: topic 'arm/state': its publisher's clock is 3[56]\d\d\.\d{3} s ahead of")
        self.becomes("sub.clock-differs", "TRUE")
        age = float(self.value("sub.age-ms", "subscriber"))
        self.assertTrue(0 <= age < 60000, age)
        self.end_stranger(ahead)
        self.becomes("sub.valid", "FALSE")
        behind = self.stranger("clock=-3600", "value=2")
        self.becomes("sub.angle", "2")
        self.becomes("sub.valid", "TRUE")
        self.assertEqual("TRUE", self.value("sub.clock-differs", "subscriber"))
        self.end_stranger(behind)
        self.stranger("value=3")
        self.becomes("sub.angle", "3")
        self.becomes("sub.clock-differs", "FALSE")
        self.says("sub: topic 'arm/state': its publisher's clock agrees again\n")

    def test_bytes_that_are_not_of_the_type_are_counted(self):
        self.subscriber(more="timeout_ms=60000")
        wrong = self.stranger("bytes=0001000001020304")
        self.says("sub: topic 'arm/state': a sample of 8 bytes is not of the type ")
        wait_until(lambda: int(self.value("sub.malformed", "subscriber"), 0) > 2, "they are counted")
        self.assertEqual("FALSE", self.value("sub.valid", "subscriber"))
        self.end_stranger(wrong)
        self.stranger("value=6")
        self.becomes("sub.angle", "6")

    def test_a_publisher_that_says_nothing_is_noticed(self):
        self.publisher()
        self.shell("setp", "pub.enable", "0", instance="publisher")
        self.subscriber(more="silence_ms=200")
        self.becomes("sub.silent", "TRUE")
        self.says("sub: topic 'arm/state' has a publisher and no sample has come for 200 ms; is it enabled, ")
        self.shell("setp", "pub.enable", "1", instance="publisher")
        self.becomes("sub.silent", "FALSE")
        self.becomes("sub.valid", "TRUE")

    def test_a_stranger_reads_what_is_published(self):
        self.publisher(2.25)
        self.assertRegex(self.reads_a_sample(self.stranger("listen")), r"^sample \d+ 2\.250000\n$")

    def test_shared_memory_carries_it_when_asked(self):
        publisher = self.publisher(1.5, more="shared_memory=1")
        subscriber = self.subscriber(more="shared_memory=1")
        self.becomes("sub.valid", "TRUE")
        self.assertIn("/dev/shm/fastrtps_", (Path("/proc") / str(publisher.pid) / "maps").read_text())

        def segments(process):
            """Those it has made: it holds the files that lock them."""
            held = [str(fd.readlink()) for fd in (Path("/proc") / str(process.pid) / "fd").iterdir()]
            return [lock[:-len("_el")] for lock in held if re.fullmatch(r"/dev/shm/fastrtps_[0-9a-f]+_el", lock)]
        left = segments(publisher)
        self.assertTrue(left)

        publisher.send_signal(signal.SIGKILL)
        publisher.wait()
        for path in left:
            self.assertTrue(os.path.exists(path), path)
            os.utime(path + "_el", (1, 1))  # who has just made one may not have locked it yet
        self.publisher(2.5, more="shared_memory=1")
        self.shows("2.5")
        self.assertEqual([], [path for path in left if os.path.exists(path)])
        self.assertRegex(self.words("publisher"), r"dds: removed from /dev/shm what killed processes have left: \d segments? of shared memory, \d\.\d MB\n")
        self.assertTrue(all(map(os.path.exists, segments(subscriber))), "those that are in use stay")

    def test_a_profile_of_fast_dds_counts(self):
        self.write("profile.xml", PROFILE)
        self.publisher(1.5, more="profile=profile.xml:machine")
        self.subscriber()
        self.says("sub: a publisher of topic 'arm/state' offers less than is asked for: ownership")

    def test_what_cannot_be_loaded_is_refused_with_the_reason(self):
        for arguments, reason in (("fields=a:float", "which topic? write topic=NAME"),
                                  ("topic=t", "which pins? write fields=angle:float,ready:bit or ros=std_msgs/Float64"),
                                  ("topic=t fields=a:real", "fields: 'a:real': unknown type 'real'; there are bit, float, s32, u32, s64, u64 [bad-argument]"),
                                  ("topic=t ros=sensor_msgs/JointState joints=a,b,a", "joints: there are two joints 'a' [bad-argument]"),
                                  ("topic=t ros=std_msgs/Float64 fields=a:bit", "ros= gives the fields and the type; leave fields= and type= out"),
                                  ("topic=t ros=sensor_msgs/JointState", "ros=sensor_msgs/JointState needs the names of its joints: joints=shoulder,elbow [bad-argument]"),
                                  ("topic=t fields=a:bit domain=300", "domain=300 is outside 0..232"),
                                  ("topic=t fields=a:bit lease_ms=-1", "lease_ms=-1 is outside 0..86400000"),
                                  (f"topic={'t' * 251} fields=a:bit", "topic= has more than 250 letters; make it shorter [bad-argument]"),
                                  (f"topic=t type={'t' * 251} fields=a:bit", "type= has more than 250 letters; make it shorter [bad-argument]"),
                                  ("topic=t fields=valid:bit", "'sub.valid'")):
            self.write("bad.hal", f"loadrt dds_subscribe names=sub {arguments}\n")
            self.assertIn(reason, self.bad("check", "bad.hal"), arguments)
        self.write("profile.xml", PROFILE)
        self.write("empty.xml", "no profile\n")
        self.write("bad.hal", "loadrt dds_publish names=pub topic=t fields=a:bit rate=-1\n")
        self.assertIn("rate= is below 0; write samples per second, or 0 for every cycle", self.bad("check", "bad.hal"))
        for arguments, reason in (("interfaces=nosuch0", "interfaces: this machine has no interface or address 'nosuch0'; it has "),
                                  ("peers=here", "peers: 'here' is not an address, as in 192.168.1.7"),
                                  ("server=10.0.0.1", "server=10.0.0.1 is not an address and a port, as in 192.168.1.7:11811"),
                                  ("security=nowhere", "security: there is no folder "),
                                  ("profile=none.xml", "profile: there is no file "),
                                  ("profile=empty.xml", "empty.xml; its own message says where"),
                                  ("profile=profile.xml:robot", "profile.xml has no participant profile 'robot'; write profile="),
                                  ("\nloadrt dds_subscribe names=two topic=t fields=a:float", "topic 't' has the type hal::Pins_")):
            self.write("bad.hal", f"loadrt threads name1=servo period1=1000000\nloadrt dds_subscribe names=sub topic=t fields=a:bit {arguments}\n")
            self.assertIn(reason, self.run_program("run", "--for", "10ms", "bad.hal").stderr, arguments)


if __name__ == "__main__":
    unittest.main()
