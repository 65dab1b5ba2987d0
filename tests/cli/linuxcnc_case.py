# SPDX-License-Identifier: MIT
"""What the tests of hal linuxcnc share. LinuxCNC is not needed: linuxcnc/ has programs that stand in for its own."""
import os
import re
import signal
import sys
import unittest
from pathlib import Path

from harness import HAL, Case, wait_until

STANDIN = Path(__file__).parent / "linuxcnc/standin.py"
MODULE = HAL.parent.parent / "python"
PROGRAMS = ("linuxcncsvr", "io", "halui", "milltask", "linuxcncrsh", "note")

INI = """[EMC]
VERSION = 1.1
[DISPLAY]
DISPLAY = ./ui
[TASK]
TASK = milltask
[EMCIO]
EMCIO = io
[TRAJ]
TPMOD = sum2 names=planner
COORDINATES = X Y Z
[EMCMOT]
HOMEMOD = mult2 names=homing
SERVO_PERIOD = 1000000
[KINS]
KINEMATICS = trivkins
JOINTS = 3
[HALCYON]
MAX_CPU_GAP = 60s
"""
HALFILE = """loadrt threads name1=servo period1=[EMCMOT]SERVO_PERIOD
loadrt sum2 names=adder
addf adder servo
setp adder.in0 2
"""
PLAIN = "[HAL]\nHALFILE = machine.hal\n"


def prompt(err):
    """Standard error without what a busy host causes: that loadusr waits, and gaps without CPU."""
    return re.sub(
        r"(?m)^(loadusr: waiting for|hal linuxcnc: [\w-]+: no CPU time for) .*\n", "", err
    )


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "Python's module hal is not built")
class LinuxcncCase(Case):
    def setUp(self):
        super().setUp()
        self.home = self.folder / "installed"
        (self.home / "bin").mkdir(parents=True)
        for name in PROGRAMS:
            self.install(name)
        self.log = self.folder / "log"
        self.environment |= {
            "LINUXCNC_HOME": str(self.home),
            "STANDIN_LOG": str(self.log),
            "TMPDIR": str(self.folder),
        }
        self.write("machine.hal", HALFILE)
        self.display("exit 0")

    def tearDown(self):
        """Nothing may be left, however a run ended."""
        mark = f"STANDIN_LOG={self.log}".encode()

        def left():
            names = []
            for process in Path("/proc").glob("[0-9]*"):
                try:
                    if mark in (process / "environ").read_bytes().split(
                        b"\0"
                    ) and process.name != str(os.getpid()):
                        names.append((process / "comm").read_text().strip())
                except OSError:
                    pass  # it has ended
            return names

        remaining = left()
        self.assertEqual([], remaining)
        self.assertFalse((self.folder / "linuxcnc.lock").exists())
        self.assertEqual(
            [], list(self.folder.glob("*.expanded")) + list(self.folder.glob("halcyon/*.sock"))
        )

    def install(self, name):
        path = self.home / "bin" / name
        path.write_text(STANDIN.read_text().replace("/usr/bin/env python3", sys.executable, 1))
        path.chmod(0o755)

    def display(self, script, name="ui"):
        path = Path(self.write(name, f"#!/bin/sh\n{script}\n"))
        path.chmod(0o755)

    def ini(self, rest=PLAIN, text=INI):
        return self.write("machine.ini", text + rest)

    def linuxcnc(self, *words, status=0, **how):
        """Runs a machine to its end; standard output and error without the name of the folder."""
        done = self.run_program("linuxcnc", *words, **how)
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stdout.replace(str(self.folder), "CONFIG"), prompt(done.stderr).replace(
            str(self.folder), "CONFIG"
        )

    def end(self, machine, number=signal.SIGTERM):
        out, err = super().end(machine, number)
        return out, prompt(err)

    def runs(self, *words):
        """Starts a machine and waits until its display runs."""
        machine = self.start("linuxcnc", *words, loaded=False)
        wait_until(
            lambda: machine.poll() is not None or (self.folder / "shown").exists(),
            "the display runs",
        )
        self.assertIsNone(machine.poll())
        return machine

    def logged(self):
        return self.log.read_text().splitlines()
