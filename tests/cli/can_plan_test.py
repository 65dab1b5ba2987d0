#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""`hal canopen plan` and `check`: response times of a configuration and of a recording, errors, queues, and what is wrong with the input."""
import json
import re
import unittest
import xml.etree.ElementTree

from harness import Case

PLAN = """# three messages of 1 ms
[bus]
bitrate = 125k
heartbeat = none
[messages]
0x100 A = 7, 2.5ms
0x101 B = 7, 3.5ms, 3.25ms
0x102 C = 7, 3.5ms, 3.25ms
"""

AXES = """[bus]
link = sim:arm
sync = 1ms
[type drive]
device = cia402
tpdo1 = statusword, position-actual-value
rpdo1 = controlword, target-position
"""


class Plan(Case):
    def test_refusal_with_the_arithmetic_and_what_to_change(self):
        done = self.run_program(
            "canopen", "plan", self.write("plan.canopen", PLAN) and "plan.canopen"
        )
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            "      id   bytes   bits   period ms    deadline       worst    used\n"
            "     100       7    125       2.500       2.500       2.000    80 %  A\n"
            "     101       7    125       3.500       3.250       3.000    92 %  B\n"
            "     102       7    125       3.500       3.250       3.500   108 %  LATE C\n"
            "3 messages at 125000 bit/s: load 97.1 % with all stuff bits\n",
            done.stdout,
        )
        self.assertEqual(
            "plan.canopen:8: 102 (C) needs 3.500 ms, deadline 3.250 ms: 1.000 for 1 earlier instances of itself + 3 x 1.000 for 100 "
            "+ 2 x 1.000 for 101 + 1.000 for itself - 3.500 since it was due\n"
            "  = help: with bitrate = 250k every message meets its deadline\n"
            "  = help: with every period 10 % longer and unchanged deadlines, every message meets its deadline\n",
            done.stderr,
        )

    def test_good_plan(self):
        self.write("plan.canopen", PLAN.replace("125k", "250k"))
        self.assertIn("load 48.6 %", self.good("canopen", "plan", "plan.canopen"))
        self.assertTrue(json.loads(self.good("canopen", "plan", "plan.canopen", "--json"))["fits"])

    def test_axes_of_a_millisecond(self):
        nodes = lambda count: "".join(
            f"[node {n} axis-{n}]\ntype = drive\n" for n in range(1, count + 1)
        )
        self.write("arm.canopen", AXES + nodes(4))
        self.assertIn(
            "9 frames with each SYNC of 1 ms take 0.975 ms at most: 97.5 %\n",
            self.run_program("canopen", "plan", "arm.canopen").stdout,
        )
        self.write("arm.canopen", AXES.replace("1ms", "cycle") + nodes(8))
        self.assertIn(
            "17 frames with each SYNC of 2 ms take 1.895 ms at most: 94.8 %\n",
            self.run_program("canopen", "plan", "arm.canopen", "--cycle", "2ms").stdout,
        )
        done = self.run_program("canopen", "plan", "arm.canopen")
        self.assertEqual(1, done.returncode)
        self.assertIn(
            "17 frames with each SYNC of 1 ms take 1.895 ms at most: 189.5 %\n", done.stdout
        )
        self.assertIn(
            "  = help: the SYNC is sent every cycle of the thread, assumed to be 1ms; for another period add: --cycle 2ms\n",
            done.stderr,
        )

    def test_a_cycle_without_effect_is_an_error(self):
        self.write("plan.canopen", PLAN.replace("125k", "250k"))
        self.assertEqual(
            "hal canopen plan: --cycle has no effect: plan.canopen sends no SYNC in every cycle; delete --cycle, or write `sync = cycle` in [bus]\n",
            self.bad("canopen", "plan", "plan.canopen", "--cycle", "2ms"),
        )
        self.write("bus.log", "(1.0) can0 181#\n(1.1) can0 181#\n")
        self.assertEqual(
            "hal canopen plan: --cycle is for configurations; a recording has its own SYNCs\n",
            self.bad("canopen", "plan", "bus.log", "--bitrate", "1M", "--cycle", "2ms"),
        )

    def test_picture(self):
        self.write("plan.canopen", PLAN.replace("125k", "250k"))
        self.assertEqual("", self.good("canopen", "plan", "plan.canopen", "--svg", "plan.svg"))
        picture = (self.folder / "plan.svg").read_text()
        drawn = xml.etree.ElementTree.fromstring(picture)
        texts = [t.text for t in drawn.iter("{http://www.w3.org/2000/svg}text")]
        self.assertIn("Worst-case response time of each message and its deadline, ms", texts)
        self.assertEqual(1, sum(text.startswith("102 C") for text in texts))
        self.assertEqual(picture, self.good("canopen", "plan", "plan.canopen", "--svg", "-"))
        self.assertEqual(
            "hal canopen plan: --json and --svg exclude each other\n",
            self.bad("canopen", "plan", "plan.canopen", "--json", "--svg", "plan.svg"),
        )

    def test_a_late_message_is_drawn_and_reported(self):
        self.write("plan.canopen", PLAN)
        done = self.run_program("canopen", "plan", "plan.canopen", "--svg", "plan.svg")
        self.assertEqual(1, done.returncode)
        self.assertIn("plan.canopen:8: 102 (C) needs 3.500 ms", done.stderr)
        self.assertTrue((self.folder / "plan.svg").exists())

    def test_a_bus_in_Ethernet_frames_has_another_plan(self):
        self.write(
            "arm.canopen", AXES.replace("sim:arm", "cane:sim:arm") + "[node 1 x]\ntype = drive\n"
        )
        self.assertEqual(
            "hal canopen plan: arm.canopen uses Ethernet (cane:sim:arm), where identifiers do not arbitrate; for its schedule type: "
            "hal tdma plan FILE.tdma\n",
            self.bad("canopen", "plan", "arm.canopen"),
        )

    def test_all_wrong_lines_are_named(self):
        self.write(
            "plan.canopen",
            "[bus]\n[messages]\n0x100 = 9, 1ms\n0x100 = 8, soon\nxyz = 8, 1ms\n0x101 = 8\n0x102 = 8, 1ms\n0x102 = 4, 2ms\n0x103 = 8, 5\n",
        )
        said = self.bad("canopen", "plan", "plan.canopen")
        for line in (
            "plan.canopen:3:9: error: invalid length '9' [canopen-value]",
            "plan.canopen:4:12: error: invalid period 'soon' [canopen-value]",
            "plan.canopen:5:1: error: invalid identifier 'xyz' [canopen-value]",
            "plan.canopen:6:9: error: invalid message: expected BYTES, PERIOD, DEADLINE, JITTER, QUEUE [canopen-value]",
            "plan.canopen:8:1: error: duplicate identifier: also used in line 7 [canopen-node]",
            "plan.canopen:9:12: error: invalid period '5' [canopen-value]",
        ):
            self.assertIn(line, said.splitlines())
        self.assertEqual(
            "hal canopen plan: cannot read 'none.canopen': No such file or directory\n",
            self.bad("canopen", "plan", "none.canopen"),
        )

    def test_errors_and_queues_in_order_of_arrival(self):
        self.write(
            "car.canopen",
            "[bus]\nbitrate = 125k\nheartbeat = none\n[messages]\n0x010 alarm = 1, 50ms\n0x100 A = 7, 10ms, 10ms, 100us\n"
            + "".join(f"0x31{n} burst-{n} = 8, 25.6ms, -, 100us, sonar\n" for n in range(3)),
        )
        plan = lambda *more: [
            row["worst_ns"] // 1000
            for row in json.loads(self.good("canopen", "plan", "car.canopen", "--json", *more))[
                "messages"
            ]
        ]
        self.assertEqual([1600, 2700, 5940, 5940, 5940], plan())
        self.assertEqual([2368, 3948, 7268, 7268, 7268], plan("--errors", "1/10ms"))
        self.assertIn(
            "; errors: 1 at once and 1 in every 10.000 ms\n",
            self.good("canopen", "plan", "car.canopen", "--errors", "1/10ms"),
        )
        for wrong in ("x", "0", "1/", "1/x", "1/1ns"):
            self.assertEqual(
                f"hal canopen plan: invalid --errors '{wrong}'; write --errors 1/10ms\n",
                self.bad("canopen", "plan", "car.canopen", "--errors", wrong),
            )
        self.write(
            "car.canopen", (self.folder / "car.canopen").read_text().replace("25.6ms", "2ms")
        )
        self.assertIn(
            "car.canopen:7: 310 (burst-0) needs more than the bus has, deadline 2.000 ms\n",
            self.bad("canopen", "plan", "car.canopen"),
        )

    def test_a_recording(self):
        rows = [
            (n * 0.01 + (0.0004 if n % 4 == 3 else 0), "181#0102030405060708") for n in range(200)
        ] + [(n * 0.02 + 0.001, "201#01020304") for n in range(100)]
        rows += [(0.5, "081#"), (0.52, "081#"), (0.9, "081#"), (1.0, "000#0100")]
        self.write(
            "bus.log",
            "".join(f"({1000 + time:.6f}) can0 {frame}\n" for time, frame in sorted(rows)),
        )
        said = self.good("canopen", "plan", "bus.log", "--bitrate", "250k")
        self.assertEqual(
            "      id   bytes   bits   period ms    deadline       worst    used\n"
            "     081       0     55      20.000      20.000       0.760     4 %  3 frames, irregular\n"
            "     181       8    135      10.000      10.000       1.549    15 %  200 frames\n"
            "     201       4     95      20.000      20.000       1.140     6 %  100 frames\n"
            "1 irregular: their period is the shortest distance between two frames\n"
            "1 identifier was seen once: not counted\n"
            "3 messages at 250000 bit/s: load 8.4 % with all stuff bits\n",
            said,
        )
        self.assertIn(
            "bus.log: 181 (200 frames) may never be sent: with the messages before it, it needs 162.5 % of the bus time\n",
            self.bad("canopen", "plan", "bus.log", "--bitrate", "10k"),
        )
        self.assertEqual(
            "hal canopen plan: bus.log: a recording does not contain the bit rate; type: hal canopen plan bus.log --bitrate 500k\n",
            self.bad("canopen", "plan", "bus.log"),
        )
        self.assertEqual(
            "hal canopen plan: invalid --bitrate 'fast'; write 500k, 1M or 125000\n",
            self.bad("canopen", "plan", "bus.log", "--bitrate", "fast"),
        )
        self.assertEqual(
            "hal canopen plan: none.log: cannot read it: No such file or directory\n",
            self.bad("canopen", "plan", "none.log", "--bitrate", "1M"),
        )
        self.write("once.log", "(1.0) can0 181#\n")
        self.assertEqual(
            "hal canopen plan: once.log: no message is in it twice: record for longer\n",
            self.bad("canopen", "plan", "once.log", "--bitrate", "1M"),
        )

    def test_check_lists_the_pins(self):
        self.write(
            "arm.canopen",
            AXES + "[node 5 elbow]\ntype = drive\ntarget-position.scale = 65536/360\n",
        )
        self.assertEqual(
            "arm.canopen: sim:arm at 1000000 bit/s, master 127, 1 node\n"
            "node 5 elbow, mandatory\n"
            "  rpdo1 205, 6 bytes, with every SYNC\n"
            "    u32   in  elbow.controlword  6040 Controlword\n"
            "    float in  elbow.target-position  607A Target position, 182.044 to one\n"
            "  tpdo1 185, 6 bytes, with every SYNC\n"
            "    u32   out elbow.statusword  6041 Statusword\n"
            "    s32   out elbow.position-actual-value  6064 Position actual value\n",
            self.good("canopen", "check", "arm.canopen"),
        )

    def test_check_finds_what_a_run_would_refuse(self):
        """Names that every node has as pins of its own: as the running component lists them."""
        arm = "[bus]\nlink = sim:own\n[node 5 elbow]\ndevice = cia402\nrpdo1 = controlword, target-position\n"
        self.write("arm.canopen", arm)
        self.write("pins.hal", "loadrt canopen config=arm.canopen\nshow pin canopen.0.elbow\n")
        names = set(re.findall(r"canopen\.0\.elbow\.(\S+)", self.good("sim", "pins.hal"))) - {
            "controlword",
            "target-position",
        }
        self.assertGreaterEqual(len(names), 12)
        for name in sorted(names):
            self.write("arm.canopen", arm + f"controlword.name = {name}\n")
            self.assertIn(
                f"arm.canopen:5:9: error: pin '{name}' exists on every node [canopen-object]",
                self.bad("canopen", "check", "arm.canopen"),
            )
        self.write("arm.canopen", arm + "tpdo1 = statusword, target-position\n")
        self.assertIn(
            "  tpdo1 185, 6 bytes, when changed\n    u32   out elbow.statusword  6041 Statusword\n"
            "    s32   out elbow.target-position-feedback  607A Target position\n",
            self.good("canopen", "check", "arm.canopen"),
        )


if __name__ == "__main__":
    unittest.main()
