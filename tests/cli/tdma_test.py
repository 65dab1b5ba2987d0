# SPDX-License-Identifier: MIT
# packages: tdma
"""hal tdma: schedules of an Ethernet segment, and who answers on it."""
import json
import re
import unittest
import xml.etree.ElementTree

from harness import ROOT, SERVO, Case, wait_until

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

load 2.4 % with frames of full length; a frame of 60 bytes takes 6.72 us on a line, 15.44 us from station to station
spare checks 30 us after the start of the cycle and takes over 50 us after a missing sync
outputs are set to safe values 4 cycles after the last sync: 4000 us
spare: worst-case latency from input to output 3000.00 us, 2 cycles after the input is read
  read 30.00, sent 200.00 (slot 0), received 215.44; master's thread 1000.00, sent 1100.00, received 1115.44; written 2030.00
  2030.00 - 30.00 + 1000.00 for an input that changed just after it was read = 3000.00 us
x: worst-case latency from input to output 4000.00 us, 3 cycles after the input is read
  read 0.00, sent 1300.00 (slot 0), received 1315.44; master's thread 2000.00, sent 2100.00, received 2115.44; written 3000.00
  3000.00 - 0.00 + 1000.00 for an input that changed just after it was read = 4000.00 us
"""

# A busy machine must not make it lose its sync.
SEGMENT = """loadrt threads name1=servo period1=1000000
loadrt tdma link=sim:cell/master,sim:cell/x station=master,x schedule="master:; cycle 1000; lost 20000; rounds 10; slot 0 100; \
slave:; name x; slot 0 300; slot 2 500 1/2 60; slave:; name away; slot 0 700"
addf tdma.0.receive servo
addf tdma.1.receive servo
addf tdma.0.transmit servo
addf tdma.1.transmit servo
start
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
            self.assertEqual(
                (folder / "timing.svg").read_text(),
                self.good("tdma", "plan", folder / f"{name}.tdma", "--svg", "-"),
                f"make it anew: hal tdma plan halfiles/{machine}.tdma --svg halfiles/{machine.split('/')[0]}/timing.svg",
            )

    def test_picture_into_a_file(self):
        self.write("cell.tdma", CELL)
        self.assertEqual("", self.good("tdma", "plan", "cell.tdma", "--svg", "cell.svg"))
        drawn = xml.etree.ElementTree.parse(self.folder / "cell.svg").getroot()
        texts = [t.text for t in drawn.iter("{http://www.w3.org/2000/svg}text")]
        for wanted in (
            "master",
            "spare",
            "x",
            "300, 1 of 2 cycles",
            "Line load 2.4 %; worst-case latency from input to output of x: 4000 us",
        ):
            self.assertIn(wanted, texts)
        self.assertEqual(
            "hal tdma plan: cannot write 'none/cell.svg': No such file or directory\n",
            self.bad("tdma", "plan", "cell.tdma", "--svg", "none/cell.svg"),
        )
        self.assertEqual(
            "hal tdma plan: --json and --svg exclude each other\n",
            self.bad("tdma", "plan", "cell.tdma", "--json", "--svg", "cell.svg"),
        )

    def answered(self, station, count):
        """Returns the output of a run in which the busy host lost no ping."""

        def attempt():
            done = self.run_program("tdma", "ping", station, "-c", str(count))
            return done.returncode == 0 and done.stdout

        return wait_until(attempt, f"{count} pings to {station} are answered")

    def test_ping(self):
        self.write("cell.hal", SEGMENT)
        self.start("run", "--no-picture", "cell.hal")
        wait_until(lambda: self.value("tdma.1.running") == "TRUE", "x runs")
        one = r"x {}: \d+\.\d\d us, \d+\.\d\d cycles; \d+\.\d\d us of it at x, 15\.44 us each way\n"
        text = self.answered("x", 6)
        self.assertRegex(
            text,
            "^"
            + "".join(one.format(n) for n in range(1, 7))
            + r"6 pings from tdma\.0, 6 answered, 0 lost \(0 %\); min \d+\.\d\d, mean \d+\.\d\d, max \d+\.\d\d us\n$",
        )
        self.assertRegex(self.answered("master", 1), r"1 ping from tdma\.1, 1 answered, 0 lost")
        self.assertEqual(
            "hal tdma ping: unknown station 'nobody'; tdma.0 knows away, x; tdma.1 knows away, master\n",
            self.bad("tdma", "ping", "nobody"),
        )
        self.assertEqual(
            "hal tdma ping: unknown station 'x'; tdma.1 knows away, master\n",
            self.bad("tdma", "ping", "x", "--from", "tdma.1"),
        )
        self.assertEqual(
            "hal tdma ping: unknown station 'tdma.7' in --from; use tdma.0, tdma.1\n",
            self.bad("tdma", "ping", "x", "--from", "tdma.7"),
        )
        done = self.run_program("tdma", "ping", "away", "-c", "1")
        self.assertEqual(
            (
                1,
                "away 1: not sent, unknown address\n1 ping from tdma.0, 0 answered, 1 lost (100 %)\n",
                "hal tdma ping: tdma.0 has received no frame from away and does not know its address; add its mac to the schedule\n",
            ),
            (done.returncode, done.stdout, done.stderr),
        )
        status = self.good("tdma", "status").split("tdma.1: ")[0]
        self.assertRegex(status, r"(?m)^station +state +since +frames +late +drift  slots$")
        self.assertRegex(status, r"(?m)^away +unheard +- +0 +0 +-  0: 700 us$")
        online = re.compile(
            r"(?m)^x +online +\S+ s +\d+ +\d+ +[-+]\d+\.\d ppm  0: 300 us, 2: 500 us in 1 of 2 cycles$"
        )

        def is_heard():  # a station without values to send is heard only when it answers
            self.answered("x", 1)
            return online.search(self.good("tdma", "status"))

        wait_until(is_heard, "x is heard")

        # It is heard no more: its thread does nothing.
        for function in ("receive", "transmit"):
            self.assertEqual(0, self.shell("delf", f"tdma.1.{function}", "servo").returncode)
        wait_until(lambda: self.value("tdma.0.x.online") == "FALSE", "x is offline")
        done = self.run_program("tdma", "ping", "x", "-c", "2")
        self.assertEqual(
            (
                1,
                "x 1: no answer\nx 2: no answer\n2 pings from tdma.0, 0 answered, 2 lost (100 %)\n",
                "hal tdma ping: x is offline; check its power and its cable\n",
            ),
            (done.returncode, done.stdout, done.stderr),
        )

    def test_ping_without_a_segment(self):
        self.write("plain.hal", SERVO)
        self.start("run", "--no-picture", "plain.hal")
        self.assertEqual(
            "hal tdma ping: instance 'default' has no station of a segment (loadrt tdma)\n",
            self.bad("tdma", "ping", "x"),
        )

    def test_a_recording_reports_missing_samples(self):
        for words, problem in (
            ("", "missing file=; write file=seen.pcapng"),
            ("file=none/seen.pcapng", "cannot write none/seen.pcapng: No such file or directory"),
            ("file=seen.pcapng link=sim:", "sim:: missing name of the segment; write sim:net0"),
        ):
            self.write("record.hal", f"loadrt segment_record {words}\nstart\n")
            self.assertIn(
                f"error: 'segment-record.0' (segment_record) cannot start: {problem} [start-failed]\n",
                self.bad("sim", "record.hal"),
            )

        self.write(
            "full.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt segment_record link=sim:net0/recorder file=/dev/full\n"
            'loadrt tdma link=sim:net0/master station=master schedule="master:; cycle 1000; slot 0 100"\naddf tdma.0.receive servo\n'
            "addf tdma.0.transmit servo\naddf segment-record.0.update servo\nstart\nadvance 2s\ngetp segment-record.0.failed\n",
        )
        done = self.run_program("sim", "full.hal")
        self.assertEqual("TRUE\n", done.stdout)
        self.assertEqual(
            1,
            done.stderr.count(
                "segment-record.0: cannot write /dev/full; check that the disk is not full\n"
            ),
            done.stderr,
        )

    def test_bad_plan(self):
        self.write("cell.tdma", CELL.replace("slot 0 200", "slot 0 110"))
        self.assertEqual(
            "cell.tdma:9:1: error: slot 0 of spare begins at 110 us, before the end of slot 0 of master: 60 bytes take 6.72 us at 100 Mbit/s: "
            "100 us + 6.72 us + guard 10 us = 116.72 us [tdma-schedule]\n    9 | slot 0 110 1/1 46\n      | ^^^^^^^^^^^^^^^^^ conflicts with line 3\n"
            "      = help: its earliest offset is 116.72 us\n",
            self.bad("tdma", "plan", "cell.tdma"),
        )
        self.assertEqual(
            "hal tdma plan: cannot read 'none.tdma': No such file or directory\n",
            self.bad("tdma", "plan", "none.tdma"),
        )
        self.write("empty.tdma", "# nobody\n")
        self.assertIn(
            "empty.tdma:1:1: error: the file has no station [tdma-line]",
            self.bad("tdma", "plan", "empty.tdma"),
        )


if __name__ == "__main__":
    unittest.main()
