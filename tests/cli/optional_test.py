#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: vision
"""The script ./hal and a build whose optional packages are removed and installed again, by a package manager of the test. In a mount namespace
and an overlay of the build tree; needs root and a build in build/release of the sources."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import HAL, TIMEOUT, ROOT, SANITIZED

BUILD = ROOT / "build"
HEADERS = "/usr/include/opencv4"
SCRIPT = f"""
mount -t overlay -o "lowerdir={BUILD},upperdir=$1/upper,workdir=$1/work" overlay {BUILD} || exit 77
cd "$1"
try() {{ {ROOT}/hal check see.hal; echo "status $?"; }}
mount -t tmpfs none {HEADERS}; echo "== without a network" >&2; touch offline; try
{BUILD}/release/bin/hal check see.hal; echo "status $?"
rm offline; echo "== with a network" >&2; try
echo "== as it was" >&2; try
"""
APT = f"""#!/bin/sh
[ -e "$FOLDER/offline" ] && exit 100
case "$*" in *--assume-no*) exit 1 ;; esac
case "$*" in *libopencv-contrib-dev*) umount {HEADERS} ;; esac
"""


class Optional(unittest.TestCase):
    maxDiff = None

    def test_the_same_command_works_after_installing_the_package_it_named(self):
        folder = Path(tempfile.mkdtemp(prefix="hal-"))
        self.addCleanup(shutil.rmtree, folder, True)
        for name in ("upper", "work", "home"):
            (folder / name).mkdir()
        (folder / "see.hal").write_text("loadrt vision_line\n")
        (folder / "apt-get").write_text(APT)
        (folder / "apt-get").chmod(0o755)
        environment = {
            "PATH": f"{folder}:{os.environ['PATH']}",
            "FOLDER": str(folder),
            "HOME": os.environ.get("HOME", str(folder)),
            "XDG_RUNTIME_DIR": str(folder),
            "LC_ALL": "C.UTF-8",
        }
        done = subprocess.run(
            ["unshare", "-m", "sh", "-c", SCRIPT, "sh", str(folder)],
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=8 * TIMEOUT,
        )
        if done.returncode == 77:
            self.skipTest("no overlay file systems here")
        _, offline, online, same = (
            part.split("\n", 1)[-1] for part in ("\n" + done.stderr).split("==")
        )
        self.assertEqual("status 1\nstatus 0\nstatus 0\nstatus 0\n", done.stdout, done.stderr)
        self.assertTrue(
            offline.startswith(
                "hal: installing Debian packages: libopencv-contrib-dev\n"
                "hal: cannot install these Debian packages: libopencv-contrib-dev (see "
            ),
            offline,
        )
        self.assertIn("hal: installing Debian packages: libopencv-contrib-dev\n", online)
        self.assertIn("see.hal: no errors\n", online)
        self.assertEqual("see.hal: no errors\n", same)  # built: nothing is configured or built


if __name__ == "__main__":
    if (
        os.geteuid() != 0
        or SANITIZED
        or HAL != BUILD / "release/bin/hal"
        or not list((BUILD / "release/components").glob("vision_line.so"))
    ):
        print("needs root, a build with OpenCV in build/release, and a program without sanitizers")
        sys.exit(77)
    unittest.main()
