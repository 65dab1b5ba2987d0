#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""hal linuxcnc: TWOPASS, includes, and netlists in Tcl."""

import shutil
import subprocess
import unittest
from pathlib import Path

from harness import HAL
from linuxcnc_case import HALFILE, INI, LinuxcncCase, PLAIN
from module_case import CC, SOURCES


class LinuxcncNetlists(LinuxcncCase):
    def test_twopass_loads_before_everything_else(self):
        self.write("first.hal", "addf late servo\nsetp late.in0 4\n")
        self.write("second.hal", HALFILE + "loadrt sum2 names=late\n")
        self.display("note `halcmd getp late.in0`")
        self.linuxcnc(self.ini("[HAL]\nTWOPASS = ON\nHALFILE = first.hal\nHALFILE = second.hal\n"))
        self.assertIn("note 4", self.logged())

    @unittest.skipUnless(CC, "no C compiler")
    def test_linuxcncs_modules_come_first_with_an_option(self):
        modules = self.folder / "rtlib"
        modules.mkdir()
        subprocess.run(
            [CC, "-shared", "-fPIC", "-O1", "-o", str(modules / "or2.so"), str(SOURCES / "gain.c")],
            check=True,
        )
        self.environment["HAL_RTMOD_DIR"] = str(modules)
        self.write("machine.hal", HALFILE + "loadrt or2\n")
        for words, name in (((), "or2.0.out"), (("--linuxcnc-modules",), "gain.0.gain")):
            self.display(f"note {name} `halcmd getp {name}`")
            self.linuxcnc(*words, self.ini(PLAIN))
        self.assertIn("note or2.0.out FALSE", self.logged())
        self.assertIn("note gain.0.gain 2", self.logged())

    def test_includes_are_expanded_for_linuxcncs_programs(self):
        self.write("more.inc", PLAIN + "#INCLUDE last.inc\n")
        self.write("last.inc", "HALCMD = setp adder.in1 3\n")
        self.display("note `halcmd getp adder.in1`; cp $2 seen")
        self.linuxcnc(self.ini("#INCLUDE more.inc\n"))
        self.assertIn("io -ini CONFIG/machine.ini.expanded", self.logged())
        self.assertIn("note 3", self.logged())
        self.assertEqual(
            INI + PLAIN + "HALCMD = setp adder.in1 3\n", (self.folder / "seen").read_text()
        )

    def test_the_machine_on_a_wire_rejects_a_program_that_is_not_there(self):
        bring_up = Path(__file__).resolve().parents[2] / "halfiles/linuxcnc-ethernet/bring-up"
        done = subprocess.run(
            [bring_up, "nothing.ngc"],
            cwd=self.folder,
            env={**self.environment, "HAL": str(HAL)},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        if done.returncode == 77:
            self.skipTest(done.stderr.strip())
        self.assertEqual(
            (
                1,
                "bring-up: cannot read 'nothing.ngc'; write bring-up [PROGRAM.ngc] [--output FOLDER]\n",
            ),
            (done.returncode, done.stderr),
        )

    # --- Tcl -----------------------------------------------------------------------------------------------------------

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_a_netlist_in_tcl_has_the_commands_and_the_ini_file(self):
        self.write(
            "machine.tcl",
            """package require Hal
loadrt threads name1=servo period1=$::EMCMOT(SERVO_PERIOD)
foreach name {a b} { loadrt sum2 names=$name; addf $name servo; setp $name.in0 [expr {$::KINS(JOINTS) * 2}] }
net {total} a.out => b.in1
puts "[hal getp a.in0] <$argv> $argc <$::TRAJ(COORDINATES)> [lindex [hal list pin b.out] 0] [catch {setp none 1} text]"
puts [lindex [split $text \\n] 0]
""",
        )
        self.display("note `halcmd getp b.in0` `halcmd gets total`")
        out, err = self.linuxcnc(self.ini("[HAL]\nHALFILE = machine.tcl one two\n"))
        self.assertEqual(
            (
                "6 <one two> 2 <{X Y Z}> b.out 1\n<machine.tcl>:1:6: error: unknown pin 'none' [no-such-pin]\n",
                "",
            ),
            (out, err),
        )
        self.assertTrue(any(line.startswith("note 6 ") for line in self.logged()), self.logged())

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_tcl_loads_a_component_with_the_arguments_of_the_ini_file(self):
        self.write("machine.tcl", "loadrt $::KINS(KINEMATICS)\nputs [list [hal list pin *.out]]\n")
        out, err = self.linuxcnc(
            self.ini("[HAL]\nHALFILE = machine.tcl\n", INI.replace("trivkins", "sum2 names=a,b"))
        )
        self.assertEqual(("{a.out b.out homing.out planner.out }\n", ""), (out, err))

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_an_error_in_tcl_ends_the_start(self):
        self.write("machine.tcl", "proc connect {} {\n    net x elsewhere.y\n}\n\nconnect\n")
        out, err = self.linuxcnc(self.ini("[HAL]\nHALFILE = machine.tcl\n"), status=1)
        self.assertEqual("", out)
        self.assertEqual(
            """<machine.tcl>:1:7: error: unknown pin 'elsewhere.y' [no-such-pin]
    1 | net x elsewhere.y
      |       ^^^^^^^^^^^

1 error; nothing was changed
    while executing
"net x elsewhere.y"
    (procedure "connect" line 2)
    invoked from within
"connect"
    (file "CONFIG/machine.tcl" line 5)
hal linuxcnc: 'CONFIG/machine.tcl' ended with exit status 1
""",
            err,
        )
        self.assertEqual(["linuxcncsvr ends", "io ends"], self.logged()[-2:])

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_twopass_runs_the_loads_of_tcl_first_too(self):
        self.write("first.tcl", 'setp late.in0 4\nputs "[tp::passnumber] [hal getp late.in0]."\n')
        self.write("second.hal", HALFILE + "loadrt sum2 names=late\n")
        out, err = self.linuxcnc(
            self.ini("[HAL]\nTWOPASS = ON\nHALFILE = first.tcl\nHALFILE = second.hal\n")
        )
        self.assertEqual(("0 .\n1 4.\n", ""), (out, err))

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_haltcl_works_on_a_running_machine(self):
        self.display(
            "haltcl -i $2 later.tcl x; echo 'setp adder.in1 9; hal getp adder.in1' | haltcl; haltcl -i none.ini; haltcl -q"
        )
        self.write("later.tcl", 'puts "$argv $::EMC(VERSION) [hal getp adder.in0]"\n')
        out, err = self.linuxcnc(self.ini(), status=1)
        self.assertEqual("x 1.1 2\n9\n", out)
        self.assertEqual(
            "error: cannot read 'none.ini': No such file or directory [unreadable-file]\nhaltcl: unknown option '-q'; see: haltcl -h\n"
            "hal linuxcnc: the display './ui' ended with exit status 1\n",
            err,
        )

    def test_without_tclsh_a_message_names_the_package(self):
        self.write("machine.tcl", "")
        (self.folder / "few").mkdir()
        for name in ("sh", "env", "python3", "sleep"):
            (self.folder / "few" / name).symlink_to(shutil.which(name))
        _, err = self.linuxcnc(
            self.ini("[HAL]\nHALFILE = machine.tcl\n"),
            status=1,
            environment={"PATH": str(self.folder / "few")},
        )
        self.assertEqual(
            "hal linuxcnc: 'CONFIG/machine.tcl' cannot be run: tclsh is not installed; type: sudo apt-get install tcl\n",
            err,
        )

    # --- what ends it --------------------------------------------------------------------------------------------------

    def test_bad_netlists_end_the_start(self):
        self.assertEqual(
            "error: 'none.hal' cannot be read: No such file or directory [unreadable-file]\n      = help: named by [HAL]HALFILE in CONFIG/machine.ini; "
            "HALLIB_PATH and HALLIB_DIR are further search paths\n",
            self.linuxcnc(self.ini("[HAL]\nHALFILE = none.hal\n"), status=1)[1],
        )
        self.write("machine.hal", HALFILE + "setp adder.in1 [JOINT_9]SCALE\n")
        self.assertEqual(
            """CONFIG/machine.hal:5:16: error: unknown key '[JOINT_9]SCALE': not in the INI file [unset-ini-key]
    5 | setp adder.in1 [JOINT_9]SCALE
      |                ^^^^^^^^^^^^^^

1 error; nothing was changed
""",
            self.linuxcnc(self.ini(), status=1)[1],
        )
        self.assertEqual(["linuxcncsvr ends", "io ends"], self.logged()[-2:])


if __name__ == "__main__":
    unittest.main()
