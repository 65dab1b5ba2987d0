# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""RTcfg between two processes on Ethernet: a station that has its address alone gets its schedule and a file from the master."""
import re
import signal
import subprocess
import unittest

from harness import HAL
from segment import Segment, enter

CELL = """cycle 5000
speed 1000
guard 400
lost 200
rounds 10
heartbeat 1500

master:
name m
slot 0 500 1/1 200

slave:
name x
mac {}
slot 0 2500 1/1 100
stage2 for-x
"""

NETLIST = """loadrt threads name1=servo period1=5000000
loadrt tdma link=eth:wire0 {}
addf tdma.0.receive servo 1
addf tdma.0.transmit servo -1
"""

RUNS = "tdma.0: runs: its slots may be used\n"


class Rtcfg(Segment):
    def setUp(self):
        super().setUp()
        self.file = "".join(f"line {i} of the file\n" for i in range(100))
        self.write("for-x", self.file)
        self.write("cell.tdma", CELL.format(self.mac("x")))

    def test_a_station_begins_with_its_address_alone(self):
        x = self.station("x", NETLIST.format("station=auto stage2=received"))
        waits = (
            "tdma.0: has no schedule and waits for the master of the segment to send it one (RTcfg); the master's file must have a block "
            f"with 'mac {self.mac('x')}'\n"
        )
        self.wait_for_words("x", waits)
        self.wait_for("x", "state", "5")
        self.assertEqual("FALSE", self.pin("x", "configured"))
        self.station("m", NETLIST.format("config=cell.tdma station=m"))
        self.wait_for_words("x", RUNS)
        written = f"tdma.0: received 'received' from {self.mac('m')} ({len(self.file)} bytes)\n"
        self.wait_for_words("x", written)
        self.assertEqual(self.file, (self.folder / "received").read_text())
        self.wait_for("m", "stations", "1")
        self.wait_for("x", "stage2-bytes", str(len(self.file)))
        said = self.said("x")
        configured = f"tdma.0: configured by {self.mac('m')} as station x: 1 slot, cycle 5000 us\n"
        self.assertEqual(
            [1, 1, 1], [said.count(words) for words in (waits, configured, written)], said
        )

        # Switched off and on again.
        Segment.stop(x, signal.SIGKILL)
        self.wait_for_words(
            "m",
            f"tdma.0: station x ({self.mac('x')}) is dead: no heartbeat for 3000 ms; all stations were notified, and it is invited again\n",
        )
        self.station("x", NETLIST.format("station=auto stage2=received"))
        self.wait_for_words("x", written, 2)
        self.wait_for("m", "stations-dead", "0")
        self.assertEqual(("TRUE", "0"), (self.pin("m", "running"), self.pin("m", "losses")))

    def test_so_does_a_node(self):
        # A node hands its frame over 120 us before its slot.
        cell = (
            CELL.replace("cycle 5000", "cycle 2000")
            .replace("lost 200", "lost 500")
            .replace("slot 0 2500", "phase 1380\nslot 0 1500")
        )
        self.write("cell.tdma", cell.format(self.mac("x")))
        log = self.logs["node"] = self.folder / "node.log"
        with open(log, "w") as out:
            node = subprocess.Popen(
                [
                    "ip",
                    "netns",
                    "exec",
                    "x",
                    HAL,
                    "node",
                    "axis-io",
                    "--id",
                    "1",
                    "--link",
                    "cane:wire0",
                    "--tdma",
                    "auto",
                ],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )
        self.addCleanup(self.stop, node)
        self.wait_for_words(
            "node",
            "hal node: waiting for the master of eth:wire0 to send the schedule (RTcfg); the master's file must have a "
            f"block with 'mac {self.mac('x')}'\n",
        )
        master = self.station(
            "m", NETLIST.format("config=cell.tdma station=m").replace("5000000", "2000000")
        )
        self.wait_for_words(
            "node", f" s  configured by {self.mac('m')} as station x: 1 slot, cycle 2000 us\n"
        )
        self.wait_for_words("m", f"tdma.0: station x ({self.mac('x')}) is configured\n")
        self.wait_for("m", "stations", "1")
        self.wait_for_words("node", " s  runs: its slots may be used\n")
        # The master begins anew with another schedule, and with another cycle.
        self.stop(master)
        self.wait_for_words(
            "node",
            f" s  lost the sync of {self.mac('m')}; this station stops sending until the next sync\n",
        )
        self.write(
            "cell.tdma", CELL.format(self.mac("x"))
        )  # here its slot is far behind the beginning of its cycle
        self.station("m", NETLIST.format("config=cell.tdma station=m"))
        self.wait_for_words(
            "node", f" s  configured by {self.mac('m')} as station x: 1 slot, cycle 5000 us\n"
        )
        self.wait_for_words("node", " s  runs: its slots may be used\n", 2)
        self.wait_for("m", "stations", "1")
        self.stop(node)
        said = self.said("node")
        self.assertIn("TDMA: running, ", said)
        # The time of the lines and that of the summary begin together, before the schedule came.
        runs = [float(t) for t in re.findall(r"([\d.]+) s  runs: ", said)]
        (end,) = (float(t) for t in re.findall(r"(?m)^([\d.]+) s: \d+ frames sent", said))
        self.assertGreaterEqual(end + 0.1, runs[-1], said)
        nobody = self.at(
            "x",
            HAL,
            "node",
            "axis-io",
            "--id",
            "1",
            "--link",
            "cane:wire0",
            "--tdma",
            "auto",
            "--station",
            "10.0.0.3",
            "--for",
            "50ms",
            env=self.environment,
        )
        self.assertIn("no master on eth:wire0 sent a schedule for 'ip 10.0.0.3'", nobody.stdout)
        self.assertEqual(1, nobody.returncode)


if __name__ == "__main__":
    enter()
    unittest.main()
