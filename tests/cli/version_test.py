#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`hal --version`: the version and the commit, which a build finds out without being out of date each time."""
import os
import re
import shutil
import subprocess
import sys
import unittest

from harness import ROOT, Case

PROJECT = f"""cmake_minimum_required(VERSION 3.25)
project(Halcyon VERSION 9.8.7 LANGUAGES CXX)
include({ROOT}/cmake/HalcyonCommit.cmake)
add_executable(show show.cpp)
halcyon_commit(show)
target_include_directories(show PRIVATE "${{PROJECT_SOURCE_DIR}}")
set_target_properties(show PROPERTIES CXX_STANDARD 20)
"""
SHOW = """#include "paths.hpp"
#include <cstdio>
int main() { std::fwrite(hal::paths::commit.data(), 1, hal::paths::commit.size(), stdout); }
"""
IDENTITY = ["-c", "user.name=A", "-c", "user.email=a@example.org"]


class Version(Case):
    def run_in(self, folder, *words):
        done = subprocess.run(
            [str(word) for word in words],
            cwd=folder,
            capture_output=True,
            text=True,
            env={**os.environ, "GIT_CEILING_DIRECTORIES": str(self.folder)},
        )
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        return done.stdout

    def project(self):
        folder = self.folder / "source"
        folder.mkdir()
        for name, text in {"CMakeLists.txt": PROJECT, "show.cpp": SHOW}.items():
            self.write(f"source/{name}", text)
        shutil.copy(ROOT / "runtime/paths.hpp", folder)
        return folder

    def build(self, folder):
        if not os.path.exists(f"{folder}/build"):
            self.run_in(folder, "cmake", "-G", "Ninja", "-B", "build")
        made = self.run_in(folder, "ninja", "-C", "build")
        return made, self.run_in(folder, "build/show")

    def commit(self, folder, message):
        self.run_in(folder, "git", *IDENTITY, "commit", "-q", "--allow-empty", "-m", message)
        return self.run_in(folder, "git", "rev-parse", "HEAD")[:10]

    def test_names_the_version_and_a_commit(self):
        version = re.search(
            r"project\(Halcyon VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()
        ).group(1)
        for words in (("--version",), ("version",)):
            self.assertRegex(
                self.good(*words),
                rf"\Ahal {re.escape(version)} \(commit ([0-9a-f]{{10}}|unknown)\)\npackages: .*\n(left out: .*\n)?\Z",
            )

    def test_follows_the_checkout_and_is_not_built_without_a_change(self):
        folder = self.project()
        self.run_in(folder, "git", "init", "-q")
        first = self.commit(folder, "one")
        self.assertEqual(first, self.build(folder)[1])
        self.assertIn("no work to do", self.build(folder)[0])
        second = self.commit(folder, "two")
        self.assertNotEqual(first, second)
        self.assertEqual(second, self.build(folder)[1])
        self.assertIn("no work to do", self.build(folder)[0])
        shutil.rmtree(f"{folder}/.git")
        self.assertEqual("unknown", self.build(folder)[1])

    def test_is_unknown_in_an_archive_also_one_unpacked_inside_of_another_checkout(self):
        self.run_in(self.folder, "git", "init", "-q")
        self.commit(self.folder, "outside")
        self.assertEqual("unknown", self.build(self.project())[1])


if __name__ == "__main__":
    if not shutil.which("git") or not shutil.which("ninja"):
        print("needs git and ninja")
        sys.exit(77)
    unittest.main()
