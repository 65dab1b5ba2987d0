# SPDX-License-Identifier: MIT
"""hal tdma plan: schedules of an Ethernet segment."""
import json
import unittest
import xml.etree.ElementTree

from harness import ROOT, Case

CELL = """master:
cycle 1000
slot 0 100 1/1 46

backup-master:
name spare
backup-offset 50
phase 30
slot 0 200 1/1 46

slave:
name x
slot 0 300 1/2 46
"""

PLAN = """cycle 1000 us at 100 Mbit/s, guard 10 us: 3 stations, 3 slots

  from us      until       free  station          use           bytes  cycles
     0.00       6.72      43.28  master           sync             60  all
    50.00      56.72      43.28  spare            backup sync      60  all
   100.00     106.72      93.28  master           slot 0           60  all
   200.00     206.72      93.28  spare            slot 0           60  all
   300.00     306.72     693.28  x                slot 0           60  1 of 2

|....'....a.........b.........c.....................................................................
a master, b spare, c x

load 2.4 % with every frame of its full length; a frame of 60 bytes takes 6.72 us on a line, 15.44 us from station to station
spare looks 30 us after the beginning of the cycle and takes over 50 us after the sync that did not come
outputs are safe 4 cycles after the last sync: 4000 us
spare: an input of it becomes an output of it after 3000.00 us at worst, 2 cycles after it was read
  read 30.00, sent 200.00 (slot 0), there 215.44; master's thread 1000.00, sent 1100.00, there 1115.44; written 2030.00
  2030.00 - 30.00 + 1000.00 for an input that changed just after it was read = 3000.00 us
x: an input of it becomes an output of it after 4000.00 us at worst, 3 cycles after it was read
  read 0.00, sent 1300.00 (slot 0), there 1315.44; master's thread 2000.00, sent 2100.00, there 2115.44; written 3000.00
  3000.00 - 0.00 + 1000.00 for an input that changed just after it was read = 4000.00 us
"""


class Tdma(Case):
    def test_plan(self):
        self.write("cell.tdma", CELL)
        self.assertEqual(PLAN, self.good("tdma", "plan", "cell.tdma"))
        plan = json.loads(self.good("tdma", "plan", "cell.tdma", "--json"))
        self.assertEqual(5, len(plan["entries"]))
        self.assertEqual({"station": "x", "worst_ns": 4000000, "cycles": 3}, plan["latency"][1])

    def test_picture(self):
        """The drawings beside the machines are what comes of their schedules."""
        for machine in ("ethernet-cnc/cnc", "ethernet-furuta/furuta"):
            folder, name = (ROOT / "halfiles" / machine).parent, machine.split("/")[1]
            self.assertEqual((folder / "timing.svg").read_text(), self.good("tdma", "plan", folder / f"{name}.tdma", "--svg", "-"),
                             f"make it anew: hal tdma plan halfiles/{machine}.tdma --svg halfiles/{machine.split('/')[0]}/timing.svg")

    def test_picture_into_a_file(self):
        self.write("cell.tdma", CELL)
        self.assertEqual("", self.good("tdma", "plan", "cell.tdma", "--svg", "cell.svg"))
        drawn = xml.etree.ElementTree.parse(self.folder / "cell.svg").getroot()
        texts = [t.text for t in drawn.iter("{http://www.w3.org/2000/svg}text")]
        for wanted in ("master", "spare", "x", "300, 1 of 2 cycles",
                       "The line is 2.4 % full; an input of x is an output of it after 4000 us at worst"):
            self.assertIn(wanted, texts)
        self.assertEqual("hal tdma plan: cannot write 'none/cell.svg': No such file or directory\n",
                         self.bad("tdma", "plan", "cell.tdma", "--svg", "none/cell.svg"))
        self.assertEqual("hal tdma plan: --json and --svg are two answers; write one of them\n",
                         self.bad("tdma", "plan", "cell.tdma", "--json", "--svg", "cell.svg"))

    def test_a_recording_says_what_is_missing(self):
        for words, problem in (("", "into which file? write file=seen.pcapng"),
                               ("file=none/seen.pcapng", "none/seen.pcapng cannot be written: No such file or directory"),
                               ("file=seen.pcapng link=sim:", "sim:: the name of the segment is missing; write sim:net0")):
            self.write("record.hal", f"loadrt segment_record {words}\nstart\n")
            self.assertIn(f"error: 'segment-record.0' (segment_record) cannot start: {problem} [start-failed]\n", self.bad("sim", "record.hal"))

        self.write("full.hal", "loadrt threads name1=servo period1=1000000\nloadrt segment_record link=sim:net0/recorder file=/dev/full\n"
                   'loadrt tdma link=sim:net0/master station=master schedule="master:; cycle 1000; slot 0 100"\naddf tdma.0.receive servo\n'
                   "addf tdma.0.transmit servo\naddf segment-record.0.update servo\nstart\nadvance 2s\ngetp segment-record.0.failed\n")
        done = self.run_program("sim", "full.hal")
        self.assertEqual("TRUE\n", done.stdout)
        self.assertEqual(1, done.stderr.count("segment-record.0: /dev/full cannot be written any more; is the disk full?\n"), done.stderr)

    def test_bad_plan(self):
        self.write("cell.tdma", CELL.replace("slot 0 200", "slot 0 110"))
        self.assertEqual("cell.tdma:9:1: error: slot 0 of spare begins at 110 us, before slot 0 of master is over: 60 bytes take 6.72 us at 100 Mbit/s: "
                         "100 us + 6.72 us + guard 10 us = 116.72 us [tdma-schedule]\n    9 | slot 0 110 1/1 46\n      | ^^^^^^^^^^^^^^^^^ line 3 is in the way\n"
                         "      = help: the earliest offset for it is 116.72 us\n", self.bad("tdma", "plan", "cell.tdma"))
        self.assertEqual("hal tdma plan: cannot read 'none.tdma': No such file or directory\n", self.bad("tdma", "plan", "none.tdma"))
        self.write("empty.tdma", "# nobody\n")
        self.assertIn("empty.tdma:1:1: error: there is no station [tdma-line]", self.bad("tdma", "plan", "empty.tdma"))


if __name__ == "__main__":
    unittest.main()
