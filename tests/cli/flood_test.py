#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Files with thousands of the same mistake: each name is reported once, at most 100 errors of a file, and memory stays small."""
import resource
import subprocess
import unittest

from harness import HAL, SANITIZED, TIMEOUT, Case, lacks_a_package

LIMIT = 2 << 30  # bytes of address space: the program, its threads' stacks, a plugin
MASTER = "master:\nname m\ncycle 1000\nslot 0 100\n"
FLOODS = {
    "many.matrices": ("loadrt state_space file=many.matrices\n", "A = 1\n" * 10_000, 1),
    "names.matrices": (
        "loadrt state_space file=names.matrices\n",
        "".join(f"A{n} = 1\na{n} = 1\n" for n in range(3000)),
        100,
    ),
    "many.model": ("loadrt ekf model=many.model\n", "state x = 0 sigma 1 noise 1\n" * 2000, 100),
    "slots.tdma": (
        "loadrt tdma link=sim:a config=slots.tdma station=m\n",
        MASTER + "slot 1 200\n" * 6000,
        100,
    ),
    "names.tdma": (
        "loadrt tdma link=sim:a config=names.tdma station=m\n",
        MASTER + "slave:\nname x\nmac 02:00:00:00:00:07\n" * 1500,
        100,
    ),
    "meet.tdma": (
        "loadrt tdma link=sim:a config=meet.tdma station=m\n",
        MASTER + "slave:\nslot 1 300\n" * 3500,
        100,
    ),
    "many.canopen": (
        "loadrt canopen link=sim:a config=many.canopen\n",
        "[node a]\nid = 5\n" * 3000,
        100,
    ),
    "many.camera": ("loadrt vision_marker camera=many.camera\n", "size 640 480\n" * 4500, None),
}


class Flood(Case):
    def test_a_mistake_made_thousands_of_times_is_reported_shortly(self):
        for name, (netlist, text, errors) in FLOODS.items():
            with self.subTest(name):
                self.write(name, text)
                self.write("flood.hal", netlist)
                limit = (
                    None
                    if SANITIZED
                    else lambda: resource.setrlimit(resource.RLIMIT_AS, (LIMIT, LIMIT))
                )
                done = subprocess.run(
                    [HAL, "check", "flood.hal"],
                    cwd=self.folder,
                    env=self.environment,
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    text=True,
                    timeout=2 * TIMEOUT,
                    preexec_fn=limit,
                )
                if lacks_a_package(done.stderr):
                    self.skipTest("a package of this component is left out of this build")
                self.assertEqual(1, done.returncode, done.stderr[-500:])
                self.assertLessEqual(len(done.stderr.splitlines()), 700, done.stderr[:500])
                if errors is not None:
                    end = done.stderr.rstrip().splitlines()[-1]
                    self.assertRegex(end, rf"^{errors} errors?$")
                if errors == 100:
                    self.assertIn(
                        f"there are more errors in '{name}' than the 99 shown; fix these first",
                        done.stderr,
                    )

    def test_the_same_in_a_netlist(self):
        self.write("flood.hal", "net a b.c\n" * 5000)
        self.assertIn("more not shown; fix these first", self.bad("check", "flood.hal"))


if __name__ == "__main__":
    unittest.main()
