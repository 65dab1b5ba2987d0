# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""TDMA between two processes on Ethernet: coming up, processes that die and return, cables that are pulled. Each is named in one line, and
what can recover without a user does."""
import signal
import unittest

from harness import wait_until
from segment import Segment, enter

# The sync is lost after a second: a busy machine does not stall that long, and a test can wait for it.
CELL = """cycle 5000
speed 1000
guard 400
lost 200
rounds 10

master:
name m
slot 0 500 1/1 46

slave:
name x
slot 0 2500 1/1 46
"""

NETLIST = """loadrt threads name1=servo period1=5000000
loadrt tdma link=eth:wire0 config=cell.tdma station={}
addf tdma.0.receive servo 1
addf tdma.0.transmit servo -1
"""

NO_CARRIER = "tdma.0: no carrier: nothing is sent or received; check the cable and the switch\n"
CARRIER = "tdma.0: carrier detected again\n"
RUNS = "tdma.0: runs: its slots may be used\n"


class Tdma(Segment):
    def setUp(self):
        super().setUp()
        self.write("cell.tdma", CELL)
        self.processes = {name: self.station(name, NETLIST.format(name)) for name in self.names}
        self.lost = f"tdma.0: lost the sync of {self.mac('m')}; this station stops sending until the next sync\n"
        self.followed = f"tdma.0: synchronised to {self.mac('m')}\n"
        for name in self.names:
            self.wait_for_words(name, RUNS)
            self.wait_for(name, "running", "TRUE")

    def tearDown(self):
        for name in self.names:
            self.assertNotIn("babbling", self.said(name), "nobody does")
        super().tearDown()

    def master_was_not_disturbed(self):
        self.assertEqual(
            ("TRUE", "TRUE", "FALSE", "0"),
            tuple(self.pin("m", pin) for pin in ("running", "leading", "fault", "losses")),
        )
        self.assertEqual(1, self.said("m").count(RUNS), self.said("m"))

    def test_comes_up(self):
        self.assertEqual(
            ["TRUE"] * 4,
            [
                self.pin("x", pin)
                for pin in ("synchronous", "calibrated", "master-active", "link-up")
            ],
        )
        self.assertEqual(("TRUE", "FALSE"), (self.pin("m", "leading"), self.pin("x", "leading")))
        said = self.said("x")
        self.assertEqual(
            [1, 1, 0], [said.count(words) for words in (self.followed, RUNS, self.lost)], said
        )
        self.assertRegex(
            said, rf"tdma.0: calibrated: frames take [\d.]+ us from or to {self.mac('m')}\n"
        )
        at_m, at_x = self.number("m", "cycle"), self.number("x", "cycle")
        self.assertLessEqual(at_m, at_x, "both count the same cycles")
        self.master_was_not_disturbed()

    def test_a_station_dies_and_returns(self):
        Segment.stop(self.processes["x"], signal.SIGKILL)
        before = self.number("m", "cycle")
        wait_until(lambda: self.number("m", "cycle") > before + 200, "the master goes on")
        self.station("x", NETLIST.format("x"))
        self.wait_for_words("x", RUNS, 2)
        self.wait_for("x", "running", "TRUE")
        self.master_was_not_disturbed()

    def test_the_master_dies_and_returns(self):
        Segment.stop(self.processes["m"], signal.SIGKILL)
        self.wait_for_words("x", self.lost)
        self.assertEqual(
            ["FALSE", "FALSE", "TRUE"],
            [self.pin("x", pin) for pin in ("synchronous", "running", "fault")],
        )
        self.station("m", NETLIST.format("m"))
        self.wait_for_words("x", RUNS, 2)
        self.wait_for("x", "running", "TRUE")
        self.wait_for("x", "fault", "FALSE")
        said = self.said("x")
        self.assertEqual([1, 2], [said.count(words) for words in (self.lost, self.followed)], said)

    def test_a_stations_cable_is_pulled(self):
        self.cable("x", plugged=False)
        self.wait_for_words("x", NO_CARRIER)
        self.wait_for_words("x", self.lost)
        self.assertEqual(
            ["FALSE", "FALSE", "TRUE"],
            [self.pin("x", pin) for pin in ("link-up", "running", "fault")],
        )
        self.cable("x", plugged=True)
        self.wait_for_words("x", CARRIER)
        self.wait_for_words("x", RUNS, 2)
        self.wait_for("x", "running", "TRUE")
        self.wait_for("x", "fault", "FALSE")
        said = self.said("x")
        self.assertEqual(
            [1, 1, 1, 2],
            [said.count(words) for words in (NO_CARRIER, CARRIER, self.lost, RUNS)],
            said,
        )
        self.master_was_not_disturbed()

    def test_the_masters_cable_is_pulled(self):
        self.cable("m", plugged=False)
        self.wait_for_words("m", NO_CARRIER)
        self.wait_for("m", "fault", "TRUE")
        self.wait_for_words("x", self.lost)
        self.assertEqual(["TRUE", "FALSE"], [self.pin(name, "link-up") for name in ("x", "m")])
        self.cable("m", plugged=True)
        self.wait_for_words("m", CARRIER)
        self.wait_for("m", "fault", "FALSE")
        self.wait_for_words("x", RUNS, 2)
        self.wait_for("x", "running", "TRUE")
        self.assertEqual(
            [1, 1],
            [self.said(name).count(words) for name, words in (("m", NO_CARRIER), ("x", self.lost))],
        )

    def test_a_stalled_process_reports_no_hung_thread(self):
        """What its ring holds then is of many cycles: a process that begins late finds the same."""
        x = self.processes["x"]
        x.send_signal(signal.SIGSTOP)
        before = self.number("m", "cycle")
        wait_until(lambda: self.number("m", "cycle") > before + 300, "the master goes on")
        x.send_signal(signal.SIGCONT)
        # a process without CPU time for longer than its threads' limit runs its functions again after `start`
        wait_until(
            lambda: "got no CPU time" in self.shell("show", "fault", instance="test-x").stdout,
            "the fault of the threads is known",
        )
        self.good("shell", "--name", "test-x", "start")
        at = self.number("m", "cycle")
        wait_until(
            lambda: self.pin("x", "running") == "TRUE" and self.number("x", "cycle") >= at,
            "the station is there again",
        )
        self.master_was_not_disturbed()


if __name__ == "__main__":
    enter()
    unittest.main()
