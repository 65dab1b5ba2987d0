# SPDX-License-Identifier: MIT
"""hal check: several files, INI files, missing parts; special files, for every command that reads a file."""

import os
import re
import subprocess
import unittest

from harness import SERVO, Case, needs_package

MACHINE = """loadrt [KINS]KINEMATICS
loadrt motmod servo_period_nsec=[EMCMOT]PERIOD num_joints=2
loadrt hal_card cfg="0x378 out"
loadrt pid names=pid.x,pid.y
loadusr -Wn panel pyvcp -c panel panel.xml
addf card.0.read servo-thread
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf pid.x.do-pid-calcs servo-thread
addf pid.y.do-pid-calcs servo-thread
net x-cmd joint.0.motor-pos-cmd => pid.x.command
net y-cmd joint.1.motor-pos-cmd => pid.y.command
net x-out pid.x.output => card.0.dac-00
net y-out pid.y.output => card.0.dac-01
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net bar panel.bar halui.machine.is-on
setp pid.x.Pgain 5
"""
INI = """[EMC]
VERSION = 1.1
[HAL]
HALFILE = machine.hal
HALFILE = LIB:library.hal
HALFILE = more.hal
POSTGUI_HALFILE = after.hal
HALUI = halui
HALCMD = setp pid.y.Pgain 7
[KINS]
KINEMATICS = trivkins coordinates=XY
[EMCMOT]
PERIOD = 1000000
[EMCIO]
EMCIO = io
[DISPLAY]
DISPLAY = axis
"""


