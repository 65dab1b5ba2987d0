#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal new component: what it makes compiles and passes its test at once, from the build tree and from an installation."""
import os
import shutil
import subprocess
import unittest

from harness import HAL, TIMEOUT, Case

BUILD = HAL.parent.parent  # the build tree, or an installation
PACKAGE = BUILD / "lib" / "cmake" / "Halcyon"


class NewComponent(Case):
    def setUp(self):
        super().setUp()
        del self.environment["HALCYON_PLUGIN_PATH"]

    def shell_line(self, line, folder, status=0, path=None):
        environment = {**self.environment, "PATH": path or self.environment["PATH"]}
        done = subprocess.run(
            ["bash", "-c", line],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=4 * TIMEOUT,
        )
        self.assertEqual(status, done.returncode, done.stdout)
        return done.stdout

    def follow_the_hint(self, name, path=None):
        """Types what the program printed; the two lines under the list of files."""
        lines = self.shell_line(f"{HAL} new component {name}", self.folder, path=path).splitlines()
        self.assertTrue(lines[1].startswith("  cd ") and "ctest" in lines[2], lines)
        printed = self.shell_line(f"{lines[1]} && {lines[2]}", self.folder, path=path)
        self.assertIn("100% tests passed, 0 tests failed out of 1", printed)
        return self.folder / name

    @unittest.skipUnless(PACKAGE.exists(), "no package beside the program")
    def test_what_is_printed_works_straight_from_the_build_tree(self):
        folder = self.follow_the_hint("my-ramp")
        self.assertEqual(
            {"my-ramp.cpp", "CMakeLists.txt", "test.hal", "expected", "build"},
            set(os.listdir(folder)),
        )
        self.assertIn(f'HINTS "{BUILD}"', (folder / "CMakeLists.txt").read_text())
        # a failing test prints the output and the expectation
        (folder / "expected").write_text("7\n")
        said = self.shell_line("ctest --test-dir build --output-on-failure", folder, status=8)
        self.assertIn("      it prints\n      0.2\n      FALSE\n", said)
        self.assertIn("      and 'expected' has\n      7\n", said)
        self.environment["HALCYON_PLUGIN_PATH"] = str(folder / "build")
        self.assertIn("my-ramp: Follows its input at a limited speed", self.good("doc", "my-ramp"))
        self.assertEqual("", self.good("fmt", "--check", folder / "test.hal"))
        self.assertIn("no errors", self.run_program("check", folder / "test.hal").stderr)

    @unittest.skipUnless((BUILD / "cmake_install.cmake").exists(), "not a build tree")
    def test_an_installed_halcyon_in_the_path_needs_no_hint(self):
        prefix = self.folder / "installed"
        # tests/checks/package.py makes a true installation; this is about where CMake looks
        shutil.copytree(PACKAGE, prefix / "lib" / "cmake" / "Halcyon")
        (prefix / "bin").mkdir()
        (prefix / "bin" / "hal").symlink_to(HAL)
        folder = self.follow_the_hint("ramp2", path=f"{prefix}/bin:{os.environ['PATH']}")
        self.assertNotIn("HINTS", (folder / "CMakeLists.txt").read_text())

    def test_rejects_invalid_names_and_folders(self):
        (self.folder / "there").mkdir()
        (self.folder / "there" / "file").touch()
        for words, why in {
            (
                "my part",
            ): "invalid component name 'my part': use a letter, then letters, digits, - and _; try: hal new component my-part",
            (
                "my",
                "part",
            ): "expected one name, not 2; a name contains no blanks: hal new component my-part",
            ("9x",): "invalid component name '9x'",
            ("../x",): "invalid component name '../x'",
            ("class",): "'class' is a C++ keyword; try: hal new component my-class",
            ("not_eq",): "'not_eq' is a C++ keyword",
            (
                "threads",
            ): "component 'threads' already exists (see: hal doc threads); choose another name",
            ("n" * 41,): "the name has 41 characters; the limit is 40",
            (
                "there",
            ): "'there' exists already; give the new component another folder: hal new component there --folder DIR",
            ("ok", "--folder", "there"): "'there' exists already",
            ("ok", "--folder", "there/file/x"): "cannot create 'there/file/x': Not a directory",
            (): "missing name; type: hal new component NAME",
        }.items():
            with self.subTest(words):
                self.assertIn(why, self.bad("new", "component", *words))
        self.assertEqual(
            "hal new: missing kind: only components can be created; type: hal new component thing\n",
            self.bad("new", "thing"),
        )
        self.assertEqual({"there"}, set(os.listdir(self.folder)) - {".ccache"})

    def test_a_folder_of_another_name(self):
        self.assertTrue(
            self.good("new", "component", "part", "--folder", "a b/c").startswith(
                "'a b/c': part.cpp, CMakeLists.txt"
            )
        )
        self.assertEqual(
            {"part.cpp", "CMakeLists.txt", "test.hal", "expected"},
            set(os.listdir(self.folder / "a b" / "c")),
        )


if __name__ == "__main__":
    unittest.main()
