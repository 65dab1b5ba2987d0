#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""What LinuxCNC 2.10 has beyond 2.9: its compiled modules, its programs, its order of starting, a source tree that was built in place. The modules and
programs are of these tests, compiled here; LinuxCNC is not needed."""
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, TIMEOUT
from linuxcnc_case import HALFILE, INI, LinuxcncCase
from module_case import CC, ModuleCase, THREAD

PROGRAMS = Path(__file__).resolve().parent / "linuxcnc_programs"
LIBRARY = HAL.parent.parent / "lib/halcyon/linuxcnc"
PYTHON = HAL.parent.parent / "python"
PORT = "net bytes handles.to => handles.from\nsets bytes 8\n"


@unittest.skipUnless(CC, "no C compiler")
class Modules(ModuleCase):
    def good_sim(self, text):
        return self.good("sim", "--quiet", self.write("m.hal", text))

    def works(self, text):
        done = self.sim(text)
        self.assertEqual(0, done.returncode, done.stderr)

    def test_pins_and_parameters_by_handle(self):
        self.build("handles")
        names = ("bit", "u32", "u64", "real", "s32", "s64")
        outputs = (
            "".join(f"getp handles.{name}-out\n" for name in names)
            + "getp handles.old\ngetp handles.cycles\n"
        )
        text = (
            THREAD
            + "loadrt handles\naddf handles.copy t\n"
            + PORT
            + "start\nadvance 2 cycles\n"
            + outputs
        )
        self.assertEqual(
            "TRUE\n4000000000\n18446744073709551615\n1.75\n-3\n-5000000000\n5000000000\n2\n",
            self.good_sim(text),
        )
        text += (
            "setp handles.bit 0\nsetp handles.u32 7\nsetp handles.u64 9223372036854775808\nsetp handles.real -2\nsetp handles.s32 -2147483648\nsetp handles.s64 9\n"
            "setp handles.step 1\nsetp handles.most 4\nadvance 10 cycles\n" + outputs
        )
        self.assertEqual(
            "FALSE\n7\n9223372036854775808\n-1\n-2147483648\n9\n-9\n4\n",
            "".join(self.good_sim(text).splitlines(True)[8:]),
        )

    def test_a_function_that_runs_once(self):
        self.build("early")
        self.assertEqual(
            "1\n1\n",
            self.good_sim(
                THREAD
                + "loadrt early\nstart\nadvance 5 cycles\ngetp early.count\ngets early-wide\n"
            ),
        )
        error = self.sim("loadrt early\n").stderr
        self.assertIn("'t'", error)
        self.assertIn("early", error)

    def test_pins_by_handle_follow_their_signals(self):
        self.build("handles")
        text = THREAD + (
            "loadrt handles\naddf handles.copy t\nnet wide s64 handles.s64-out => handles.s64\nnet whole handles.s32-out\nstart\nadvance 3 cycles\n"
            "gets wide\ngets whole\nunlinkp handles.s64\nsetp handles.s64 12\nadvance 2 cycles\ngets wide\n"
        )
        self.assertEqual("0\n-3\n12\n", self.good_sim(text.replace("net wide s64", "net wide")))

    def test_a_parameter_by_handle_that_is_read_only(self):
        self.build("handles")
        self.assertIn("RO", self.good_sim("loadrt handles\nshow param handles.cycles\n"))
        done = self.sim("loadrt handles\nsetp handles.cycles 5\n")
        self.assertEqual(1, done.returncode)

    def test_a_machine_runs_the_modules_of_one_version(self):
        self.build("handles", "bytes")
        both = "loadrt handles\nloadrt bytes\n"
        self.assertEqual(
            """m.hal:2:8: error: component 'bytes' cannot make 'bytes': it is built for LinuxCNC 2.9, and 'handles', which is loaded, for 2.10: a machine runs the modules of one version [construct-failed]
    2 | loadrt bytes
      |        ^^^^^
      = help: take all modules from the folder of one LinuxCNC, which HAL_RTMOD_DIR names
