#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The packages of the tree, from outside: which a build has, and what a tree has that is configured without all of them, or without one."""
import itertools
import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import HAL, ROOT, SANITIZED, Case

ROWS = [
    line.split(" ", 3)
    for line in (ROOT / "cmake/packages").read_text().splitlines()
    if not line.startswith("#")
]
NAMES = [row[0] for row in ROWS]
# What builds with the packages leave in a tree; the suffixes depend on the machine and the version.
PRODUCTS = (
    "bin/hal-panel",
    "components/kalman.so",
    "lib/halcyon/linuxcnc/liblinuxcnchal.so.0",
    "lib/libhalcyon_dds.so.1.2",
    "lib/libhalcyon_modules.so.1.2",
    "lib/libhalcyon_vision.so.1.2",
    "python/hal/_core.so",
)


def configure(folder, *switches):
    done = subprocess.run(
        ["cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", *switches],
        capture_output=True,
        text=True,
        timeout=600,
    )
    return done.returncode, done.stdout + done.stderr


class Version(Case):
    def test_lists_the_packages_of_the_table(self):
        packages = json.loads(self.good("--version", "--json"))["packages"]
        self.assertEqual(NAMES, [one["name"] for one in packages])
        self.assertEqual([row[3] for row in ROWS], [one["summary"] for one in packages])
        self.assertEqual(
            [f"HALCYON_PACKAGE_{name.upper()}" for name in NAMES],
            [one["switch"] for one in packages],
        )
        text = self.good("--version")
        built = [one["name"] for one in packages if one["built"]]
        self.assertIn(f"packages: {', '.join(built) or 'none, the core alone'}\n", text)
        self.assertEqual(len(built) < len(packages), "left out: " in text)

    def test_rejects_other_words(self):
        self.assertEqual(
            "hal: unexpected argument 'x'; type: hal --version --json, or hal --version\n",
            self.bad("--version", "x"),
        )


class SwitchedOff(unittest.TestCase):
    """A tree in which every package is OFF."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="hal-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        cls.tree = cls.folder / "tree"
        for product in PRODUCTS:
            (cls.tree / product).parent.mkdir(parents=True, exist_ok=True)
            (cls.tree / product).touch()
        switches = [f"-DHALCYON_PACKAGE_{name.upper()}=OFF" for name in NAMES]
        status, output = configure(cls.tree, *switches, "-DHALCYON_TESTS=ON")
        if status != 0:
            raise AssertionError(output)

    def targets(self):
        listed = subprocess.run(
            ["ninja", "-C", self.tree, "-t", "targets", "all"], capture_output=True, text=True
        )
        return set(re.findall(r"(?m)^(\S+): phony$", listed.stdout))

    def test_the_core_alone_has_no_target_and_no_test_of_a_package(self):
        targets = self.targets()
        core = {"hal", "hal-tools", "hal-bus", "component_pid", "component_can_send", "unit_tests"}
        self.assertLessEqual(core, targets)
        absent = dict(
            line.split() for line in (self.tree / "components/absent").read_text().splitlines()
        )
        components = (
            "canopen",
            "ethercat",
            "tdma",
            "scocan",
            "dds_publish",
            "kalman",
            "vision_blob",
        )
        for component in components:
            self.assertRegex(absent[component], "^HALCYON_PACKAGE_[A-Z]+$")
            self.assertNotIn(f"component_{component}", targets)
        of_packages = {"hal-panel", "halcyon_modules", "linuxcnchal", "python_hal", "canopen_tests"}
        self.assertEqual(set(), of_packages & targets)
        tests = subprocess.run(
            ["ctest", "--test-dir", self.tree, "--print-labels"], capture_output=True, text=True
        ).stdout
        labels = set(re.findall(r"(?m)^  (\S+)$", tests))
        self.assertIn("core", labels)
        self.assertEqual(set(), labels & set(NAMES))

    def test_products_of_an_earlier_build_with_the_packages_are_removed(self):
        self.assertEqual([], [one for one in PRODUCTS if (self.tree / one).exists()])

    def test_the_list_of_the_program_names_each_switch(self):
        source = (self.tree / "generated/tree_packages.cpp").read_text()
        self.assertEqual(len(NAMES), source.count("PackageState::switched_off"))
        self.assertNotIn("PackageState::built", source)

    def test_the_build_installs_no_debian_package_of_them(self):
        needs = dict(
            line.split(" ", 1)
            for line in (self.tree / "components/packages").read_text().splitlines()
        )
        self.assertEqual({"all", "playback"}, set(needs))
        self.assertEqual("libzstd-dev liblz4-dev", needs["all"])


class WithoutGoogleTest(Case):
    """On a machine that has what `./hal build` installs."""

    def test_the_tests_are_left_out_unless_they_are_requested(self):
        tree, absent = self.folder / "tree", "-DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON"
        status, output = configure(tree, absent)
        self.assertEqual(0, status, output)
        self.assertIn(
            "libgtest-dev not found: the tests are left out; install it, then add -DHALCYON_TESTS=ON\n",
            output,
        )
        status, output = configure(tree, absent, "-DHALCYON_TESTS=ON")
        self.assertEqual(1, status)
        self.assertIn("GTest", output)


class OneSwitch(Case):
    def test_each_switch_alone_leaves_the_others_in(self):
        for name, value in zip(NAMES, itertools.cycle(("OFF", "0", "off", "NO"))):
            with self.subTest(name):
                tree, switch = self.folder / name, f"HALCYON_PACKAGE_{name.upper()}"
                status, output = configure(tree, f"-D{switch}={value}", "-DHALCYON_TESTS=OFF")
                self.assertEqual(0, status, output)
                listed = (tree / "components/packages_left_out").read_text()
                self.assertIn(f"{name} {switch}\n", listed)
                self.assertEqual(1, listed.count("HALCYON_PACKAGE_"))
                rows = re.findall(
                    r'\{"([a-z]+)", .*PackageState::([a-z_]+)',
                    (tree / "generated/tree_packages.cpp").read_text(),
                )
                self.assertEqual([name], [one for one, state in rows if state == "switched_off"])
                shutil.rmtree(tree)


if __name__ == "__main__":
    if not shutil.which("cmake") or not shutil.which("ninja") or SANITIZED:
        print("needs cmake and ninja, and a program without sanitizers")
        sys.exit(77)
    unittest.main()
