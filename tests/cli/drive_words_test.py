#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""hal can drive: the words of the robot shell, and the messages about invalid ones."""
import unittest

from drive_harness import Drive
from harness import Terminal


class LetterWords(Drive):
    """The words of the robot shell: the letter of the axis behind the word."""

    def test_a_session(self):
        self.node("--axes", 2, "--motor", "endless:1")
        done = self.run_program(
            "can",
            "drive",
            self.bus,
            "--node",
            2,
            given="""ONA:
ONB:
MSA:40000
MSA?
MAA: 300000
MAA?
PFA?
PFA:2,1
PFA?
VFA:2,1
AFA: 3 , 2
AFA?
PFA:1,1
VFA:1,1
GA:1000
A wait
APA?
GA : -500
A wait
SPDB:100
STOPB:
APB ?
OFFA:
OFFB:
HELP
""",
        )
        self.assertEqual("", done.stderr)
        lines = done.stdout.splitlines()
        self.assertEqual(["MSA=40000", "MAA=300000", "PFA=1,1", "PFA=2,1", "AFA=3,2"], lines[:5])
        self.assertRegex(
            "\n".join(lines[5:9]),
            r"^A: at (99\d|100\d)\nAPA=(99\d|100\d)\nA: at -(49\d|50\d)\nAPB=-?\d+$",
        )
        self.assertIn("  ONA:             switch the axis on", lines)
        self.assertIn("  MSA:n   MSA?     maximum speed of moves", lines)

    def test_one_shot_and_prompt(self):
        self.node()
        self.assertEqual("", self.drive("ONA:"))
        done = self.run_program(
            "can", "drive", self.bus, "--node", 2, "GA:", 100
        )  # done when accepted, so it may still be on its way
        self.assertEqual((0, ""), (done.returncode, done.stdout), done.stderr)
        self.assertRegex(self.drive("APA?"), r"^APA=\d+\n$")
        terminal = Terminal(self, "can", "drive", self.bus, "--node", 2)
        terminal.expect("drive> ")
        terminal.send("OFFA:\n")
        terminal.expect("ok\r\n")
        terminal.send("quit\n")
        self.assertEqual(0, terminal.wait())

    def test_wrong_lines(self):
        self.node()
        done = self.run_program(
            "can",
            "drive",
            self.bus,
            "--node",
            2,
            "-k",
            given="""GA:1000
ON:
ONI:
ONA?
APA:
ONA: 5
GA:
GA:1.5
GA:1,2
GA:2147483648
MSA:-1
PFA:4096
PFA:0,1
PFA:1,
SPA:100
XYZA:
GB:5
""",
        )
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            """A: not enabled (drive is in "switch on disabled"); type: A on
missing axis in 'ON:'; write ONA: to ONH:
'I' is not an axis; write ONA: to ONH:
ONA cannot be queried; type: ONA:
APA cannot be set; type: APA?
unexpected argument after ONA:
GA: takes one integer from -2147483648 to 2147483647; type: GA:1000
GA: takes one integer from -2147483648 to 2147483647; type: GA:1000
GA: takes one integer from -2147483648 to 2147483647; type: GA:1000
GA: 2147483648 is out of range; write -2147483648 to 2147483647
MSA: -1 is out of range; write 0 to 4294967295
PFA: takes two integers from 1 to 4294967295; type: PFA:4096,360
PFA: 0 is out of range; write 1 to 4294967295
PFA: takes two integers from 1 to 4294967295; type: PFA:4096,360
unknown command 'SPA'; did you mean 'APA' or 'SPDA'?
unknown command 'XYZA'; type: HELP
B: node 2 has no such axis: object 6841 is missing
""",
            done.stderr.replace("hal can drive: ", ""),
        )


