#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal can drive: a simulated drive (hal node drive) commanded by hand from another process, over udp: on this machine."""
import os
import random
import signal
import subprocess
import unittest

from harness import HAL, Case, Terminal, wait_until


class Drive(Case):
    def setUp(self):
        super().setUp()
        place = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        self.bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"

    def node(self, *words):
        """Starts a drive and waits until it is on the bus."""
        process = subprocess.Popen(["hal", "node", "drive", "--link", self.bus, "--id", "2", *map(str, words)], executable=str(HAL),
                                   cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)
        self.addCleanup(self.end, process)
        for line in process.stdout:
            if ", profile position" in line and "not ready" not in line:
                return process
        raise AssertionError("the drive does not start")

    def drive(self, *words, **how):
        return self.good("can", "drive", self.bus, "--node", 2, *words, **how)

    def refused(self, *words, **how):
        text = self.bad("can", "drive", self.bus, "--node", 2, *words, **how)
        self.assertTrue(text.startswith("hal can drive: "), text)
        return text[len("hal can drive: "):]


class OneShot(Drive):
    def test_a_command_per_process(self):
        """Each takes the axis over as the one before left it."""
        self.node("--motor", "endless:1", "--axes", 2)
        self.assertEqual('A: is not on (drive is in "switch on disabled"); type: A on\n', self.refused("A", "go", 100))
        self.assertEqual("A: on\n", self.drive("A", "on"))
        self.assertEqual("A: on\n", self.drive("A", "on"))
        self.assertEqual("A: max-speed 40000\n", self.drive("A", "set", "max-speed", 40000))
        self.assertEqual("A: max-speed 40000\n", self.drive("A", "max-speed?"))
        self.assertRegex(self.drive("A", "go", -5000), r"^A: at -(499|500)\d\n$")
        self.assertRegex(self.drive("A", "go", 6000, "relative"), r"^A: at (99\d|100\d|1010)\n$")
        self.assertEqual("A: speed 2000\n", self.drive("A", "speed", 2000))
        self.assertIn("A: mode pv\n", self.drive("A", "mode?"))
        self.assertEqual("A: state operation enabled\n", self.drive("A", "state?"))
        self.assertRegex(self.drive("A", "stop"), r"^A: stands at ")
        first = self.drive("A", "position?")
        self.assertRegex(self.drive("A", "status"), r"^A: operation enabled, mode pv, statusword 0x\w{4}, voltage enabled, remote, target reached\n"
                                                    r"   position \S+, speed \S+, torque \S+\n$")
        self.assertAlmostEqual(float(first.split()[-1]), float(self.drive("A", "position?").split()[-1]), delta=3)
        self.assertEqual("A: torque 0\n", self.drive("A", "torque", 0))
        self.assertEqual("A: homed, at 0\n", self.drive("A", "home", 37))
        self.assertEqual("A: mode pp\n", self.drive("A", "mode?"))
        self.assertRegex(self.drive("A", "quickstop"), r"^A: stopped and off, at ")
        self.assertEqual("A: off\n", self.drive("A", "off"))
        self.assertEqual("B: on\n", self.drive("--axis", "B", "on"))
        self.assertEqual("B: state operation enabled\n", self.drive("b", "state?"))
        self.assertEqual("A: state switch on disabled\n", self.drive("A", "state?"))

    def test_homing_by_a_switch(self):
        self.node("--axes", 1)
        self.drive("A", "on")
        self.drive("A", "set", "home-speed", 40000)
        self.drive("A", "set", "home-offset", 500)
        self.assertRegex(self.drive("A", "home", 23), r"^A: homed, at ")
        self.assertRegex(self.drive("A", "go", 500), r"^A: at (49\d|50\d|510)\n$")
        self.assertEqual("A: the drive knows no homing method 99; it has 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19, 20, 21, 22, 23, "
                         "24, 25, 26, 27, 28, 29, 30, 33, 34, 35, 37\n",
                         self.refused("A", "home", 99))

    def test_reasons_when_not(self):
        self.node("--set", "dc-link-0=10")
        self.assertRegex(self.refused("A", "on"),
                         r'^A: enable: drive stays in "switch on disabled" after "shutdown" for \d+\.\d\d s \(statusword 0x0260\); '
                         r"voltage-enabled is 0: has its power stage supply\?\n$")
        self.assertEqual("B: node 2 has no such axis: object 6841 is missing\n", self.refused("B", "on"))
        self.assertRegex(self.bad("can", "drive", self.bus, "--node", 9, "--timeout", "50ms", "A", "on"),
                         r"^hal can drive: node 9 did not answer within 0.15 s \(asked for 6041:0\); the bus is active; hal can scan udp:\S+ shows who is there\n$")

    def test_faults_and_reset(self):
        self.node("--set", "encoder-broken-0=1")
        self.assertEqual("A: enable: drive is in fault (statusword 0x0218, error 0x7305: incremental sensor 1); remove the cause, then type: A reset\n",
                         self.refused("A", "on"))
        self.assertRegex(self.drive("A", "status"), r"(?s)^A: fault, mode .*\n   error 0x7305: incremental sensor 1\n$")
        self.assertRegex(self.refused("A", "reset"), r'A: reset: drive stays in "fault" after "fault reset" for \d+\.\d\d s '
                                                     r"\(statusword 0x0218, error 0x7305: incremental sensor 1\)")

    def test_fault_on_the_way(self):
        self.node()
        script = "A on\nA set max-speed 200000\nA go 300000\nA go 5\n"
        done = self.run_program("can", "drive", self.bus, "--node", 2, given=script)
        self.assertEqual((1, "A: on\nA: max-speed 200000\n"), (done.returncode, done.stdout))
        self.assertRegex(done.stderr, r"^hal can drive: A: run: drive went into fault \(statusword 0x\w{4}, error 0x8611: following error\); "
                                      r"remove the cause, then type: A reset; last EMCY 0x8611: following error\n$")
        self.assertEqual("A: no fault\n", self.drive("A", "reset"))

    def test_ctrl_c_stops_the_axis(self):
        self.node("--motor", "endless:1")
        self.drive("A", "on")
        self.drive("A", "set", "max-speed", 500)
        going = subprocess.Popen(["hal", "can", "drive", self.bus, "--node", "2", "A", "go", "1000000"], executable=str(HAL), cwd=self.folder,
                                 env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, going)
        wait_until(lambda: float(self.drive("A", "position?").split()[-1]) > 50, "the axis moves")
        out, error = self.end(going, signal.SIGINT)
        self.assertEqual((1, "", "hal can drive: A: interrupted; it was stopped\n"), (going.returncode, out, error))
        self.assertRegex(self.drive("A", "status"), r"^A: operation enabled, mode pp, .*target reached\n")

    def test_the_drive_falls_silent(self):
        node = self.node("--motor", "endless:1")
        self.drive("A", "on")
        self.drive("A", "speed", 100)
        node.kill()
        node.wait()
        self.assertRegex(self.refused("--timeout", "50ms", "A", "stop"), r"^node 2 did not answer within 0.15 s \(asked for \w{4}:0\)")


