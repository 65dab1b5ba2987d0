#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen estimation ethercat scocan tdma
"""Pictures and tables that are computed from a simulation: made again, they are the same to the byte. The scripts run from a read-only copy
of the machines, in another folder, as they do in an installation."""

import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, ROOT, SANITIZED, Case, machines_elsewhere

SCRIPTS = {  # what each of them writes
    "canopen-robot/picture": ("match.svg",),
    "furuta/picture": ("swing-up.svg",),
    "jitter/experiment": ("jitter.csv", "jitter-overshoot.svg", "jitter-responses.svg"),
    "linuxcnc-ethernet/picture": ("path.png",),
    "yair/picture": ("path.svg",),
}
# Started by `hal linuxcnc`, in LinuxCNC's Python, or by another script.
NOT_ALONE = {f"linuxcnc-ethernet/{name}.py" for name in ("draw_path", "run_program", "tool_panel")}


class Pictures(Case):
    def setUp(self):
        super().setUp()
        self.machines, self.read_only = machines_elsewhere(self.folder)

    def run_script(self, script, *words, hal=HAL, cwd=None):
        """Runs a script of the read-only copy."""
        return subprocess.run(
            [*self.read_only, sys.executable, self.machines / script, *words],
            cwd=cwd or self.folder,
            env=dict(os.environ, HAL_BIN=str(hal), XDG_RUNTIME_DIR=str(self.folder)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def make(self, script, *words):
        done = self.run_script(script, *words)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout

    def same(self, kept, made):
        self.assertEqual(
            kept.read_text(encoding="utf-8"),
            made.read_text(encoding="utf-8"),
            f"{kept.relative_to(ROOT)} is not what the simulation gives; run the script beside it again and look at the result",
        )

    def test_path_of_the_robot_in_a_match(self):
        made = Path(self.folder, "match.svg")
        said = self.make("canopen-robot/picture", "--output", made)
        self.assertRegex(
            said, r"^largest error of the filter: [1-4]?\d mm; of odometry alone: [2-9]\d\d mm\n$"
        )
        self.same(ROOT / "halfiles/canopen-robot/match.svg", made)

    def test_swing_up_of_the_pendulum(self):
        made = Path(self.folder, "swing-up.svg")
        self.assertRegex(self.make("furuta/picture"), r"^upright after 2\.\d\d s\n$")
        self.same(ROOT / "docs/swing-up.svg", made)

    def test_all_scripts_are_listed(self):
        found = {
            str(path.relative_to(self.machines))
            for path in self.machines.rglob("*")
            if path.is_file() and b"python" in path.read_bytes().split(b"\n")[0]
        }
        self.assertEqual(set(SCRIPTS) | NOT_ALONE, found)

    def refuses(self, script, *words, cwd=None, hal="/bin/false"):
        """Runs a script that must end before it computes: its `hal` is one with which it fails."""
        done = self.run_script(script, *words, cwd=cwd, hal=hal)
        self.assertEqual((1, ""), (done.returncode, done.stdout), done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        self.assertNotIn("hal sim ended", done.stderr)
        return done.stderr

    def test_what_cannot_be_written_is_reported_before_the_computation(self):
        (self.folder / "file").touch()
        for script, files in SCRIPTS.items():
            with self.subTest(script):
                folder = len(files) > 1
                missing = Path("absent") if folder else Path("absent", files[0])
                self.assertEqual(
                    f"{Path('absent', files[0])}: the folder absent is missing; create it: mkdir -p absent\n",
                    self.refuses(script, "--output", missing),
                )
                place = Path("file") if folder else Path("file", files[0])
                self.assertIn("the folder file is missing", self.refuses(script, place))
                if not folder:
                    self.assertIn(
                        ": this is a folder; name a file: ", self.refuses(script, "--output", ".")
                    )
                if self.read_only:
                    self.assertEqual(
                        f"{files[0]}: not writable; choose another place with --output, such as /tmp\n",
                        self.refuses(script, cwd=self.machines / script.split("/")[0]),
                    )

    def test_a_missing_program_or_a_part_of_the_tree_is_reported(self):
        alone = self.folder / "alone"
        alone.mkdir()
        for script in SCRIPTS:
            with self.subTest(script):
                self.assertEqual(
                    "'/no/hal' is missing or not executable; set HAL_BIN=/path/to/hal\n",
                    self.refuses(script, hal="/no/hal"),
                )
                copy = shutil.copytree(
                    self.machines / script.split("/")[0], alone / script.split("/")[0]
                )
                done = subprocess.run(
                    [copy / script.split("/")[1]], capture_output=True, text=True, cwd=self.folder
                )
                self.assertEqual(
                    (1, f"{alone}/drawing.py is missing; copy the whole folder halfiles\n"),
                    (done.returncode, done.stderr),
                )

    def test_a_run_with_missed_cycles_is_not_drawn(self):
        """With a `hal` that misses 2, 1 and 0 cycles, and with one that misses some in each run."""
        hal = self.folder / "hal"
        hal.write_text(f"""#!/bin/sh
cd {self.folder}
echo >> runs
missed=$((3 - $(wc -l < runs)))
echo "program.ngc took 1 s; of 1000 cycles of the servo thread $missed were missed"
echo "$missed" > "$PATH_FOLDER/path.png"
""")
        hal.chmod(0o755)
        made = self.folder / "path.png"
        done = self.run_script("linuxcnc-ethernet/picture", made, hal=hal)
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertEqual("0\n", made.read_text())
        self.assertEqual(
            "again: missed cycles of the servo thread: 2\n"
            "again: missed cycles of the servo thread: 1\n"
            "no cycle of the servo thread was missed\n",
            done.stdout,
        )
        made.unlink()
        hal.write_text(hal.read_text().replace("((3", "((100"))
        done = self.run_script("linuxcnc-ethernet/picture", made, hal=hal)
        self.assertEqual(
            f"{made} is not written: each of 20 runs missed cycles; repeat it while nothing else runs\n",
            done.stderr,
        )
        self.assertEqual(1, done.returncode)
        self.assertFalse(made.exists())

    def test_path_of_yair(self):
        made = Path(self.folder, "path.svg")
        self.assertEqual("round finished: yes\n", self.make("yair/picture", made))
        self.same(ROOT / "halfiles/yair/path.svg", made)

    def test_slots_of_yair(self):
        made = Path(self.folder, "slots.svg")
        done = subprocess.run(
            [HAL, "scocan", "plan", "yair.scocan", "--svg", made],
            cwd=ROOT / "halfiles/yair",
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.assertEqual(0, done.returncode, done.stderr)
        self.same(ROOT / "halfiles/yair/slots.svg", made)

    @unittest.skipIf(
        SANITIZED, "36 simulations take minutes, and all they do is done in other tests"
    )
    def test_jitter_experiment(self):
        said = self.make("jitter/experiment")
        self.assertIn(
            said,
            (ROOT / "docs/tutorials/network-and-control.md").read_text(encoding="utf-8"),
            "the tutorial shows other figures",
        )
        self.assertIn("at every load: passed", said)
        self.assertRegex(said, r"TDMA and EtherCAT: .* no jitter: passed")
        self.assertIn("No measured delay exceeds the computed bound: passed", said)
        for name in ("jitter.csv", "jitter-overshoot.svg", "jitter-responses.svg"):
            self.same(ROOT / "docs" / name, Path(self.folder, name))

    def test_wrong_and_right_gain_of_the_tutorial(self):
        page = (ROOT / "docs/tutorials/look-inside.md").read_text(encoding="utf-8")
        self.write("loop.hal", re.search(r"```hal file=loop\.hal\n(.*?)^```", page, re.S | re.M)[1])
        for command in re.findall(r"^\$ ((?:hal sim|hal plot|sed) .*)$", page, re.M):
            self.assertEqual(
                0,
                subprocess.run(
                    ["bash", "-c", command],
                    cwd=self.folder,
                    env={**self.environment, "PATH": f"{HAL.parent}:{os.environ['PATH']}"},
                ).returncode,
                command,
            )
        for name in ("look-inside-wrong.svg", "look-inside-right.svg"):
            self.same(ROOT / "docs" / name, self.folder / name)


if __name__ == "__main__":
    unittest.main()
