#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen
"""hal can drive: a simulated drive (hal node drive) commanded by hand from another process, over udp: on this machine."""
import os
import signal
import subprocess
import unittest

from drive_harness import Drive
from harness import HAL, TIMEOUT, Terminal, wait_until


class OneShot(Drive):
    def test_a_command_per_process(self):
        """Each takes the axis over as the one before left it."""
        self.node("--motor", "endless:1", "--axes", 2)
        self.assertEqual(
            'A: not enabled (drive is in "switch on disabled"); type: A on\n',
            self.refused("A", "go", 100),
        )
        self.assertEqual("A: on\n", self.drive("A", "on"))
        self.assertEqual("A: on\n", self.drive("A", "on"))
        self.assertEqual("A: max-speed 40000\n", self.drive("A", "set", "max-speed", 40000))
        self.assertEqual("A: max-speed 40000\n", self.drive("A", "max-speed?"))
        self.assertRegex(self.drive("A", "go", -5000), r"^A: at -(499|500)\d\n$")
        self.assertRegex(self.drive("A", "go", 6000, "relative"), r"^A: at (99\d|100\d|1010)\n$")
        self.assertEqual("A: speed 2000\n", self.left_moving("A", "speed", 2000))
        self.assertIn("A: mode pv\n", self.drive("A", "mode?"))
        self.assertEqual("A: state operation enabled\n", self.drive("A", "state?"))
        self.assertRegex(self.drive("A", "stop"), r"^A: stopped at ")
        first = self.drive("A", "position?")
        self.assertRegex(
            self.drive("A", "status"),
            r"^A: operation enabled, mode pv, statusword 0x\w{4}, voltage enabled, remote, target reached\n"
            r"   position \S+, speed \S+, torque \S+\n$",
        )
        self.assertAlmostEqual(
            float(first.split()[-1]), float(self.drive("A", "position?").split()[-1]), delta=3
        )
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
        self.assertEqual(
            "A: the drive does not support homing method 99; it supports 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19, 20, 21, 22, 23, "
            "24, 25, 26, 27, 28, 29, 30, 33, 34, 35, 37\n",
            self.refused("A", "home", 99),
        )

    def test_reasons_when_not(self):
        self.node("--set", "dc-link-0=10")
        self.assertRegex(
            self.refused("A", "on"),
            r'^A: enable: drive stays in "switch on disabled" after "shutdown" for \d+\.\d\d s \(statusword 0x0260\); '
            r"voltage-enabled is 0: check the supply of the power stage\n$",
        )
        self.assertEqual(
            "B: node 2 has no such axis: object 6841 is missing\n", self.refused("B", "on")
        )
        self.assertRegex(
            self.bad("can", "drive", self.bus, "--node", 9, "--timeout", "50ms", "A", "on"),
            r"^hal can drive: node 9 did not respond within 0.15 s \(object 6041:0\); the bus is active; to list the nodes: hal can scan udp:\S+\n$",
        )

    def test_faults_and_reset(self):
        self.node("--set", "encoder-broken-0=1")
        self.assertEqual(
            "A: enable: drive is in fault (statusword 0x0218, error 0x7305: incremental sensor 1); remove the cause, then type: A reset\n",
            self.refused("A", "on"),
        )
        self.assertRegex(
            self.drive("A", "status"),
            r"(?s)^A: fault, mode .*\n   error 0x7305: incremental sensor 1\n$",
        )
        self.assertRegex(
            self.refused("A", "reset"),
            r'A: reset: drive stays in "fault" after "fault reset" for \d+\.\d\d s '
            r"\(statusword 0x0218, error 0x7305: incremental sensor 1\)",
        )

    def test_fault_on_the_way(self):
        self.node()
        script = "A on\nA set max-speed 200000\nA go 300000\nA go 5\n"
        done = self.run_program("can", "drive", self.bus, "--node", 2, given=script)
        self.assertEqual((1, "A: on\nA: max-speed 200000\n"), (done.returncode, done.stdout))
        self.assertRegex(
            done.stderr,
            r"^hal can drive: A: run: drive went into fault \(statusword 0x\w{4}, error 0x8611: following error\); "
            r"remove the cause, then type: A reset; last EMCY 0x8611: following error\n$",
        )
        self.assertEqual("A: no fault\n", self.drive("A", "reset"))

    def test_ctrl_c_stops_the_axis(self):
        self.node("--motor", "endless:1")
        self.drive("A", "on")
        self.drive("A", "set", "max-speed", 500)
        going = subprocess.Popen(
            ["hal", "can", "drive", self.bus, "--node", "2", "A", "go", "1000000"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, going)
        wait_until(lambda: float(self.drive("A", "position?").split()[-1]) > 50, "the axis moves")
        out, error = self.end(going, signal.SIGINT)
        self.assertEqual((1, ""), (going.returncode, out))
        self.assertRegex(error, r"^hal can drive: A: stopped and off, at \d+ \(interrupted\)\n$")
        self.assertRegex(self.drive("A", "status"), r"^A: switch on disabled, mode pp, ")

    def test_the_drive_falls_silent(self):
        node = self.node("--motor", "endless:1")
        self.drive("A", "on")
        self.left_moving("A", "speed", 100)
        node.kill()
        node.wait()
        self.assertRegex(
            self.refused("--timeout", "50ms", "A", "stop"),
            r"^node 2 did not respond within 0.15 s \(object \w{4}:0\)",
        )


class Script(Drive):
    def test_lines_from_a_pipe(self):
        self.node("--axes", 2, "--motor", "endless:1")
        done = self.run_program(
            "can",
            "drive",
            self.bus,
            "--node",
            2,
            given="""# a square is not needed here
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
""".replace(
                "A on ; B on\n", "A on\n"
            ),
        )
        self.assertEqual("", done.stderr)
        self.assertEqual(0, done.returncode)
        lines = done.stdout.splitlines()
        self.assertEqual(
            [
                "A: position-factor 4096/360",
                "A: velocity-factor 4096/360",
                "A: position-factor 4096/360",
                "A: on",
                "B: on",
            ],
            lines[:5],
        )
        self.assertAlmostEqual(1800, float(lines[5].split()[-1]), delta=0.1)
        self.assertAlmostEqual(90, float(lines[6].split()[-1]), delta=1)
        self.assertEqual(["A: moving", "A: moving"], lines[7:9])
        self.assertAlmostEqual(150, float(lines[9].split()[-1]), delta=1)
        self.assertEqual(["A: off", "B: off"], lines[11:])

    def test_a_failed_line_ends_it_unless_told_otherwise(self):
        self.node()
        script = "A go 5\nA on\n"
        done = self.run_program("can", "drive", self.bus, "--node", 2, given=script)
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        done = self.run_program("can", "drive", self.bus, "--node", 2, "-k", given=script)
        self.assertEqual(
            (1, "A: on\nA: stopped and off, at 0 (end of input)\n"), (done.returncode, done.stdout)
        )

    def test_terminal(self):
        self.node()
        terminal = Terminal(self, "can", "drive", self.bus, "--node", 2)
        terminal.expect("type 'help' for the commands, Tab completes")
        terminal.expect("drive> ")
        terminal.send("A quicks\t\n")
        terminal.expect("A: stopped and off, at 0")
        terminal.send("A on\n")
        terminal.expect("A: on")
        terminal.send("A off\n")
        terminal.expect("A: off")
        terminal.send("quit\n")
        self.assertEqual(0, terminal.wait())


class EveryEnd(Drive):
    """However the program ends, the axis it moved does not go on."""

    def test_signals_stop_the_axis(self):
        self.node("--motor", "endless:1")
        self.drive("A", "set", "max-speed", 500)
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT):
            with self.subTest(number):
                self.drive("A", "on")
                going = self.begin("A", "go", 100000, "relative")
                self.moving()
                out, error = self.end(going, number)
                self.assertEqual((1, ""), (going.returncode, out))
                self.assertRegex(
                    error, r"^hal can drive: A: stopped and off, at \d+ \(interrupted\)\n$"
                )
                self.assertEqual("A: state switch on disabled\n", self.drive("A", "state?"))
                self.assertEqual("0x00000000", self.object("1016:1"))

    def test_a_signal_at_an_idle_input_stops_the_axis(self):
        self.node("--motor", "endless:1")
        for number in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(number):
                session = self.begin(stdin=subprocess.PIPE)
                session.stdin.write("A on\nA speed 500 nowait\n")
                session.stdin.flush()
                self.assertEqual("A: on\n", session.stdout.readline())
                self.assertEqual("A: speed 500\n", session.stdout.readline())
                self.moving()
                session.send_signal(number)  # its input stays open
                session.wait(TIMEOUT)
                error = self.end(session)[1]
                self.assertRegex(
                    error, r"^hal can drive: A: stopped and off, at \d+ \(interrupted\)\n$"
                )
                self.assertEqual("A: state switch on disabled\n", self.drive("A", "state?"))

    def test_the_end_of_the_input_stops_the_axis_and_quit_does_not(self):
        self.node("--motor", "endless:1")
        done = self.run_program(
            "can", "drive", self.bus, "--node", 2, given="A on\nA speed 500 nowait\n"
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertRegex(
            done.stdout, r"^A: on\nA: speed 500\nA: stopped and off, at -?\d+ \(end of input\)\n$"
        )
        done = self.run_program(
            "can", "drive", self.bus, "--node", 2, given="A on\nA speed 500\nquit\n"
        )
        self.assertEqual((0, "A: on\nA: speed 500\n"), (done.returncode, done.stdout))
        self.assertIn("A: still moving, no longer supervised", done.stderr)
        self.assertEqual("A: state operation enabled\n", self.drive("A", "state?"))

    def test_a_closed_terminal_stops_the_axis(self):
        self.node("--motor", "endless:1")
        terminal = Terminal(self, "can", "drive", self.bus, "--node", 2)
        terminal.expect("drive> ")
        terminal.send("A on\n")
        terminal.expect("A: on")
        terminal.send("A speed 500\n")
        terminal.expect("A: speed 500")
        os.close(terminal.descriptor)
        terminal.descriptor = os.open("/dev/null", os.O_RDWR)
        os.waitpid(terminal.process, 0)
        terminal.status = 1
        self.assertEqual("A: state switch on disabled\n", self.drive("A", "state?"))

    def test_after_kill_9_the_drive_stops_by_itself(self):
        for option, state in ((1, "fault"), (3, "switch on disabled"), (0, "switch on disabled")):
            with self.subTest(option):
                node = self.node("--motor", "endless:1")
                self.good("can", "sdo", "write", self.bus, 2, "6007", option, "--type", "i16")
                session = self.begin("--supervise", "1s", stdin=subprocess.PIPE)
                session.stdin.write("A on\nA speed 500 nowait\n")
                session.stdin.flush()
                self.assertEqual("A: on\n", session.stdout.readline())
                self.moving()
                self.assertNotEqual("0x00000000", self.object("1016:1"))
                session.kill()
                wait_until(
                    lambda: self.drive("A", "state?") == f"A: state {state}\n", "the drive stops"
                )
                self.assertEqual("A: no fault\n", self.drive("A", "reset"))
                self.assertEqual(
                    "0x00000000", self.object("1016:1")
                )  # the entry left behind was used again, and cleared
                self.end(node)

    def test_it_is_watched_at_an_idle_prompt(self):
        """Longer than the drive waits for a heartbeat, and it goes on."""
        self.node("--motor", "endless:1")
        terminal = Terminal(self, "can", "drive", self.bus, "--node", 2, "--supervise", "1s")
        terminal.expect("drive> ")
        terminal.send("A on\n")
        terminal.expect("A: on")
        done = self.run_program(
            "can", "dump", self.bus, "--filter", "700/780", "--count", 25
        )  # by default ten in a second
        self.assertRegex(done.stdout, r"heartbeat of node 1[12]\d")
        self.assertEqual("A: state operation enabled\n", self.drive("A", "state?"))
        terminal.send("quit\n")
        self.assertEqual(0, terminal.wait())

    def test_life_guarding_where_there_is_no_heartbeat_consumer(self):
        self.node("--motor", "endless:1", "--without", "1016")
        session = self.begin("--supervise", "1s", stdin=subprocess.PIPE)
        session.stdin.write("A on\nA speed 500 nowait\n")
        session.stdin.flush()
        self.assertEqual("A: on\n", session.stdout.readline())
        self.assertEqual("0x05", self.object("100D"))
        session.kill()
        wait_until(lambda: self.drive("A", "state?") == "A: state fault\n", "the drive stops")

    def test_a_drive_that_cannot_watch_is_named(self):
        self.node("--motor", "endless:1", "--without", "1016", "--without", "100C")
        done = self.run_program("can", "drive", self.bus, "--node", 2, "A", "on")
        self.assertEqual((0, "A: on\n"), (done.returncode, done.stdout))
        self.assertEqual(
            "hal can drive: warning: node 2 does not supervise this program (it has no heartbeat consumer, 1016h; it has no life guarding, "
            "100Ch and 100Dh): if this program is killed or the bus is cut, the axis keeps moving\n",
            done.stderr,
        )
        self.assertEqual("A: on\n", self.drive("--supervise", "off", "A", "on"))

    def test_a_drive_without_a_reaction_is_named(self):
        self.node("--motor", "endless:1", "--without", "6007")
        done = self.run_program("can", "drive", self.bus, "--node", 2, "A", "on")
        self.assertEqual(
            "hal can drive: warning: A: no abort connection option, 6007h: on loss of our heartbeat node 2 leaves operational (1029h:1); "
            "whether that stops the motor is in its manual\n",
            done.stderr,
        )

    def test_every_command_ends_in_time(self):
        self.node("--motor", "endless:1")
        self.drive("A", "on")
        self.assertRegex(
            self.refused("A", "go", 1e9, "within", "1s"),
            r"^A: not done within 1 s \(timeout\); axis stopped at \d+; for more "
            r"time add: within 2s\nhal can drive: A: stopped and off, at \d+ \(after the failure\)\n$",
        )
        self.drive("A", "on")
        self.assertRegex(
            self.refused("--within", "1s", "A", "home", 17),
            r"^A: not done within 1 s \(timeout\); axis stopped at -?\d+; ",
        )
        self.assertEqual("A: state switch on disabled\n", self.drive("A", "state?"))
        self.assertEqual(
            "go: missing time after within; type: A go within 30s\n",
            self.refused("A", "go", 5, "within"),
        )
        self.assertEqual(
            "invalid --supervise '1ms'; write 50ms to 65s, or off\n",
            self.refused("--supervise", "1ms", "A", "on"),
        )


if __name__ == "__main__":
    unittest.main()
