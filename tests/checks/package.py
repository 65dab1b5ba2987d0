#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""package.py ROOT BUILD: installs the build into a folder of its own, and builds a component against it from three lines of CMake."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import symbols

PROJECT = "project(mine CXX)\nfind_package(Halcyon REQUIRED)\nadd_hal_component(mine mine.cpp)\n"
HEADER = "cmake_minimum_required(VERSION 3.25)\n"  # every CMake file begins so
COMPONENT = """#include "hal/component.hpp"
struct Mine : hal::Component {
    using Component::Component;
    hal::In<double>  in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "twice the input"};
    hal::Function    run{*this, "", &Mine::step, "doubles"};
    void step(hal::Cycle) noexcept { out = 2.0 * in; }
};
HAL_COMPONENT(Mine, "mine", "Doubles")
"""
NETLIST = (
    "loadrt threads name1=fast period1=1000000\nloadrt mine\naddf mine.0 fast\nsetp mine.0.in 21\n"
)


def run(*command, **options):
    result = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, check=False, **options
    )
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{result.stdout}{result.stderr}")
    return result.stdout


def missing_headers(include):
    """What installed headers include by a path below `include`, and is not installed."""
    for header in include.rglob("*.hpp"):
        for name in re.findall(r'^#include "([^"]+)"', header.read_text(), re.MULTILINE):
            if not (include / name).exists() and not (header.parent / name).exists():
                yield f"{header.relative_to(include)} includes {name}"


def main(build):
    with tempfile.TemporaryDirectory() as folder:
        prefix, source = Path(folder) / "installed", Path(folder) / "mine"
        run("cmake", "--install", build, "--prefix", prefix)
        if missing := sorted(missing_headers(prefix / "include")):
            sys.exit("not installed:\n" + "\n".join(missing))
        source.mkdir()
        (source / "CMakeLists.txt").write_text(HEADER + PROJECT)
        (source / "mine.cpp").write_text(COMPONENT)
        run(
            "cmake",
            "-S",
            source,
            "-B",
            source / "build",
            "-G",
            "Ninja",
            f"-DCMAKE_PREFIX_PATH={prefix}",
        )
        run("cmake", "--build", source / "build")
        found = symbols.exported(source / "build" / "mine.so")
        if found != ["hal_plugin"]:
            sys.exit(f"mine.so exports {found}")
        # The installed program finds its own components, and this one through the search path.
        hal = prefix / "bin" / "hal"
        environment = dict(os.environ, HALCYON_PLUGIN_PATH=str(source / "build"), HOME=folder)
        manual = run(hal, "doc", "mine", env=environment)
        if "twice the input" not in manual:
            sys.exit(f"hal doc mine prints:\n{manual}")
        # What `hal new component` makes passes its test at once.
        path = dict(environment, PATH=f"{prefix}/bin:{os.environ['PATH']}")
        run(hal, "new", "component", "fresh", env=path, cwd=folder)
        run(
            "bash",
            "-c",
            "cmake -B build && cmake --build build && ctest --test-dir build",
            env=path,
            cwd=Path(folder) / "fresh",
        )
        (source / "mine.hal").write_text(NETLIST + "loadrt not\n")
        run(hal, "check", source / "mine.hal", env=environment)
        for alias in ("halrun", "halcmd"):
            if not (prefix / "bin" / alias).exists():
                sys.exit(f"{alias} is not installed")
    print("installs, and a component builds and loads outside the tree")


if __name__ == "__main__":
    main(Path(sys.argv[2]).resolve())