class Check(Case):
    def setUp(self):
        super().setUp()
        (self.folder / "library").mkdir()
        self.environment["HALLIB_DIR"] = str(self.folder / "library")
        self.write("machine.hal", MACHINE)
        self.write("library/library.hal", "net lib pid.x.error joint.0.jog-scale\n")
        self.write(
            "more.hal",
            "net more joint.0.amp-enable-out => pid.x.enable\nsetp pid.x.Igain 1\nsetp pid.y.Dgain 2\n",
        )
        self.write("after.hal", "net after axisui.notifications-clear => pyvcp.led\n")
        self.ini = self.write("machine.ini", INI)

    def errors(self, text):
        return [
            line for line in text.splitlines() if ": error: " in line or line.startswith("error: ")
        ]

    def test_reports_one_error_per_cause(self):
        said = self.bad("check", "machine.ini")
        self.assertEqual(
            ["trivkins", "motmod", "hal_card"],
            [line.split("'")[1] for line in self.errors(said)],
            said,
        )
        self.assertIn(
            "3 lines refer to names that no loaded component has; they were not checked", said
        )
        self.assertIn("possibly from programs of LinuxCNC, component 'hal_card'", said)
        self.assertIn(
            "depends on program 'pyvcp', which is not started here; it was not checked", said
        )
        self.assertIn("depends on program 'io', which is not started here", said)

    def test_a_single_missing_component_has_all_lines(self):
        self.write(
            "a.hal",
            "loadrt hal_card\nloadrt pid names=pid.x\nnet c card.0.adc-00 => pid.x.command\naddf pid.x.do-pid-calcs servo-thread\n",
        )
        self.write("b.hal", "net d card.0.adc-01 pid.x.feedback\nsetp pid.x.Pgain 1\n")
        said = self.bad("check", "a.hal", "b.hal")
        self.assertEqual(
            ["a.hal:1:8: error: unknown component 'hal_card' [no-such-component]"],
            self.errors(said),
            said,
        )
        self.assertIn("= help: 2 lines depend on it; they were not checked", said)
        self.assertIn(
            "b.hal:1:1: warning: 1 line depends on component 'hal_card', which is missing; it was not checked [unchecked-lines]",
            said,
        )

    def test_real_errors_are_still_errors(self):
        self.write(
            "b.hal",
            "net d pdi.x.command joint.0.x\nsetp pid.x.Nogain 3\nsetp pid.x.Pgain no\naddf pid.z.do-pid-calcs servo-thread\nsets nothing 3\n",
        )
        said = self.bad("check", "machine.ini", "b.hal")
        self.assertEqual(
            [f"b.hal:{line}" for line in (1, 1, 2, 3, 4, 5)],
            [
                ":".join(line.split(":")[:2])
                for line in self.errors(said)
                if line.startswith("b.hal")
            ],
            said,
        )
        for name in (
            "pdi.x.command",
            "joint.0.x",
            "pid.x.Nogain",
            "pid.z.do-pid-calcs",
            "'nothing'",
        ):
            self.assertIn(name, "\n".join(self.errors(said)))

    def test_assume(self):
        said = self.run_program(
            "check",
            "--assume",
            "trivkins",
            "--assume",
            "motmod",
            "--assume",
            "hal_card",
            "machine.ini",
        )
        self.assertEqual((0, []), (said.returncode, self.errors(said.stderr)), said.stderr)
        self.assertIn("3 lines refer to names that no loaded component has", said.stderr)
        self.assertTrue(
            said.stderr.endswith("machine.ini: no errors; 6 lines were not checked\n"), said.stderr
        )
        self.write("c.hal", "loadrt and2 names=a\nnet s far.out => a.in0\n")
        self.assertIn("far.out", self.bad("check", "c.hal"))
        said = self.run_program("check", "--assume", "far", "c.hal")
        self.assertEqual(0, said.returncode, said.stderr)
        self.assertIn(
            "1 line depends on 'far', which is assumed to exist; it was not checked [unchecked-lines]",
            said.stderr,
        )

    def test_a_component_that_needs_its_hardware_can_be_assumed(self):
        self.write(
            "c.hal",
            "loadrt modbus config=far.modbus\naddf modbus.0.receive t\nloadrt and2 names=a\n"
            "net s modbus.0.ready => a.in0\nnet u a.out => a.in7\n",
        )
        self.assertIn("far.modbus", self.bad("check", "c.hal"))
        said = self.bad("check", "--assume", "modbus", "c.hal")
        self.assertNotIn("far.modbus", said)
        self.assertIn("unknown pin 'a.in7'", said)
        self.assertIn("on 'modbus', which is assumed to exist", said)

    def test_what_depends_on_a_failed_loadrt_is_counted_with_its_error(self):
        self.write(
            "c.hal",
            "loadrt modmath mod_dir=none\nloadrt threads name1=t period1=1000000\n"
            "addf mod-dir.0 t\nsetp mod-dir.0.desired 3\nloadrt and2 names=a\naddf a t\n"
            "setp a.in7 1\n",
        )
        said = self.bad("check", "c.hal")
        self.assertEqual(
            ["mod_dir=none is not a whole number", "unknown pin 'a.in7'"],
            [line.split(": ")[-1].split(" [")[0] for line in self.errors(said)],
            said,
        )
        self.assertIn("= help: 2 lines depend on it; they were not checked\n", said)

    def test_the_verdict_has_the_number_of_lines_that_were_not_checked(self):
        self.write("c.hal", "loadrt and2 names=a\nloadusr -Wn p pyvcp p.xml\nnet s p.x => a.in0\n")
        self.write("d.hal", "net t p.y => a.in1\nnet u p.z\n")
        self.write("e.hal", "setp a.in0 1\n")
        said = self.run_program("check", "c.hal", "d.hal").stderr
        self.assertIn("\nc.hal: no errors; 1 line was not checked\n", said)
        self.assertTrue(said.endswith("\nd.hal: no errors; 2 lines were not checked\n"), said)
        self.write("f.hal", "loadrt and2 names=a\n")
        said = self.run_program("check", "f.hal", "e.hal").stderr
        self.assertTrue(said.endswith("f.hal: no errors\ne.hal: no errors\n"), said)

    def test_files_of_the_library(self):
        self.write("x.ini", "[HAL]\nHALFILE = LIB:nowhere.hal\n")
        self.assertIn(
            "'LIB:nowhere.hal' cannot be read: it is not in HALLIB_DIR", self.bad("check", "x.ini")
        )
        del self.environment["HALLIB_DIR"]
        self.assertIn("HALLIB_DIR is not set", self.bad("check", "x.ini"))
        self.write("library/s.hal", "loadrt and2 names=q\nprint found\n")
        self.write("y.ini", "[HAL]\nHALFILE = s.hal\n")
        self.environment["HALLIB_PATH"] = ".:" + str(self.folder / "library")
        self.assertIn("no errors", self.run_program("check", "y.ini").stderr)
        self.assertIn("HALCMD MSG: found", self.run_program("y.ini", name="halrun").stderr)

    def test_commands_that_act_or_look_are_rejected_as_when_they_run(self):
        start = "loadrt threads name1=t period1=1000000\nloadrt and2 names=a\naddf a t\nnewsig good bit\n"
        last_line = re.compile(
            r"\n\d+ errors?.*\n$|no time simulated.*\n|.*no function has run.*\n"
        )
        for line in (
            "getp a.in9",
            "gets godo",
            "gets a.in0",
            "ptype a",
            "stype nothing",
            "show foo",
            "show pin -t x",
            "list foo",
            "list",
            "status foo",
            "save foo",
            "help foo",
            "debug x",
            "explain foo",
            "advance 3",
            "lock foo",
            "unlock foo",
            "fault foo",
            "unloadusr foo",
            "waitusr and2",
            "loadusr",
            "loadusr -x true",
            "loadusr -w --restart=always true",
            "loadusr -Wn a sleep 9",
            "source missing.hal",
        ):
            with self.subTest(line=line):
                self.write("one.hal", start + line + "\n")
                texts = [
                    last_line.sub("", self.bad(command, "one.hal")) for command in ("check", "sim")
                ]
                self.assertEqual(texts[1].rstrip("\n"), texts[0].rstrip("\n"))
                self.write("outer.hal", "source one.hal\n")
                self.assertIn(texts[0].rstrip("\n"), self.bad("check", "outer.hal"))

    def test_commands_that_look_have_no_effect(self):
        self.write(
            "a.hal",
            SERVO + "save all out.hal\ndebug 5\nshow\ngetp adder.out\nhelp\nadvance 10 cycles\n"
            "loadusr -Wn panel pyvcp panel.xml\ngetp panel.led\nunloadusr panel\nfault clear\n",
        )
        done = self.run_program("check", "a.hal")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("depends on program 'pyvcp', which is not started here", done.stderr)
        self.assertFalse((self.folder / "out.hal").exists())

    def test_a_file_with_errors_is_used_for_the_next_file(self):
        self.write("a.hal", SERVO + "setp adder.nothing 1\n")
        said = self.bad("check", "a.hal", self.write("b.hal", "net total => adder.in0\n"))
        self.assertEqual(1, len(self.errors(said)), said)