""",
            self.error(both).split("\n\n")[0] + "\n",
        )
        self.assertIn(
            "it is built for LinuxCNC 2.10, and 'bytes', which is loaded, for 2.9: a machine",
            self.error("loadrt bytes\nloadrt handles\n"),
        )
        self.works(
            "loadrt bytes\nstart\nunloadrt bytes\nstart\nloadrt handles\nstart\nunloadrt handles\nstart\nloadrt bytes\n"
        )
        self.build("gain")  # uses nothing in which they differ
        self.works("loadrt gain\nloadrt handles\n")
        self.works("loadrt gain\nloadrt bytes\n")

    def test_the_hal_in_its_folder_shows_the_version_of_a_module(self):
        self.build("gain")
        self.build("gain", "handles")
        for function in ("hal_pin_new_bool", "hal_init"):
            (self.folder / "hal_lib.c").write_text(f"int {function}(void) {{ return 0; }}\n")
            subprocess.run(
                [
                    CC,
                    "-shared",
                    "-fPIC",
                    "-o",
                    str(self.modules / "hal_lib.so"),
                    str(self.folder / "hal_lib.c"),
                ],
                check=True,
            )
            if function == "hal_init":
                self.assertIn(
                    "it is built for LinuxCNC 2.10, and 'gain', which is loaded, for 2.9:",
                    self.error("loadrt gain\nloadrt handles\n"),
                )
            else:
                self.works("loadrt gain\nloadrt handles\n")

    def test_a_module_of_a_version_to_come(self):
        (self.folder / "other.c").write_text(
            "int hal_pin_quad(void);\nint rtapi_app_main(void) { return hal_pin_quad(); }\nvoid rtapi_app_exit(void) {}\n"
        )
        subprocess.run(
            [
                CC,
                "-shared",
                "-fPIC",
                "-o",
                str(self.modules / "other.so"),
                str(self.folder / "other.c"),
            ],
            check=True,
        )
        self.assertIn(
            "it uses hal_pin_quad, which is not in the interface of LinuxCNC 2.9 or 2.10: the module is built for another version [construct-failed]",
            self.error("loadrt other\n"),
        )


@unittest.skipUnless(CC, "no C compiler")
class Programs(ModuleCase):
    def test_pins_by_handle_and_values_by_name(self):
        subprocess.run(
            [
                CC,
                "-O1",
                "-o",
                str(self.folder / "newer"),
                str(PROGRAMS / "newer.c"),
                f"-L{LIBRARY}",
                "-l:liblinuxcnchal.so.0",
            ],
            check=True,
        )
        machine = self.start(
            "run",
            self.write(
                "m.hal",
                "newthread servo 1000000\nloadrt sum2 names=adder\naddf adder servo\nnewsig sum float\nlinkps adder.in0 sum\nstart\n",
            ),
        )
        self.say("loadusr", "-Wn", "newer", "sh", "-c", f"{self.folder}/newer > {self.folder}/out")
        self.comes("newer.in", "2.5")
        self.comes("newer.whole", "-4")
        self.assertEqual(
            ["TRUE", "-5000000000", "7"],
            [self.value(f"newer.{name}") for name in ("bit", "wide", "parameter")],
        )
        self.assertEqual(
            """init 0 0 1
adder.in0: kind 1 type 2 dir 16 sum 0
set 0 as a parameter -2 as s32 -17 signal 0 by a function 0 that fails -5
adder.in1: kind 1 type 2 dir 16 - 4
adder.in0: kind 1 type 2 dir 16 sum 42
newer.parameter: kind 2 type 4 dir 192 - 7
sum: kind 3 type 2 writers 0 readers 1 42
nothing: -2
Invalid argument
""",
            (self.folder / "out").read_text(),
        )
        self.say("setp", "newer.in", "1")  # from outside it is an input as any other
        self.comes("newer.bit", "FALSE")
        self.say("net", "x", "newer.in", "adder.out")
        self.say("setp", "adder.in1", "-39.5")
        self.comes("newer.in", "2.5")
        self.comes("newer.bit", "TRUE")
        self.end(machine)


@unittest.skipUnless(
    CC and list(PYTHON.glob("hal/_core*.so")), "no C compiler, or Python's module hal is not built"
)
class Python(ModuleCase):
    def setUp(self):
        super().setUp()
        self.environment["PYTHONPATH"] = str(PYTHON)

    def python(self, text):
        done = subprocess.run(
            [sys.executable, "-c", text],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout

    def test_it_reads_the_stream_of_a_module(self):
        self.build("samples")
        machine = self.start(
            "run",
            self.write(
                "m.hal",
                "newthread servo 1000000\nloadrt samples\naddf samples servo\nsetp samples.real 2.5\nsetp samples.whole -3\nstart\n",
            ),
        )
        self.assertEqual(
            "True b'fs' 1000 True (2.5, -3) 1\n",
            self.python(
                """import hal
