# SPDX-License-Identifier: MIT
"""A simulated drive (hal node drive) on a bus over udp: on this machine, and hal can drive from another process."""
import os
import random
import subprocess

from harness import HAL, Case, wait_until


class Drive(Case):
    def setUp(self):
        super().setUp()
        place = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        self.bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"

    def node(self, *words):
        """Starts a drive and waits until it is on the bus."""
        process = subprocess.Popen(
            ["hal", "node", "drive", "--link", self.bus, "--id", "2", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.addCleanup(self.end, process)
        for line in process.stdout:
            if ", profile position" in line and "not ready" not in line:
                return process
        raise AssertionError("the drive does not start")

    def drive(self, *words, **how):
        return self.good("can", "drive", self.bus, "--node", 2, *words, **how)

    def begin(self, *words, **how):
        """Starts hal can drive in the background."""
        process = subprocess.Popen(
            ["hal", "can", "drive", self.bus, "--node", "2", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=how.get("stdin", subprocess.DEVNULL),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, process)
        return process

    def left_moving(self, *words):
        """A command that succeeds and leaves the axis moving prints a warning."""
        done = self.run_program("can", "drive", self.bus, "--node", 2, *words)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(
            f"hal can drive: A: still moving, no longer supervised; to stop it: hal can drive {self.bus} --node 2 A stop\n",
            done.stderr,
        )
        return done.stdout

    def position(self):
        return float(self.drive("A", "position?").split()[-1])

    def moving(self):
        start = self.position()
        wait_until(lambda: abs(self.position() - start) > 20, "the axis moves")

    def object(self, name):
        return self.good("can", "sdo", "read", self.bus, 2, name).split(" = ")[1].split()[0]

    def refused(self, *words, **how):
        text = self.bad("can", "drive", self.bus, "--node", 2, *words, **how)
        self.assertTrue(text.startswith("hal can drive: "), text)
        return text[len("hal can drive: ") :]