class Script(Drive):
    def test_lines_from_a_pipe(self):
        self.node("--axes", 2, "--motor", "endless:1")
        done = self.run_program("can", "drive", self.bus, "--node", 2, given="""# a square is not needed here
A set position-factor 4096/360
A set velocity-factor 4096/360
A set position-factor?
A on ; B on
B on    # two axes
A set max-speed 1800
A go 90
A go: 30 relative nowait
A go: 30 relative nowait
A wait
B go 1000
A off
B off
quit
A on
""".replace("A on ; B on\n", "A on\n"))
        self.assertEqual("", done.stderr)
        self.assertEqual(0, done.returncode)
        lines = done.stdout.splitlines()
        self.assertEqual(["A: position-factor 4096/360", "A: velocity-factor 4096/360", "A: position-factor 4096/360", "A: on", "B: on"], lines[:5])
        self.assertAlmostEqual(1800, float(lines[5].split()[-1]), delta=0.1)
        self.assertAlmostEqual(90, float(lines[6].split()[-1]), delta=1)
        self.assertEqual(["A: moves", "A: moves"], lines[7:9])
        self.assertAlmostEqual(150, float(lines[9].split()[-1]), delta=1)
        self.assertEqual(["A: off", "B: off"], lines[11:])

    def test_a_failed_line_ends_it_unless_told_otherwise(self):
        self.node()
        script = "A go 5\nA on\n"
        done = self.run_program("can", "drive", self.bus, "--node", 2, given=script)
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        done = self.run_program("can", "drive", self.bus, "--node", 2, "-k", given=script)
        self.assertEqual((1, "A: on\n"), (done.returncode, done.stdout))

    def test_terminal(self):
        self.node()
        terminal = Terminal(self, "can", "drive", self.bus, "--node", 2)
        terminal.expect("'help' lists the commands, Tab completes")
        terminal.expect("drive> ")
        terminal.send("A quicks\t\n")
        terminal.expect("A: stopped and off, at 0")
        terminal.send("A on\n")
        terminal.expect("A: on")
        terminal.send("A off\n")
        terminal.expect("A: off")
        terminal.send("quit\n")
        self.assertEqual(0, terminal.wait())


