# SPDX-License-Identifier: MIT
# packages: scocan
"""hal scocan: tables of a CAN bus with time slots; and a bus between two processes on udp:."""

import json
import os
import random
import unittest
import xml.etree.ElementTree

from harness import Case, wait_until

ROBOT = """bitrate 1M
node clock A sync
node motor A
node sonar B
mode 0 run
0 sync
2 private motor 0x10A
mode 1 fast
0 sync
2 private motor 0x10A
12 private motor 0x10A
message alarm 0x010 node motor event 50ms bytes 1
message position 0x10A period 10ms fields a:s32,b:s32
message echo 0x310 node sonar period 6.4ms
"""

# Times of a busy machine, not of a bus.
SLOW = """bitrate 1M
cycle 200ms
slots 4
guard 5ms
idle 30ms
lost 50
node clock A sync
node motor A
mode 0 run
0 sync
1 private motor 0x10A
message position 0x10A fields a:s32,b:s32
message lamp 0x300 node clock period 400ms fields on:u8
"""

NETLIST = """loadrt threads name1=servo period1=1000000
loadrt {component} link={bus} config=slow.scocan node={node}
addf {instance}.receive servo
addf {instance}.transmit servo
start
"""


class Plan(Case):
    def test_plan(self):
        self.write("robot.scocan", ROBOT)
        text = self.good("scocan", "plan", "robot.scocan")
        self.assertIn(
            "cycle 10 ms, 20 slots of 500 us at 1000000 bit/s; guard 4 us, idle 16 us; CRC ", text
        )
        self.assertIn("|.b.................\n| SYNC, . shared, b motor\n", text)
        self.assertIn(
            "frames of 8 bytes in a shared slot: 3; in an idle private slot: 3 by nodes of type A, 2 by type B\n",
            text,
        )
        self.assertIn(
            "0x10A position: 10.000 to the next turn of its slot + 0.004 guard + 0.135 frame = 10.139 ms\n",
            text,
        )
        plan = json.loads(self.good("scocan", "plan", "robot.scocan", "--json"))
        self.assertTrue(plan["fits"])
        position = next(m for m in plan["messages"] if m["name"] == "position")
        self.assertEqual(
            (True, 10139000, 4000),
            (position["private"], position["worst_ns"], position["jitter_ns"]),
        )
        self.assertGreater(position["plain_jitter_ns"], 100_000)
        for m in plan["messages"]:
            self.assertIn(f"= {m['worst_ns'] / 1e6:.3f} ms\n", text)
        fast = json.loads(self.good("scocan", "plan", "robot.scocan", "--json", "--mode", "fast"))
        self.assertEqual(
            5139000, next(m for m in fast["messages"] if m["name"] == "position")["worst_ns"]
        )
        self.assertEqual(
            "hal scocan plan: unknown mode 'slow'; modes of robot.scocan: 0 (run), 1 (fast)\n",
            self.bad("scocan", "plan", "robot.scocan", "--mode", "slow"),
        )

    def test_picture(self):
        self.write("robot.scocan", ROBOT)
        self.assertEqual("", self.good("scocan", "plan", "robot.scocan", "--svg", "robot.svg"))
        picture = (self.folder / "robot.svg").read_text()
        xml.etree.ElementTree.fromstring(picture)
        self.assertIn("0x10A position", picture)
        self.assertEqual(picture, self.good("scocan", "plan", "robot.scocan", "--svg", "-"))
        self.assertEqual(
            "hal scocan plan: --json and --svg exclude each other\n",
            self.bad("scocan", "plan", "robot.scocan", "--json", "--svg", "robot.svg"),
        )

    def test_what_cannot_work(self):
        self.write("robot.scocan", ROBOT.replace("1M", "250k"))
        self.assertIn(
            "robot.scocan:7:1: error: slot 2 is too short for 0x10A: 8 bytes take 135 bits + 20 bits for an error at 250000 bit/s, with the guard of "
            "13 us 633 us; the slot has 500 us [scocan-",
            self.bad("scocan", "plan", "robot.scocan"),
        )
        self.write("robot.scocan", ROBOT + "message flood 0x311 node sonar event 200us\n")
        done = self.run_program("scocan", "plan", "robot.scocan")
        self.assertEqual(1, done.returncode)
        self.assertIn("  LATE\n", done.stdout)
        self.assertIn(
            "robot.scocan:15:9: error: late message 0x311 flood: unbounded: ", done.stderr
        )
        self.assertIn("= help: give it a private slot", done.stderr)
        self.write(
            "robot.scocan", ROBOT.replace("period 10ms fields", "period 10ms deadline 8ms fields")
        )
        done = self.run_program("scocan", "plan", "robot.scocan")
        self.assertEqual(1, done.returncode)
        self.assertIn(
            "robot.scocan:13:9: error: late message 0x10A position: 10.000 to the next turn of its slot + 0.004 guard + "
            "0.135 frame = 10.139 ms, deadline 8.000 ms [scocan-slots]\n",
            done.stderr,
        )
        self.write("robot.scocan", ROBOT.replace("fields a:s32", "fields send:s32"))
        self.assertIn(
            "robot.scocan:13:43: error: reserved field name 'send' [scocan-",
            self.bad("scocan", "plan", "robot.scocan"),
        )
        self.assertEqual(
            "hal scocan plan: cannot read 'none.scocan': No such file or directory\n",
            self.bad("scocan", "plan", "none.scocan"),
        )


class Processes(Case):
    def test_two_processes_on_udp(self):
        place = random.Random(os.urandom(8))
        bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"
        self.write("slow.scocan", SLOW)
        for name, component, instance in (
            ("clock", "scocan_sync", "scocan-sync.0"),
            ("motor", "scocan", "scocan.0"),
        ):
            self.write(
                f"{name}.hal",
                NETLIST.format(component=component, bus=bus, node=name, instance=instance),
            )
            self.start("run", f"{name}.hal", "--name", name, instance=name)
        wait_until(
            lambda: self.value("scocan.0.running", "motor") == "TRUE", "the node follows the SYNC"
        )
        self.shell("setp", "scocan.0.position.a", "-42", instance="motor")
        wait_until(
            lambda: self.value("scocan-sync.0.position.a", "clock") == "-42", "the message arrives"
        )
        wait_until(
            lambda: int(self.value("scocan.0.lamp.received", "motor")) > 2,
            "the shared message arrives",
        )
        self.assertEqual("TRUE", self.value("scocan-sync.0.leading", "clock"))


if __name__ == "__main__":
    unittest.main()
