# SPDX-License-Identifier: MIT
# packages: canopen
"""Recordings in the formats of other tools: python-can's can_logconvert makes ASC, BLF and TRC of our .log files and back."""
import json
import shutil
import subprocess
import unittest

from can_test import Can
from harness import TIMEOUT

CONVERT = shutil.which("can_logconvert", path="/usr/bin") or shutil.which("can_logconvert")
FRAMES = [
    "702#00",
    "602#4000100000000000",
    "582#4300100092010200",
    "123#",
    "18FF0001#AA",
    "00000123#1122334455667788",
    "7FF#0102030405060708",
]
REMOTE = ["701#R"]
FD = ["123##1AABB", "18FF0002##0" + "0A" * 12]


@unittest.skipUnless(CONVERT, "can_logconvert is missing; type: apt-get install python3-can")
class Logs(Can):
    def record(self, *frames):
        record = self.listener("record", self.bus, "seen.log", "-n", len(frames))
        self.good("can", "send", self.bus, *frames)
        self.result(record)

    def convert(self, source, target):
        """What can_logconvert prints, and so leaves out; skips the test where this python-can does not have the format."""
        done = subprocess.run(
            [CONVERT, source, target],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=2 * TIMEOUT,
        )
        if (
            "no write support" in done.stdout
            or "No write support" in done.stdout
            or "Unknown file type" in done.stdout
        ):
            self.skipTest(
                f"this python-can does not write {target}: {done.stdout.strip().splitlines()[-1]}"
            )
        self.assertEqual(0, done.returncode, done.stdout)
        return done.stdout

    def frames(self, file):
        """Without the time of the first, which ASC and TRC do not keep."""
        lines = self.run_program("can", "dump", "replay:" + file, "--json").stdout.splitlines()
        frames = [json.loads(line) for line in lines[:-1]]
        return [
            {key: value for key, value in frame.items() if key != "direction"} for frame in frames
        ]

    def round_trip(self, ending, *frames):
        self.record(*frames)
        self.convert("seen.log", "there." + ending)
        self.convert("there." + ending, "back.log")
        before, after = self.frames("seen.log"), self.frames("back.log")
        self.assertEqual(len(frames), len(before))
        for frame in before + after:  # formats round differently
            frame["time"] = round(frame["time"], 3)
        close = [abs(a.pop("time") - b.pop("time")) < 0.0025 for a, b in zip(before, after)]
        self.assertEqual(before, after)
        self.assertTrue(all(close))

    def test_asc_keeps_all_frames(self):
        self.round_trip("asc", *FRAMES, *REMOTE, *FD)

    def test_blf_keeps_all_frames_and_the_time_of_day(self):
        self.round_trip("blf", *FRAMES, *REMOTE, *FD)
        first = [
            float(line[1 : line.index(")")])
            for file in ("seen.log", "back.log")
            for line in (self.folder / file).read_text().splitlines()[:1]
        ]
        self.assertAlmostEqual(first[0], first[1], delta=0.002)

    def test_trc_keeps_classic_data_frames(self):
        self.round_trip("trc", *FRAMES)

    def test_trc_without_remote_and_fd_frames_is_said(self):
        self.record(*FRAMES[:2], *REMOTE, *FD)
        said = self.convert("seen.log", "there.trc")
        self.convert("there.trc", "back.log")
        if len(self.frames("back.log")) == 5:
            self.skipTest("this python-can writes remote and FD frames to TRC")
        self.assertEqual(2, len(self.frames("back.log")))
        self.assertIn("not implemented", said)


if __name__ == "__main__":
    unittest.main()