class WrongWords(Drive):
    def test_each_says_what_to_type(self):
        self.node()
        done = self.run_program(
            "can",
            "drive",
            self.bus,
            "--node",
            2,
            "-k",
            given="""A foo
A st
A go x
A go 1e12
A go
A set max-sped 1
A set max-speed -1
A set max-speed fast
A set position-factor 1/0
A speed-limit?
A mode csp
A mode hm
A mode xy
A home 1.5
A on now
I on
A
""",
        )
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            """unknown command 'foo'; type: help
unknown command 'st'; did you mean 'set'?
invalid number 'x'; type: A go POSITION [relative] [nowait]
A: position 1e+12 is 1e+12 counts, out of the range -2147483648..2147483647 of the drive
type: A go POSITION [relative] [nowait]
unknown parameter 'max-sped'; did you mean 'max-speed'?
max-speed -1 is -1 in drive units, out of the range 0..4294967295
invalid number 'fast'; type: A set max-speed NUMBER
invalid factor '1/0'; write NUMERATOR/DENOMINATOR, such as 4096/360, neither of them 0
unknown parameter 'speed-limit'; type: help
mode csp needs a set-point every cycle; use component cia402 in a netlist
homing is a command: A home
invalid mode 'xy'; write pp, pv, tq or vl
invalid homing method '1.5'; write 1..37, or a negative one of the drive's manual
unexpected argument 'now'; type: A on
invalid axis 'I'; write A to H
missing command for axis A; type: help
""",
            done.stderr.replace("hal can drive: ", ""),
        )

    def test_what_has_no_effect(self):
        self.node()
        for words, expected in (
            (
                ["PFA:2,1"],
                "PFA:2,1: a factor is valid for the commands after it, and there are none; ",
            ),
            (
                ["VFA:", "2,1"],
                "VFA:2,1: a factor is valid for the commands after it, and there are none; ",
            ),
            (
                ["A", "set", "position-factor", "4096/360"],
                "A set position-factor 4096/360: a factor is valid for the commands after it, and there are none; ",
            ),
            (["quit"], "quit works in a session only; "),
            (["-k", "A", "on"], "--keep-going is for commands from a file or pipe; "),
            (["--axis", "B", "A", "status"], "--axis has no effect on a command with a letter; "),
            (
                ["--supervise", "off", "--heartbeat-id", 112, "A", "on"],
                "--heartbeat-id has no effect with --supervise off; ",
            ),
        ):
            done = self.run_program("can", "drive", self.bus, "--node", 2, *words)
            self.assertEqual((1, ""), (done.returncode, done.stdout), words)
            self.assertTrue(done.stderr.startswith("hal can drive: " + expected), done.stderr)
        self.assertEqual("PFA=1,1\n", self.drive("PFA?"))

    def test_command_line(self):
        def bad(*words):
            return self.bad("can", "drive", *words)

        self.assertEqual(
            "hal can drive: missing address; type: hal can drive can:can0 --node 2 A on\n", bad()
        )
        self.assertEqual(
            f"hal can drive: missing --node; type: hal can drive {self.bus} --node 2\n",
            bad(self.bus),
        )
        self.assertEqual(
            "hal can drive: invalid node '200'; write 1..127\n", bad(self.bus, "--node", 200)
        )
        self.assertEqual(
            "hal can drive: invalid axis 'Z'; write A to H\n",
            bad(self.bus, "--node", 2, "--axis", "Z", "on"),
        )
        self.assertEqual(
            "hal can drive: unknown option '--nod'; see: hal help can drive\n",
            bad(self.bus, "--nod", 2),
        )
        self.assertEqual("hal can drive: missing value of --node\n", bad(self.bus, "--node"))
        self.assertEqual(
            "hal can drive: invalid duration 'soon'; use 200ms or 1s\n",
            bad(self.bus, "--node", 2, "--timeout", "soon"),
        )
        self.assertIn("--node N", self.good("help", "can", "drive"))
        self.assertIn("hal can drive: 'bus:0'", bad("bus:0", "--node", 2, "A", "on"))


if __name__ == "__main__":
    unittest.main()