MOTION = """loadrt trivkins coordinates=XY
loadrt motmod servo_period_nsec=1000000 num_joints=2 num_spindles=1
loadrt pid names=pid.x
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf pid.x.do-pid-calcs servo-thread
net x-command joint.0.motor-pos-cmd => pid.x.command
net x-output pid.x.output
"""


class Motion(Case):
    """LinuxCNC's motion controller is checked by the names that it has, also where it is not installed."""

    ASSUMED = ("--assume", "trivkins", "--assume", "motmod")

    def setUp(self):
        super().setUp()
        self.environment["HAL_RTMOD_DIR"] = "/nowhere"

    def check(self, lines, status=0, netlist=MOTION):
        self.write("m.hal", netlist + lines)
        done = self.run_program("check", *self.ASSUMED, "m.hal")
        self.assertEqual(status, done.returncode, done.stderr)
        return done.stderr

    def test_a_complete_netlist_has_no_errors(self):
        said = self.check(
            "setp joint.1.jog-scale 1\nnet home joint.0.home-sw-in <= joint.1.homed\n"
            "setp spindle.0.at-speed 1\nsetp axis.w.jog-enable 1\nsetp motion.digital-in-03 1\n"
            "net index joint.0.index-enable spindle.0.index-enable\n"
        )
        self.assertTrue(said.endswith("m.hal: no errors\n"), said)

    def test_a_typing_error_is_found(self):
        said = self.check("net x-position joint.0.motor-pos-fbx\n", 1)
        self.assertIn("error: unknown pin 'joint.0.motor-pos-fbx'", said)
        self.assertIn("did you mean 'joint.0.motor-pos-fb'?", said)

    def test_types_and_directions_are_checked(self):
        self.assertIn("[type-mismatch]", self.check("net x-output joint.0.home-sw-in\n", 1))
        self.assertIn("[two-writers]", self.check("net x-output joint.0.pos-fb\n", 1))

    def test_the_arguments_give_the_numbers(self):
        for name in (
            "joint.2.pos-cmd",
            "spindle.1.on",
            "motion.digital-out-04",
            "motion.misc-error-00",
            "joint.0.unlock",
            "joint.1.posthome-cmd",
        ):
            self.assertIn(f"unknown pin '{name}'", self.check(f"net s {name}\n", 1))
        larger = MOTION.replace(
            "num_joints=2 num_spindles=1",
            "num_joints=3 num_extrajoints=1 num_spindles=2 num_dio=5 num_misc_error=1 "
            "unlock_joints_mask=1 names_ain=load,heat base_period_nsec=500000",
        )
        said = self.check(
            "net a joint.2.pos-cmd\nnet b spindle.1.on\nnet c motion.digital-out-04\n"
            "net d motion.misc-error-00\nnet e joint.0.unlock\nsetp joint.2.posthome-cmd 1\n"
            "net g motion.ain-heat\nloadrt and2 names=q\naddf q base-thread\n",
            netlist=larger,
        )
        self.assertTrue(said.endswith("m.hal: no errors\n"), said)
        self.assertIn(
            "num_joints=17 is outside 1..16",
            self.check("", 1, MOTION.replace("num_joints=2", "num_joints=17")),
        )
        self.assertIn(
            "did you mean 'num_joints'?",
            self.check("", 1, MOTION.replace("num_joints=2", "num_jionts=2")),
        )

    def test_names_of_programs_are_counted(self):
        said = self.check("net tool iocontrol.0.tool-change\nnet on halui.machine.is-on\n")
        self.assertIn("2 lines depend on programs of LinuxCNC, which are not started here", said)
        self.assertTrue(said.endswith("m.hal: no errors; 2 lines were not checked\n"), said)

    def test_an_own_home_module_may_add_pins_to_the_joints(self):
        own = "net own joint.0.torque-at-stop\n"
        self.assertIn("unknown pin 'joint.0.torque-at-stop'", self.check(own, 1))
        self.write("m.hal", MOTION + own)
        self.write("m.ini", "[HAL]\nHALFILE = m.hal\n[EMCMOT]\nHOMEMOD = torquehome limit=2\n")
        done = self.run_program("check", *self.ASSUMED, "m.ini")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn(
            "1 line depends on module 'torquehome', which is not loaded here", done.stderr
        )
        self.ASSUMED = (*self.ASSUMED, "--assume", "homecomp")
        self.check(own, netlist="loadrt homecomp\n" + MOTION)

    def test_without_linuxcnc_the_other_lines_are_checked(self):
        self.write("m.hal", MOTION + "net x-position joint.0.motor-pos-fbx\n")
        said = self.bad("check", "m.hal")
        for error in (
            "unknown component 'trivkins'",
            "unknown component 'motmod'",
            "unknown pin 'joint.0.motor-pos-fbx'",
        ):
            self.assertIn(error, said)
        self.assertTrue(said.endswith("\n3 errors\n"), said)


