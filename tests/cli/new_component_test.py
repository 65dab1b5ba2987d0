#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal new: a component compiles and passes its test at once, from the build tree and from an installation; a machine runs and passes its test."""

import os
import shutil
import subprocess
import unittest

from harness import HAL, TIMEOUT, Case, wait_until

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
            "hal new: missing kind; type: hal new component thing, or hal new machine thing\n",
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


class NewMachine(Case):
    def run_in(self, folder, *words):
        return subprocess.run(
            [HAL, *words], cwd=folder, env=self.environment, capture_output=True, text=True
        )

    def create(self, name, *options):
        printed = self.good("new", "machine", name, *options)
        return printed.splitlines()

    def test_each_bus_runs_and_passes_its_test(self):
        for bus, axes in (
            ("none", 1),
            ("none", 9),
            ("canopen", 3),
            ("canopen", 4),
            ("ethercat", 9),
        ):
            with self.subTest(bus=bus, axes=axes):
                name = f"{bus}-{axes}"
                lines = self.create(name, "--bus", bus, "--axes", axes)
                self.assertEqual(f"  cd {name}", lines[1])
                self.assertEqual(f"  hal run --ini {name}.ini {name}.hal", lines[2])
                folder = self.folder / name
                files = {f"{name}.hal", f"{name}.ini", "test.hal", "expected", "README.md"}
                if bus != "none":
                    files.add(f"{name}.{bus}")
                self.assertEqual(files, set(os.listdir(folder)))
                test = lines[3].removeprefix("Its test: ")
                for words in (
                    ("check", f"{name}.ini"),
                    ("check", "--ini", f"{name}.ini", f"{name}.hal"),
                ):
                    checked = self.run_in(folder, *words)
                    self.assertEqual(0, checked.returncode, checked.stderr)
                alone = self.run_in(folder, "check", f"{name}.hal").stderr
                self.assertTrue(
                    f"; type: hal check {name}.ini\n" in alone or f"--ini {name}.ini" in alone,
                    alone,
                )
                self.assertIn(test.split(" 2>")[0], (folder / "README.md").read_text())
                done = subprocess.run(
                    ["bash", "-c", f"set -o pipefail; {test}"],
                    cwd=folder,
                    env={**self.environment, "PATH": f"{HAL.parent}:{self.environment['PATH']}"},
                    stdout=subprocess.PIPE,
                    text=True,
                    timeout=2 * TIMEOUT,
                )
                self.assertEqual((0, ""), (done.returncode, done.stdout))
                for file in (f"{name}.hal", "test.hal"):
                    self.assertEqual("", self.good("fmt", "--check", folder / file))

    def test_it_runs_as_printed(self):
        self.create("mill", "--bus", "canopen")
        self.start("run", "--ini", "mill/mill.ini", "mill/mill.hal", loaded=False)
        wait_until(lambda: self.shell("gets", "bus-ok").stdout == "TRUE\n", "the drives are there")
        for name, value in (("chain-closed", "TRUE"), ("reset", "TRUE"), ("x-target", "1")):
            self.assertEqual(0, self.shell("sets", name, value).returncode)
        wait_until(lambda: self.value("x-there.out") == "TRUE", "x is there")
        self.assertEqual("TRUE\n", self.shell("gets", "enable").stdout)
        self.assertEqual(0, self.shell("unload", "chain").returncode)
        wait_until(lambda: self.shell("gets", "enable").stdout == "FALSE\n", "the chain is open")

    def test_options_of_a_machine_are_rejected_for_a_component(self):
        for option in (("--axes", "3"), ("--bus", "none")):
            self.assertEqual(
                "hal new: --axes and --bus are of a machine; type: hal new component part, or hal new machine part with them\n",
                self.bad("new", "component", "part", *option),
            )

    def test_wrong_words(self):
        for words, message in (
            (
                ("mill", "--bus", "profinet"),
                "unknown bus 'profinet'; type one of none, canopen, ethercat",
            ),
            (
                ("4mill",),
                "invalid machine name '4mill': use a letter, then letters, digits, - and _; try: hal new machine mill",
            ),
            ((), "missing name; type: hal new machine NAME"),
        ):
            self.assertEqual(f"hal new: {message}\n", self.bad("new", "machine", *words))
        self.assertIn("--axes", self.bad("new", "machine", "mill", "--axes", "0"))
        self.assertIn("--axes", self.bad("new", "machine", "mill", "--axes", "10"))
        self.create("mill")
        self.assertEqual(
            "hal new: 'mill' exists already; give the new machine another folder: hal new machine mill --folder DIR\n",
            self.bad("new", "machine", "mill"),
        )


if __name__ == "__main__":
    unittest.main()
