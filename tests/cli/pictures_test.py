#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen estimation ethercat scocan tdma
"""Pictures and tables that are computed from a simulation: made again, they are the same to the byte."""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, ROOT, SANITIZED, Case


class Pictures(Case):
    def make(self, *command):
        environment = dict(
            os.environ,
            HAL_BIN=str(HAL),
            XDG_RUNTIME_DIR=str(self.folder),
            PYTHONDONTWRITEBYTECODE="1",
        )
        done = subprocess.run(
            [sys.executable, *map(str, command)],
            cwd=self.folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
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
        said = self.make(ROOT / "halfiles/canopen-robot/picture", made)
        self.assertRegex(
            said, r"^largest error of the filter: [1-4]?\d mm; of odometry alone: [2-9]\d\d mm\n$"
        )
        self.same(ROOT / "halfiles/canopen-robot/match.svg", made)

    def test_swing_up_of_the_pendulum(self):
        made = Path(self.folder, "swing-up.svg")
        self.assertRegex(
            self.make(ROOT / "halfiles/furuta/picture", made), r"^upright after 2\.\d\d s\n$"
        )
        self.same(ROOT / "docs/swing-up.svg", made)

    def test_swing_up_is_not_computed_for_a_folder_that_is_missing(self):
        done = subprocess.run(
            [sys.executable, ROOT / "halfiles/furuta/picture", "absent/swing-up.svg"],
            cwd=self.folder,
            env=dict(os.environ, HAL_BIN="/bin/false"),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.assertEqual(1, done.returncode)
        self.assertRegex(
            done.stderr,
            "^absent/swing-up.svg: the folder is missing or not writable; name another file: ",
        )

    def test_path_of_yair(self):
        made = Path(self.folder, "path.svg")
        self.assertEqual("round finished: yes\n", self.make(ROOT / "halfiles/yair/picture", made))
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
        said = self.make(ROOT / "halfiles/jitter/experiment", self.folder)
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
