#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""hal linuxcnc: the order in which everything starts and ends, its environment, and what goes wrong."""

import os
import signal
import socket
import time
import unittest
from pathlib import Path

from harness import HAL, SERVO, TIMEOUT, wait_until
from linuxcnc_case import HALFILE, INI, LinuxcncCase, PLAIN, prompt


class Linuxcnc(LinuxcncCase):
    def test_everything_starts_and_ends_in_linuxcncs_order(self):
        self.write("machine.hal", HALFILE + "loadusr -w note netlist\n")
        self.write("end.hal", "loadusr -w note shutdown\n")
        self.display(
            "note ui $*; note adder is `halcmd getp adder.out`; sleep 0.2; note adder is `halcmd getp adder.out`"
        )
        ini = self.ini(
            PLAIN
            + "HALUI = halui\nSHUTDOWN = end.hal\nHALCMD = setp adder.in1 5\n[APPLICATIONS]\nAPP = note application\nDELAY = 0.01\n"
        )
        text = (Path(ini).read_text()).replace("./ui", "./ui a")
        out, err = self.linuxcnc("-v", self.write("machine.ini", text), "--", "b")
        self.assertEqual(
            (
                "check the configuration: left out\nstart linuxcncsvr\nstart io\nstart halui\nload sum2\nload mult2\n"
                "load the netlists of [HAL]HALFILE\nstart milltask\nstart the threads\nstart note\nstart the display ./ui\n"
                "end the display\nend milltask\nend linuxcncsvr\nrun end.hal\nstop the threads\nunload everything\n",
                "",
            ),
            (out, err),
        )
        log = self.logged()
        log.remove("note application")  # beside the display
        first = (
            log.index("note adder is 0")
            if "note adder is 0" in log
            else log.index("note adder is 7")
        )
        del log[first]
        self.assertEqual(
            [
                "linuxcncsvr -ini CONFIG/machine.ini",
                "io -ini CONFIG/machine.ini",
                "halui -ini CONFIG/machine.ini",
                "note netlist",
                "milltask -ini CONFIG/machine.ini",
                "note ui -ini CONFIG/machine.ini a b",
                "note adder is 7",
                "milltask ends",
                "linuxcncsvr ends",
                "note shutdown",
            ],
            log[:10],
        )
        self.assertEqual({"halui ends", "io ends"}, set(log[10:]))

    def test_the_environment_is_linuxcncs(self):
        names = (
            "INI_FILE_NAME CONFIG_DIR NMLFILE HALLIB_DIR HALLIB_PATH HALCMD REALTIME LINUXCNC_HOME LINUXCNC_TCL_DIR LINUXCNC_LANG_DIR LINUXCNC_HELP_DIR "
            "LINUXCNC_NCFILES_DIR TRAJ_COORDINATES KINS_KINEMATICS HALCYON_INSTANCE"
        )
        self.environment["STANDIN_SHOW"] = names
        self.linuxcnc("-H", self.folder, "--name", "mill", self.ini())
        log = self.log.read_text().replace(str(self.folder), "CONFIG").splitlines()
        begin = log.index("io -ini CONFIG/machine.ini") + 1
        self.assertEqual(
            """  INI_FILE_NAME=CONFIG/machine.ini
  CONFIG_DIR=CONFIG
  NMLFILE=CONFIG/installed/share/linuxcnc/linuxcnc.nml
  HALLIB_DIR=CONFIG/installed/share/linuxcnc/hallib
  HALLIB_PATH=CONFIG:.:CONFIG/installed/share/linuxcnc/hallib
  HALCMD=halcmd
  REALTIME=true
  LINUXCNC_HOME=CONFIG/installed
  LINUXCNC_TCL_DIR=CONFIG/installed/lib/tcltk/linuxcnc
  LINUXCNC_LANG_DIR=CONFIG/installed/lib/tcltk/linuxcnc/msgs
  LINUXCNC_HELP_DIR=CONFIG/installed/share/doc/linuxcnc
  LINUXCNC_NCFILES_DIR=CONFIG/installed/share/linuxcnc/ncfiles
  TRAJ_COORDINATES=X Y Z
  KINS_KINEMATICS=trivkins
  HALCYON_INSTANCE=mill""",
            "\n".join(log[begin : begin + 15]),
        )

    def test_a_folder_that_cannot_be_written_to_says_what_to_do(self):
        self.write("more.inc", "[TASK]\n")
        (
            self.folder / "machine.ini.expanded"
        ).mkdir()  # an ordinary user's reason is a folder of root's
        err = self.linuxcnc(self.ini(PLAIN + "#INCLUDE more.inc\n"), status=1)[1]
        (self.folder / "machine.ini.expanded").rmdir()
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini has #INCLUDE, so a file with the included text is needed beside it: cannot write "
            "'CONFIG/machine.ini.expanded': Is a directory; copy the configuration, with the files that it names, to a folder that you can write to "
            "(LinuxCNC also keeps its parameters there), and run the copy\n",
            err,
        )
        self.environment["TMPDIR"] = str(self.folder / "none")
        self.assertEqual(
            "hal linuxcnc: cannot open the lock file CONFIG/none/linuxcnc.lock: No such file or directory; create its folder, which $TMPDIR names\n",
            self.linuxcnc(self.ini(), status=1)[1],
        )

    def test_programs_find_halcmd_and_a_wrapper_beside_the_ini_file_comes_first(self):
        self.display("note `halcmd getp adder.in0`; note `command -v halcmd`")
        self.linuxcnc(self.ini())
        self.assertIn(f"note {HAL.parent.parent}/lib/halcyon/linuxcnc/bin/halcmd", self.logged())
        self.assertIn("note 2", self.logged())
        (self.folder / "bin").mkdir()
        self.display("echo wrapped", "bin/halcmd")
        self.linuxcnc(self.ini())
        self.assertIn("note wrapped", self.logged())

    def test_an_ini_file_that_is_a_link_names_files_beside_the_link(self):
        real = self.folder / "shared"
        real.mkdir()
        Path(self.ini()).rename(real / "machine.ini")
        (self.folder / "linked.ini").symlink_to(real / "machine.ini")
        self.assertEqual("", self.linuxcnc("linked.ini")[1])

    def test_a_journal_is_written_and_executed_again(self):
        ini = self.ini(PLAIN + "HALCMD = setp adder.in1 5\n")
        self.display("until [ `halcmd getp servo.threadbeat` -gt 50 ]; do sleep 0.01; done")
        out, err = self.linuxcnc("--journal", "run.mcap", ini)
        self.assertRegex(err, r"^run\.mcap: \d+ cycles\n$|^\S*/run\.mcap: \d+ cycles\n$")
        text = self.good("replay", "--exact", "run.mcap", "--until", "50", "--show", "adder.out")
        self.assertTrue(text.endswith("stopped; no difference so far\nadder.out 7\n"), text)
        self.assertIn("no difference\n", self.good("replay", "--exact", "run.mcap"))

    def test_a_line_of_a_netlist_writes_a_journal(self):
        (self.folder / "config").mkdir()
        (self.folder / "config/machine.hal").write_text("source more.hal\n")
        (self.folder / "config/more.hal").write_text("journal own.mcap keep=9s\n" + HALFILE)
        (self.folder / "config/machine.ini").write_text(INI.replace("./ui", "../ui") + PLAIN)
        self.display("until [ `halcmd getp servo.threadbeat` -gt 50 ]; do sleep 0.01; done")
        out, err = self.linuxcnc("config/machine.ini")
        self.assertRegex(err, r"^own\.mcap: the last 9 s of \d+ cycles\n$")
        self.assertIn("no difference\n", self.good("replay", "--exact", "config/own.mcap"))
        self.assertEqual([], list(self.folder.glob("**/own.mcap.ring")))
        out, err = self.linuxcnc("--journal-keep", "5s", self.ini(), status=1)
        self.assertEqual("hal linuxcnc: --journal-keep needs --journal FILE\n", err)

    def test_arguments_of_linuxcncrsh_come_before_the_ini_file(self):
        _, err = self.linuxcnc(
            self.ini(
                PLAIN + "POSTGUI_HALFILE = later.hal\n", INI.replace("./ui", "linuxcncrsh -p 5008")
            )
        )
        self.assertIn("linuxcncrsh -p 5008 -- -ini CONFIG/machine.ini", self.logged())
        self.assertEqual(
            "hal linuxcnc: note: [HAL]POSTGUI_HALFILE is loaded by the display, and 'linuxcncrsh' does not load it\n",
            err,
        )

    def test_a_dummy_display_waits_for_a_line(self):
        out, err = self.linuxcnc(self.ini(text=INI.replace("./ui", "dummy")), given="\n")
        self.assertEqual(("press Enter to end the machine\n", ""), (out, err))

    def test_the_status_of_the_display_is_that_of_the_run(self):
        self.display("exit 3")
        _, err = self.linuxcnc(self.ini(), status=3)
        self.assertEqual("hal linuxcnc: the display './ui' ended with exit status 3\n", err)

    def test_a_display_that_dies_ends_everything_in_order(self):
        self.display("kill -SEGV $$")
        _, err = self.linuxcnc(self.ini(), status=128 + signal.SIGSEGV)
        self.assertEqual("hal linuxcnc: the display './ui' was terminated by SIGSEGV\n", err)
        self.assertEqual(["milltask ends", "linuxcncsvr ends", "io ends"], self.logged()[-3:])

    def test_a_helper_of_the_display_ends_with_it(self):
        self.display("sleep 1000 & exit 0")
        self.linuxcnc(self.ini())

    def test_a_display_that_ignores_sigterm_is_killed(self):
        self.display("trap '' TERM; touch shown; while :; do sleep 1; done")
        machine = self.runs(self.ini())
        self.assertEqual(("ended by SIGTERM\n", ""), self.end(machine))
        self.assertEqual(0, machine.returncode)

    def pid(self, component):
        line = next(
            line
            for line in self.shell("show", "comp", component).stdout.splitlines()
            if f" {component} " in line
        )
        return int(line.split()[3])

    def dies(self, pid):
        """Standard error of the machine after a program of it was killed."""
        machine = self.runs(self.ini(PLAIN + "HALUI = halui\nSHUTDOWN = end.hal\n"))
        os.kill(pid(), signal.SIGKILL)
        out, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(
            (1, ""),
            (
                machine.returncode,
                "".join(line for line in out.splitlines(True) if "threads" in line),
            ),
        )
        return prompt(err)

    def test_when_task_is_killed_the_outputs_are_safe_before_anything_else_ends(self):
        self.write("machine.hal", HALFILE + "net count adder.out => adder.in1\n")  # counts cycles
        self.write("end.hal", "loadusr -w ./count\n")
        self.display("note `halcmd gets count`; sleep 0.05; note `halcmd gets count`", "count")
        self.display("touch shown; exec sleep 1000")
        err = self.dies(lambda: self.pid("inihal"))
        self.assertRegex(
            err,
            r"\Ahal linuxcnc: 'milltask' \(component inihal\) died at [\d:]+ \(SIGKILL\); the outputs have their safe values, the machine ends\n\Z",
        )
        log = self.logged()
        self.assertEqual(log[-3], log[-4])  # the threads have stopped
        self.assertEqual({"io ends", "halui ends"}, set(log[-2:]))

    def test_when_another_program_is_killed_task_ends_in_order(self):
        self.write("end.hal", "")
        self.display("touch shown; exec sleep 1000")
        err = self.dies(lambda: self.pid("halui"))
        self.assertRegex(
            err, r"\Ahal linuxcnc: 'halui' died at [\d:]+ \(SIGKILL\); the machine ends\n\Z"
        )
        self.assertEqual(["milltask ends", "linuxcncsvr ends", "io ends"], self.logged()[-3:])

    def stops(self, component, rest=""):
        """Standard error of the machine after a program of it was stopped."""
        self.display("touch shown; exec sleep 1000")
        machine = self.runs(self.ini(PLAIN + "HALUI = halui\n" + rest))
        os.kill(self.pid(component), signal.SIGSTOP)
        _, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(1, machine.returncode)
        return prompt(err)

    def test_when_task_is_stopped_the_outputs_are_safe_and_the_machine_ends(self):
        self.assertRegex(
            self.stops("inihal"),
            r"\Ahal linuxcnc: 'milltask' \(component inihal, process \d+\) is stopped by a signal for 1 s; "
            r"the outputs have their safe values, the machine ends\n\Z",
        )

    def test_when_another_program_is_stopped_the_machine_ends(self):
        self.assertRegex(
            self.stops("halui"),
            r"\Ahal linuxcnc: 'halui' \(component halui, process \d+\) is stopped by a signal for 1 s; the machine ends\n\Z",
        )
        self.assertEqual(
            ["milltask ends", "linuxcncsvr ends", "io ends"],
            [line for line in self.logged() if line.endswith("ends") and line != "halui ends"],
        )

    def test_when_tasks_heartbeat_is_missing_the_outputs_are_safe_and_the_machine_ends(self):
        key = 0x48000000 + os.getpid()
        self.environment["STANDIN_STATUS_KEY"] = str(key)
        self.write(
            "test.nml",
            f"B emcCommand SHMEM localhost 8192 0 0 1 16 {key + 1} TCP=5005 xdr queue\nB emcStatus SHMEM localhost 20480 0 0 2 16 {key} TCP=5005 xdr\n",
        )
        self.display("touch shown; exec sleep 1000")
        text = INI.replace("[EMC]\n", "[EMC]\nNML_FILE = test.nml\n")
        machine = self.runs(self.ini(PLAIN + "[HALCYON]\nTASK_TIMEOUT = 2\n", text))
        time.sleep(
            2
        )  # a task is watched once its count has been seen to change, which nothing shows
        (self.folder / "hang").touch()
        _, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(1, machine.returncode)
        self.assertRegex(
            prompt(err),
            r"\Ahal linuxcnc: 'milltask' has ended no cycle for 2\.\d+ s \(\[HALCYON\]TASK_TIMEOUT 2 s\); the outputs have their safe "
            r"values, the machine ends\n\Z",
        )

    # --- a time without CPU ------------------------------------------------------------------------------------------------

    def stalled(self, limit):
        """A machine that had no CPU for half a second."""
        self.display("touch shown; exec sleep 1000")
        machine = self.runs(
            self.ini(text=INI.replace("MAX_CPU_GAP = 60s", f"MAX_CPU_GAP = {limit}"))
        )
        wait_until(lambda: self.value("servo.threadbeat") not in ("", "0"), "the thread runs")
        machine.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        machine.send_signal(signal.SIGCONT)
        return machine

    def test_a_gap_ends_the_machine_that_tolerates_none(self):
        machine = self.stalled(0)
        _, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(1, machine.returncode)
        self.assertRegex(
            err,
            r"(?m)^hal linuxcnc: servo: .*(no CPU time|no cycle) for .*limit 100 ms\) at cycle [\d ]+; the outputs have their safe values, the machine ends$",
        )

    def test_a_gap_is_reported_and_the_machine_goes_on(self):
        machine = self.stalled("30s")
        before = int(self.value("servo.threadbeat"))
        wait_until(lambda: int(self.value("servo.threadbeat")) > before + 200, "the thread runs on")
        self.comes("adder.out", "2")
        time.sleep(0.3)
        machine.send_signal(signal.SIGTERM)
        _, err = machine.communicate(timeout=TIMEOUT)
        self.assertEqual(0, machine.returncode, err)
        self.assertRegex(
            err,
            r"(?m)^(hal linuxcnc: servo: no CPU time for \d+ ms; the machine goes on \(\[HALCYON\]MAX_CPU_GAP 30 s\); see: hal doctor\n)+",
        )

    def test_bad_limits(self):
        for key in ("MAX_CPU_GAP", "TASK_TIMEOUT"):
            text = INI.replace("MAX_CPU_GAP = 60s", f"{key} = never")
            self.assertEqual(
                f"hal linuxcnc: CONFIG/machine.ini: [HALCYON]{key} is 'never', not a time; write 500ms, 2s or 0\n",
                self.linuxcnc(self.ini(text=text), status=1)[1],
            )

    def test_when_the_nml_server_is_killed_everything_ends(self):
        self.write("end.hal", "")
        self.display("touch shown; exec sleep 1000")
        err = self.dies(lambda: int((self.folder / "linuxcnc.lock").read_text().split()[1]))
        self.assertEqual("hal linuxcnc: 'linuxcncsvr' died; the machine ends\n", err)

    def test_ctrl_c_and_sigterm_end_everything(self):
        self.display("touch shown; exec sleep 1000")
        for number, expected in ((signal.SIGINT, ""), (signal.SIGTERM, "ended by SIGTERM\n")):
            machine = self.runs(self.ini())
            self.assertEqual((expected, ""), self.end(machine, number))
            self.assertEqual(0, machine.returncode)
            self.assertEqual(["milltask ends", "linuxcncsvr ends", "io ends"], self.logged()[-3:])
            (self.folder / "shown").unlink()

    def test_ctrl_c_while_a_program_is_starting(self):
        for program in ("io", "milltask"):
            self.environment["STANDIN_SLOW"] = program
            self.log.unlink(missing_ok=True)
            machine = self.start("linuxcnc", self.ini(), loaded=False)
            wait_until(
                lambda: self.log.exists() and f"{program} waits" in self.logged(),
                "the program waits",
            )
            _, err = self.end(machine, signal.SIGINT)
            self.assertIn("interrupted", err)
            self.assertEqual(0, machine.returncode)
            self.assertIn(f"{program} ends", self.logged())

    # --- what does not start -------------------------------------------------------------------------------------------

    def test_a_program_that_does_not_start_ends_those_that_have(self):
        self.environment["STANDIN_FAILS"] = "linuxcncsvr"
        self.assertEqual(
            "linuxcncsvr: cannot do that\nhal linuxcnc: linuxcncsvr ended with exit status 4: another one may be using its TCP port or NML buffers\n",
            self.linuxcnc(self.ini(), status=1)[1],
        )
        self.environment["STANDIN_FAILS"] = "io"
        self.assertEqual(
            """io: cannot do that
CONFIG/machine.ini [EMCIO]EMCIO:1:23: error: 'io' ended before a component 'iocontrol' was ready [program-ended]
    1 | loadusr -Wn iocontrol io -ini CONFIG/machine.ini
      |                       ^^
      = help: it ended with exit status 4; see its messages, which are in the output of the machine
""",
            self.linuxcnc(self.ini(), status=1)[1],
        )
        self.environment["STANDIN_FAILS"] = "milltask"
        self.assertEqual(
            """milltask: cannot do that
CONFIG/machine.ini [TASK]TASK:1:20: error: 'milltask' ended before a component 'inihal' was ready [program-ended]
    1 | loadusr -Wn inihal milltask -ini CONFIG/machine.ini
      |                    ^^^^^^^^
      = help: it ended with exit status 4; see its messages, which are in the output of the machine
""",
            self.linuxcnc(self.ini(), status=1)[1],
        )
        self.assertEqual(
            ["milltask -ini CONFIG/machine.ini", "linuxcncsvr ends", "io ends"], self.logged()[-3:]
        )

    def test_a_package_or_program_that_is_missing(self):
        (self.home / "bin/linuxcncsvr").unlink()
        self.assertEqual(
            "hal linuxcnc: 'linuxcncsvr' is not installed; type: sudo apt-get install linuxcnc-uspace\n",
            self.linuxcnc(self.ini(), status=1, environment={"PATH": "/nowhere"})[1],
        )
        self.install("linuxcncsvr")
        ini = self.ini(text=INI.replace("./ui", "ui"))
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [DISPLAY]DISPLAY is 'ui', which cannot be started: it is not in PATH; for the file beside the INI file "
            "write ./ui\n",
            self.linuxcnc(ini, status=1)[1],
        )
        (self.folder / "ui").chmod(0o644)
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [DISPLAY]DISPLAY is './ui', which cannot be started: it is not executable; type: chmod +x CONFIG/./ui\n",
            self.linuxcnc(self.ini(), status=1)[1],
        )

    def test_a_display_with_windows_needs_a_screen(self):
        axis = self.home / "bin/axis"
        axis.write_text("#!/bin/sh\nexit 0\n")
        axis.chmod(0o755)
        ini = self.ini(text=INI.replace("./ui", "axis"))
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            self.environment.pop(name, None)
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [DISPLAY]DISPLAY is 'axis', which opens windows, and the environment has no DISPLAY; "
            "start it in a terminal of the desktop, or on another computer after: ssh -X\n",
            self.linuxcnc(ini, status=1)[1],
        )
        self.environment["DISPLAY"] = ":4711.0"
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [DISPLAY]DISPLAY is 'axis', which opens windows, and no screen answers at the environment's DISPLAY ':4711.0'; "
            "start it in a terminal of the desktop, or on another computer after: ssh -X\n",
            self.linuxcnc(ini, status=1)[1],
        )
        with socket.socket(socket.AF_UNIX) as screen:
            screen.bind("\0/tmp/.X11-unix/X4711")
            screen.listen()
            self.linuxcnc(ini)
        self.environment["DISPLAY"] = "localhost:10.0"  # of ssh -X: the program finds out
        self.linuxcnc(ini)

    def test_all_errors_of_an_ini_file_are_reported_at_once(self):
        ini = self.ini(
            "[HAL]\nHALFILE = machine.hal\nHALFILE = none.hal\nHALFILE = LIB:none.tcl\n"
            "[APPLICATIONS]\nDELAY = soon\nAPP = nothing\nAPP = ./ui\nAPP = ./none\n",
            INI.replace("1.1", "1.0").replace("./ui", "axsi").replace("60s", "often"),
        )
        self.assertEqual(
            [
                "[EMC]VERSION is 1.0, not 1.1: the file is from an older LinuxCNC; type: update_ini CONFIG/machine.ini",
                "[APPLICATIONS]DELAY is soon, not a time of 0..3600 seconds",
                "[HALCYON]MAX_CPU_GAP is 'often', not a time; write 500ms, 2s or 0",
                "[DISPLAY]DISPLAY is 'axsi', which cannot be started: it is not in PATH",
                "[APPLICATIONS]APP is 'nothing', which cannot be started: it is not in PATH",
                "[APPLICATIONS]APP is './none', which cannot be started: No such file or directory",
                "[HAL]HALFILE is 'none.hal', which cannot be read: No such file or directory",
                "[HAL]HALFILE is 'LIB:none.tcl', which cannot be read: it is not in HALLIB_DIR and not in /usr/share/linuxcnc/hallib",
            ],
            [
                line.removeprefix("hal linuxcnc: CONFIG/machine.ini: ")
                for line in self.linuxcnc(ini, status=1)[1].splitlines()
            ],
        )
        self.assertFalse(self.log.exists(), "nothing was started")

    def test_bad_ini_files(self):
        version = "hal linuxcnc: CONFIG/machine.ini: [EMC]VERSION is {}, not 1.1: the file is from an older LinuxCNC; type: update_ini CONFIG/machine.ini\n"
        self.assertEqual(
            version.format("missing"),
            self.linuxcnc(self.ini(text=INI.replace("VERSION", "#")), status=1)[1],
        )
        self.assertEqual(
            version.format("1.0"),
            self.linuxcnc(self.ini(text=INI.replace("1.1", "1.0")), status=1)[1],
        )
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [DISPLAY]DISPLAY is missing: the machine runs as long as its display does; write DISPLAY = axis, "
            "linuxcncrsh, ./my-ui.py or dummy\n",
            self.linuxcnc(self.ini(text=INI.replace("DISPLAY =", "#")), status=1)[1],
        )
        self.assertEqual(
            "hal linuxcnc: CONFIG/machine.ini: [APPLICATIONS]DELAY is soon, not a time of 0..3600 seconds\n",
            self.linuxcnc(self.ini("[APPLICATIONS]\nDELAY = soon\n"), status=1)[1],
        )
        self.assertEqual(
            "error: cannot read 'none.ini': No such file or directory [unreadable-file]\n",
            self.linuxcnc("none.ini", status=1)[1],
        )
        self.assertEqual(
            "hal linuxcnc: 'machine.hal' is not an INI file; type: hal linuxcnc FILE.ini\n",
            self.linuxcnc("machine.hal", status=1)[1],
        )
        self.assertFalse(self.log.exists())

    def test_one_machine_per_computer(self):
        self.display("touch shown; exec sleep 1000")
        machine = self.runs(self.ini())
        self.assertEqual(
            f"hal linuxcnc: another LinuxCNC machine is running (process {machine.pid}), and NML allows one per computer; end it first\n",
            self.linuxcnc("--name", "other", self.ini(), status=1)[1],
        )
        self.end(machine)
        machine = self.start("run", self.write("alone.hal", SERVO + "start\n"))
        self.assertIn("'default' is already running", self.linuxcnc(self.ini(), status=1)[1])
        self.end(machine)

    def test_a_launcher_that_was_killed_leaves_nothing_to_the_next(self):
        self.environment["STANDIN_LINGERS"] = "linuxcncsvr milltask"
        self.display("touch shown; exec sleep 1000")
        machine = self.runs(self.ini())
        self.environment["STANDIN_LINGERS"] = ""
        machine.kill()
        machine.wait(TIMEOUT)  # the server still has its standard output
        self.display("exit 0")
        self.assertEqual(("", ""), self.linuxcnc(self.ini()))
        log = self.logged()
        starts = [i for i, line in enumerate(log) if line == "linuxcncsvr -ini CONFIG/machine.ini"]
        self.assertIn(
            "linuxcncsvr ends", log[starts[0] : starts[1]]
        )  # it has ended before its successor starts
        self.assertIn("milltask ends", log[starts[0] : starts[1]])

    def test_a_program_of_a_killed_launcher_that_ignores_sigterm_is_killed(self):
        self.display("trap '' TERM; note $$; touch shown; while :; do sleep 1; done")
        machine = self.runs(self.ini())
        machine.kill()
        machine.wait(TIMEOUT)
        display = next(int(line.split()[1]) for line in self.logged() if line.startswith("note "))
        self.display("exit 0")
        self.assertEqual(("", ""), self.linuxcnc(self.ini()))
        stat = Path(f"/proc/{display}/stat")
        self.assertTrue(
            not stat.exists() or stat.read_text().rsplit(")", 1)[1].split()[0] == "Z"
        )  # where nobody reaps orphans, it stays a zombie


if __name__ == "__main__":
    unittest.main()
