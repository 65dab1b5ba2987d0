# SPDX-License-Identifier: MIT
"""The commands of hal can that the core has, also in a build without CANopen."""
import random
import unittest

from harness import Case

LOG = "(1.000000) can0 181#0102\n(1.010000) can0 181#0103\n"


class Frames(Case):
    def setUp(self):
        super().setUp()
        place = random.SystemRandom()
        group = f"239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}"
        self.bus = f"udp:{group}%lo:{place.randrange(20000, 60000)}"

    def can(self, *words):
        """Standard output and the last line of standard error of a command that succeeds."""
        done = self.run_program("can", *words)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout, done.stderr.splitlines()[-1]

    def test_frames_are_generated(self):
        _, last = self.can("generate", self.bus, "--count", "3", "--every", "1ms")
        self.assertRegex(last, r"\A3 frames in \d+\.\d\d s\Z")

    def test_changed_bytes_are_marked(self):
        self.write("seen.log", LOG)
        shown, _ = self.can("sniff", "replay:seen.log")
        self.assertEqual(
            "      id    frames      period  data, changed bytes marked\n"
            "     181         2     10.0 ms  01 03*\n",
            shown,
        )

    def test_a_recording_is_replayed(self):
        self.write("seen.log", LOG)
        _, last = self.can("replay", "seen.log", self.bus)
        self.assertIn("2 frames", last)


if __name__ == "__main__":
    unittest.main()
