#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The packages that the script ./hal installs for a machine, against those whose headers the components of the machine were compiled with."""
import functools
import re
import shutil
import subprocess
import sys
import unittest

from harness import HAL, ROOT

BUILD = HAL.parent.parent


def table(path):
    """The lines of a table as a dictionary: the first word, and the set of the others."""
    rows = {}
    for line in path.read_text().splitlines():
        name, *words = line.split()
        rows.setdefault(name, set()).update(words)
    return rows


def run(*words):
    return subprocess.run(words, cwd=BUILD, capture_output=True, text=True, check=True).stdout


def headers_of_objects():
    """The headers of the system that each object of the build was compiled with."""
    headers, current = {}, None
    for line in run("ninja", "-t", "deps").splitlines():
        if line.startswith("    "):
            path = line.strip()
            if path.startswith("/usr/include/"):
                headers[current].add(path)
        elif ": #deps" in line:
            current = line.split(":")[0]
            headers[current] = set()
    return headers


def packages_of_files(paths):
    """The Debian package of each file."""
    done = subprocess.run(
        ["dpkg", "-S", *sorted(paths)], capture_output=True, text=True, check=False
    )
    return {
        path: package.split(":")[0]
        for package, path in re.findall(r"(?m)^(\S+): (/.*)$", done.stdout)
    }


@functools.cache
def dependencies():
    """The packages that each installed package depends on."""
    return {
        package: set(re.findall(r"(?:^|, )([a-z0-9.+-]+)", depends))
        for package, depends in re.findall(
            r"(?m)^(\S+)\t(.*)$", run("dpkg-query", "-W", "-f", "${Package}\\t${Depends}\\n")
        )
    }


def with_dependencies(packages):
    """The packages and those that they depend on."""
    found, waiting = set(), set(packages)
    while waiting:
        one = waiting.pop()
        found.add(one)
        waiting |= dependencies().get(one, set()) - found
    return found


@functools.cache
def inputs_of(component):
    """All files that a component is built from."""
    return run("ninja", "-t", "inputs", f"component_{component}").split("\n")


class Packages(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.optional = set(table(ROOT / "cmake/optional"))
        cls.installed_for = table(BUILD / "components/packages")
        cls.headers = headers_of_objects()
        every = set().union(*cls.headers.values())
        cls.package_of = packages_of_files(every)

    def compiled_with(self, component):
        """The optional packages whose headers a component or a library in it was compiled with."""
        headers = set().union(*(self.headers.get(one, set()) for one in inputs_of(component)))
        return {
            self.package_of[header] for header in headers if header in self.package_of
        } & self.optional

    def needed_by(self, netlist):
        words = ["awk", "-v", "command=run", "-f", ROOT / "cmake/needs.awk", "--", "run", netlist]
        return subprocess.run(
            words, cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.split()

    def test_each_component_is_compiled_with_the_packages_that_are_installed_for_it(self):
        absent = table(BUILD / "components/absent")
        for component in table(BUILD / "components/groups"):
            if component in absent:
                continue
            with self.subTest(component):
                stated, used = self.installed_for.get(component, set()), self.compiled_with(
                    component
                )
                self.assertLessEqual(
                    used, with_dependencies(stated), "a package that is used is installed"
                )
                self.assertLessEqual(stated, used, "a package that is installed is used")

    def test_every_machine_of_halfiles_installs_what_its_components_use_and_no_more(self):
        machines = [
            path
            for path in sorted((ROOT / "halfiles").rglob("*"))
            if path.suffix in (".hal", ".ini")
        ]
        self.assertGreater(len(machines), 30)
        known = set(table(BUILD / "components/groups"))
        for machine in machines:
            with self.subTest(machine.relative_to(ROOT)):
                names = self.needed_by(machine)
                installed = set().union(
                    *(self.installed_for.get(name, set()) for name in names if name in known)
                )
                used = set().union(*(self.compiled_with(name) for name in names if name in known))
                self.assertLessEqual(used, with_dependencies(installed))
                self.assertLessEqual(installed, used)

    def test_the_pendulum_needs_nothing_beyond_the_program(self):
        for name in self.needed_by(ROOT / "halfiles/furuta/hang.hal"):
            self.assertEqual(set(), self.installed_for.get(name, set()), name)


if __name__ == "__main__":
    if (
        not shutil.which("ninja")
        or not shutil.which("dpkg")
        or not (BUILD / ".ninja_deps").exists()
    ):
        print("needs ninja, dpkg and the build tree of the program")
        sys.exit(77)
    absent_packages = (BUILD / "components/absent").read_text()
    if absent_packages:
        print(
            "needs a build with all optional packages; left out: "
            + " ".join(absent_packages.split()[::2])
        )
        sys.exit(77)
    unittest.main()