class WrongWords(Drive):
    def test_each_says_what_to_type(self):
        self.node()
        done = self.run_program("can", "drive", self.bus, "--node", 2, "-k", given="""A foo
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
""")
        self.assertEqual(1, done.returncode)
        self.assertEqual("""there is no command 'foo'; type: help
there is no command 'st'; did you mean 'set'?
'x' is no number; type: A go POSITION [relative] [nowait]
A: 1e+12 is 1e+12 of the drive's counts; its positions go from -2147483648 to 2147483647
type: A go POSITION [relative] [nowait]
there is no value 'max-sped'; did you mean 'max-speed'?
max-speed -1 is -1 in the drive's units, which go from 0 to 4.29497e+09
'fast' is no number; type: A set max-speed NUMBER
'1/0' is no factor; write NUMERATOR/DENOMINATOR, such as 4096/360, neither of them 0
there is no value 'speed-limit'; type: help
csp wants a set-point every cycle; use component cia402 in a netlist
homing is a command: A home
'xy' is no mode; write pp, pv, tq or vl
'1.5' is no homing method; write 1 to 37, or what the drive's manual has below 0
nothing is expected at 'now'; type: A on
'I' is no axis; write A to H
what shall axis A do? type: help
""", done.stderr.replace("hal can drive: ", ""))

    def test_command_line(self):
        def bad(*words):
            return self.bad("can", "drive", *words)
        self.assertEqual("hal can drive: the address is missing; type: hal can drive can:can0 --node 2 A on\n", bad())
        self.assertEqual(f"hal can drive: which node? type: hal can drive {self.bus} --node 2\n", bad(self.bus))
        self.assertEqual("hal can drive: '200' is no node; write 1 to 127\n", bad(self.bus, "--node", 200))
        self.assertEqual("hal can drive: 'Z' is no axis; write A to H\n", bad(self.bus, "--node", 2, "--axis", "Z", "on"))
        self.assertEqual("hal can drive: there is no option '--nod'; see: hal help can drive\n", bad(self.bus, "--nod", 2))
        self.assertEqual("hal can drive: something is missing behind --node\n", bad(self.bus, "--node"))
        self.assertEqual("hal can drive: 'soon' is not a duration; write 200ms or 1s\n", bad(self.bus, "--node", 2, "--timeout", "soon"))
        self.assertIn("--node N", self.good("help", "can", "drive"))
        self.assertIn("hal can drive: 'bus:0'", bad("bus:0", "--node", 2, "A", "on"))


if __name__ == "__main__":
    unittest.main()