class SpecialFiles(Case):
    """A FIFO without a writer would block the reader; a device may never end; a directory is not a text file."""

    def setUp(self):
        super().setUp()
        os.mkfifo(self.folder / "fifo.hal")
        os.mkfifo(self.folder / "fifo.ini")
        for kind in ("cpp", "c", "comp", "matrices", "canopen", "tdma", "eds", "pcapng", "log"):
            os.mkfifo(self.folder / f"fifo.{kind}")
        (self.folder / "folder.hal").mkdir()
        (self.folder / "zero.hal").symlink_to("/dev/zero")
        (self.folder / "fifo.dds").symlink_to("fifo.hal")

    def test_every_command_that_reads_a_file(self):
        for name, why in (
            ("fifo.hal", "FIFO"),
            ("folder.hal", "directory"),
            ("zero.hal", "device"),
        ):
            self.write("source.hal", f"source {name}\n")
            self.write("named.ini", f"[HAL]\nHALFILE = {name}\n")
            for words in (
                ["check", name],
                ["run", name],
                ["sim", name],
                ["fmt", name],
                ["graph", name],
                ["check", "source.hal"],
                ["run", "source.hal"],
                ["sim", "source.hal"],
                ["check", "named.ini"],
                ["run", "named.ini"],
                ["sim", "--ini", name, "source.hal"],
            ):
                with self.subTest(words=words):
                    self.assertIn(why, self.bad(*words))
        for words in (
            ["check", "fifo.ini"],
            ["sim", "fifo.ini"],
            ["compile", "fifo.cpp"],
            ["compile", "fifo.c"],
            ["compile", "fifo.comp"],
        ):
            with self.subTest(words=words):
                self.assertRegex(self.bad(*words), "FIFO|regular file")
        self.write("included.ini", "#INCLUDE fifo.ini\n")
        self.assertIn("FIFO", self.bad("check", "included.ini"))

    @needs_package("canopen")
    def test_as_a_file_of_canopen(self):
        for words in (["canopen", "check", "fifo.canopen"], ["can", "eds", "check", "fifo.eds"]):
            with self.subTest(words=words):
                self.assertRegex(self.bad(*words), "FIFO|regular file")

    def test_in_a_running_machine(self):
        self.start("run", self.write("a.hal", SERVO))
        self.assertIn("FIFO", self.shell("source", "fifo.hal").stderr)
        self.assertIn("FIFO", self.shell("-f", "fifo.hal").stderr)
        self.assertIn("FIFO", self.run_program("-f", "fifo.hal", name="halcmd").stderr)

    def test_a_descriptor_of_the_shell_is_read(self):
        done = subprocess.run(
            ["bash", "-c", f"exec '{self.hal()}' sim <(echo print hello)"],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
        self.assertIn("HALCMD MSG: hello", done.stderr)

    @staticmethod
    def hal():
        from harness import HAL

        return HAL


class Parts(Case):
    """A netlist that another one reads has one cause for many errors: it is not complete."""

    def test_a_part_names_what_reads_it(self):
        self.write("machine.hal", "loadrt threads name1=t period1=1000000\nsource part.hal\n")
        self.write("other.hal", SERVO + "source 'part.hal'\n")
        self.write("part.hal", "loadrt siggen\n" + "addf siggen.0.update t\n" * 5)
        self.assertEqual(
            "hal check: 'part.hal' is a part of 'machine.hal', 'other.hal', and has 5 errors by itself; type: hal check machine.hal\n",
            self.bad("check", "part.hal"),
        )

    def test_few_errors_are_printed(self):
        self.write("machine.hal", "source part.hal\n")
        self.write("part.hal", "addf siggen.0.update t\n")
        error = self.bad("check", "part.hal")
        self.assertIn("part.hal:1:6: error: unknown function 'siggen.0.update'", error)
        self.assertTrue(error.endswith("\n2 errors\n"), error)

    def test_an_ini_file_reads_parts_too(self):
        self.write("machine.ini", "[HAL]\nHALFILE = first.hal\nHALFILE = part.hal\n")
        self.write("part.hal", "addf siggen.0.update t\n" * 5)
        self.assertEqual(
            "hal check: 'part.hal' is a part of 'machine.ini', and has 10 errors by itself; type: hal check machine.ini\n",
            self.bad("check", "part.hal"),
        )

    def test_a_part_that_is_complete_is_good(self):
        self.write("machine.hal", "source part.hal\n")
        self.write("part.hal", SERVO)
        done = self.run_program("check", "part.hal")
        self.assertEqual((0, "part.hal: no errors\n"), (done.returncode, done.stderr))


if __name__ == "__main__":
    unittest.main()
