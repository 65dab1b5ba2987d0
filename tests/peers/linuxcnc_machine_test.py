#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc ethercat
"""linuxcnc_machine_test.py HAL: `hal linuxcnc` with LinuxCNC's own programs, as the Debian package linuxcnc-uspace installs them, unmodified.
77: the package is not installed."""

import csv
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(HERE.parent / "cli"))
from harness import HAL, SANITIZED, Case, wait_until  # noqa: E402

MACHINE = HERE.parents[1] / "halfiles/linuxcnc-ethernet"


class Machine(Case):
    def setUp(self):
        super().setUp()
        self.environment["PATH"] = f"{HAL.parent}:{self.environment['PATH']}"
        self.environment["PATH_FOLDER"] = str(self.folder)
        self.environment["HAL_RTMOD_DIR"] = "/usr/lib/linuxcnc/modules"

    def launch(self, *words, ini="cnc.ini"):
        return subprocess.Popen(
            [HAL, "linuxcnc", MACHINE / ini, *words],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def test_g_code_moves_five_axes_over_ethernet(self):
        printed = self.moves(self.launch)
        page = (MACHINE.parents[1] / "docs/tutorials/cnc-machine.md").read_text()
        shown = (
            re.search(r"It prints:\n\n```text\n(.*?)```", page, re.S)[1]
            .replace("program.ngc", "short.ngc")
            .replace("/home/you/halcyon/driven", str(self.folder))
        )

        def lines(text):
            return {re.sub(r"(?<!tool )\b\d+(\.\d+)?", "N", line) for line in text.splitlines()}

        missing = lines(shown) - lines(printed)
        if importlib.util.find_spec("matplotlib"):
            self.assertEqual(set(), missing, printed)
            self.assertTrue((self.folder / "path.png").exists())
            return
        self.assertEqual(lines(f"the path is drawn in {self.folder}/path.png"), missing, printed)
        self.assertIn(
            "no picture: it needs matplotlib (sudo apt-get install python3-matplotlib)\n", printed
        )
        print("the picture of the path is left out: it needs python3-matplotlib")

    def test_g_code_moves_five_axes_over_ethercat(self):
        self.moves(lambda *words: self.launch(*words, ini="ethercat.ini"))

    def moves(self, launch):
        short = self.folder / "short.ngc"
        short.write_text(
            "G21 G90\nT1 M6\nG0 X10 Y-5 A20\nT2 M6\nG1 F3000 X0 C30\nG2 X10 Y5 I5 J5\nG0 X0 Y0 Z-4\nM2\n"
        )
        machine = launch("--", str(short))
        self.addCleanup(machine.kill)
        out, error = machine.communicate(timeout=120)
        self.assertEqual(0, machine.returncode, out + error)
        self.assertIn("homed; running short.ngc\n", out)
        self.assertIn("tool panel: insert tool 1\n", out)
        self.assertRegex(
            out, r"short.ngc took \d+\.\d s; of \d{4,} cycles of the servo thread \d+ were missed\n"
        )
        with open(self.folder / "path.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        at = {
            end: [
                [float(row[f"joint.{joint}.motor-pos-{end}"] or "nan") for row in rows]
                for joint in range(5)
            ]
            for end in ("cmd", "fb")
        }
        for joint, reached in enumerate((10, 7, -4, 20, 30)):
            extreme = min if reached < 0 else max
            self.assertAlmostEqual(reached, extreme(at["cmd"][joint]), delta=0.5)
        for joint in range(5):  # what was driven is what was commanded, two cycles before
            errors = [abs(a - b) for a, b in zip(at["cmd"][joint], at["fb"][joint][2:])]
            self.assertLess(max(errors), 2.0)  # FERROR
            self.assertGreater(max(at["fb"][joint]) - min(at["fb"][joint]), 3.5)
        self.assertEqual(
            "",
            subprocess.run(
                ["pgrep", "-x", "milltask|io|halui|linuxcncsvr"], capture_output=True, text=True
            ).stdout,
        )
        return out + error

    def test_a_journal_ends_at_the_shared_memory(self):
        machine = subprocess.Popen(
            [HAL, "linuxcnc", "--journal", "run.mcap", "--values", "*", MACHINE / "cnc.ini"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.addCleanup(machine.kill)
        wait_until(lambda: self.value("x.active") == "TRUE", "the machine is on")
        machine.send_signal(signal.SIGTERM)
        out = machine.communicate(timeout=60)[0]
        done = self.run_program("replay", "--exact", "run.mcap")
        # task has switched the machine on: until then it commands nothing that changes a value
        self.assertEqual(1, done.returncode, out + done.stdout + done.stderr)
        self.assertRegex(
            done.stdout, r"\nfirst difference: '\S+' \('\S+' of \w+, function '\S+'\) in cycle \d+"
        )
        self.assertIn("'motmod' of motmod, function 'motion-", done.stdout)
        # before it is the whole machine: its bus, the pins of its programs, and motion
        newest = int(re.search(r"in cycle (\d+) of thread 'servo-thread'", done.stdout)[1])
        part = self.run_program("replay", "--exact", "run.mcap", "--until", str(newest - 1))
        self.assertEqual(0, part.returncode, part.stdout + part.stderr)
        self.assertRegex(part.stdout, r"no difference so far, \d{4,} values compared")

    def test_the_e_stop_ends_the_motion(self):
        long = self.folder / "long.ngc"
        long.write_text("G21 G90\nG1 F600 X90\nM2\n")
        machine = self.launch("--", str(long))
        self.addCleanup(machine.kill)
        wait_until(
            lambda: self.value("x.active") == "TRUE"
            and float(self.value("x.position-fb") or 0) > 3,
            "the axis moves",
        )
        self.shell("setp", "io-node.in-00", "FALSE")
        out, error = machine.communicate(timeout=60)
        self.assertEqual(1, machine.returncode, out + error)
        self.assertIn("run_program: the machine went off", error)
        self.assertIn("the display './run_program.py' ended with exit status 1", error)

    def test_a_killed_task_stops_the_machine(self):
        machine = self.launch("--", str(MACHINE / "program.ngc"))
        self.addCleanup(machine.kill)
        wait_until(lambda: self.value("x.active") == "TRUE", "the machine is on")
        pid = next(
            line.split()[3]
            for line in self.shell("show", "comp").stdout.splitlines()
            if re.search(r" inihal +\d", line)
        )
        os.kill(int(pid), signal.SIGKILL)
        out, error = machine.communicate(timeout=60)
        self.assertEqual(1, machine.returncode, out + error)
        self.assertRegex(
            error,
            r"hal linuxcnc: 'milltask' \(component inihal\) died at [\d:]+ \(SIGKILL\); the outputs have their safe values, the machine ends\n",
        )


if __name__ == "__main__":
    if not shutil.which("milltask") or SANITIZED:
        print("LinuxCNC is not installed: sudo apt-get install linuxcnc-uspace")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