c = hal.component("reader")
s = hal.stream(c, hal.sampler_base, "fs")
while not s.readable: pass
first = s.read(), s.sampleno
while s.depth < 2: pass
s.read()
print(s.sampleno == first[1] + 1, s.element_types, s.maxdepth, s.writable, first[0], first[1] // first[1])
for wrong in ((hal.sampler_base, "ss"), (hal.sampler_base + 1,)):
    try: print(hal.stream(c, *wrong))
    except hal.StreamError: pass
"""
            ),
        )
        self.end(machine)

    def test_programs_of_a_linuxcnc_built_in_place_find_ours(self):
        theirs = self.folder / "cnc/lib/python"
        theirs.mkdir(parents=True)
        (theirs / "hal.py").write_text("raise ImportError('needs the library of LinuxCNC')\n")
        (theirs / "_hal.so").write_text("not a library")
        (theirs / "other.py").write_text("name = 'of LinuxCNC'\n")
        own = self.folder / "own"
        own.mkdir()
        (own / "hal.py").write_text("name = 'of the user'\n")
        text = f"import sys\nsys.path.insert(0, '{theirs}')\nimport _hal, hal, other\nprint(hal.HAL_BIT, other.name, _hal.component is hal.component)\n"
        self.environment["LINUXCNC_HOME"] = str(self.folder / "cnc")
        self.assertEqual("1 of LinuxCNC True\n", self.python(text))
        self.assertEqual(
            "of the user\n",
            self.python(f"import sys\nsys.path.insert(0, '{own}')\nimport hal\nprint(hal.name)\n"),
        )
        (own / "sitecustomize.py").write_text(
            "import sys\nsys.of_the_user = 7\n"
        )  # is not hidden by ours
        self.environment["PYTHONPATH"] += f":{own}"
        self.assertEqual(
            "7 1\n", self.python("import sys, hal\nprint(sys.of_the_user, hal.HAL_BIT)\n")
        )

    def test_displays_derive_a_class_from_a_pin(self):
        machine = self.start("run", self.write("m.hal", "newthread servo 1000000\nstart\n"))
        self.assertEqual(
            "x 2 32 4.5 x\n",
            self.python(
                """import _hal, hal
class Shown(hal.Pin):
    def __init__(self, *words):
        hal.Pin.__init__(self, *words)
        self._item_wrap(self._item)
        self.shown = None
c = hal.component("c")
pin = Shown(_hal.component.newpin(c, "x", hal.HAL_FLOAT, hal.HAL_OUT))
c.ready()
pin.set(4.5)
print(pin.name, pin.type, pin.dir, pin.value, _hal.component.getpin(c, "x").get_name())
"""
            ),
        )
        self.end(machine)


class Machine(LinuxcncCase):
    def version(self, text):
        path = self.home / "bin/linuxcnc_var"
        path.write_text(f"#!/bin/sh\necho {text}\n")
        path.chmod(0o755)

    def test_task_has_the_io_and_starts_before_the_netlists(self):
        self.version("2.10.0~pre1")
        (self.home / "bin/io").unlink()
        self.install("hal_bridge")
        self.display(
            'echo "linuxcnc_check_ini $*" >> $STANDIN_LOG', "installed/bin/linuxcnc_check_ini"
        )
        self.write("machine.hal", HALFILE + "loadusr -w note netlist\n")
        self.display('note "$LINUXCNCVERSION" ui $*')
        out, err = self.linuxcnc(
            "-v",
            self.ini(
                "[HAL]\nHALFILE = machine.hal\nHALUI = halui\nHALBRIDGE = hal_bridge -d\nHALCMD = setp adder.in1 5\n"
            ),
        )
        self.assertEqual(
            (
                "check the configuration\nstart linuxcncsvr\nload sum2\nload mult2\nstart milltask\nstart halui\nstart hal_bridge\nload the netlists of [HAL]HALFILE\n"
                "start the threads\nstart the display ./ui\nend the display\nend milltask\nend linuxcncsvr\nstop the threads\nunload everything\n",
                "",
            ),
            (out, err),
        )
        self.assertEqual(
            [
                "linuxcnc_check_ini CONFIG/machine.ini",
                "linuxcncsvr -ini CONFIG/machine.ini",
                "milltask -ini CONFIG/machine.ini",
                "halui -ini CONFIG/machine.ini",
                "hal_bridge -d",
                "note netlist",
                "note 2.10.0~pre1 ui -ini CONFIG/machine.ini",
            ],
            [line.replace(str(self.folder), "CONFIG") for line in self.logged()[:7]],
        )

    def test_a_configuration_that_the_checker_rejects(self):
        self.version("2.10.1")
        self.display("echo bad; exit 1", "installed/bin/linuxcnc_check_ini")
        out, _ = self.linuxcnc(self.ini(), status=1)
        self.assertEqual("bad\n", out)

    def test_another_version_is_rejected_before_anything_starts(self):
        for version in ("2.8.4", "2.11.0~pre0", "3.0"):
            self.version(version)
            self.assertEqual(
                f"hal linuxcnc: LinuxCNC in CONFIG/installed is version {version}; 2.9 and 2.10 are supported: LINUXCNC_HOME names another installation\n",
                self.linuxcnc(self.ini(), status=1)[1],
            )
        self.assertFalse(self.log.exists())
        self.version("2.9.4")
        self.assertEqual("", self.linuxcnc(self.ini())[1])

    def test_a_source_tree_that_is_not_built(self):
        (self.home / "rtlib").mkdir()
        (self.home / "bin/milltask").unlink()
        self.assertEqual(
            "hal linuxcnc: 'milltask' is missing in the source tree CONFIG/installed, which LINUXCNC_HOME names; build it there\n",
            self.linuxcnc(self.ini(), status=1)[1],
        )

    def test_a_source_tree_that_was_built_in_place(self):
        for folder in ("rtlib", "scripts", "lib/hallib"):
            (self.home / folder).mkdir(parents=True)
        (self.home / "bin/milltask").rename(self.home / "scripts/milltask")
        (self.home / "lib/hallib/machine.hal").write_text(HALFILE)
        Path(self.write("machine.hal", "")).unlink()
        self.environment.pop("HAL_RTMOD_DIR", None)
        self.environment[
            "STANDIN_SHOW"
        ] = "NMLFILE HAL_RTMOD_DIR HALLIB_DIR LINUXCNC_TCL_DIR LINUXCNC_NCFILES_DIR EMC2_HOME LD_LIBRARY_PATH TCLLIBPATH"
        self.assertEqual("", self.linuxcnc(self.ini())[1])
        log = self.log.read_text().replace(str(self.folder), "CONFIG")
        self.assertIn(
            """  NMLFILE=CONFIG/installed/configs/common/linuxcnc.nml
  HAL_RTMOD_DIR=CONFIG/installed/rtlib
  HALLIB_DIR=CONFIG/installed/lib/hallib
  LINUXCNC_TCL_DIR=CONFIG/installed/tcl
  LINUXCNC_NCFILES_DIR=CONFIG/installed/nc_files
  EMC2_HOME=CONFIG/installed
  LD_LIBRARY_PATH="""
            + f"{LIBRARY}:CONFIG/installed/lib\n  TCLLIBPATH=CONFIG/installed/tcl\n",
            log,
        )


if __name__ == "__main__":
    unittest.main()
