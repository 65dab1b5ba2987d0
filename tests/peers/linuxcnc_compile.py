#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compiles LinuxCNC's own components with `hal compile` and runs its tests on them.

linuxcnc_compile.py SOURCE_FOLDER [TESTS_FOLDER] [--only comp|c]

SOURCE_FOLDER is `src` of a LinuxCNC source tree the user has, TESTS_FOLDER its `tests`; nothing of them is part of this
project. Every .comp and .c file of src/hal/components is compiled unmodified. A file that includes headers of the motion
controller or of hardware is listed with them and not counted. What compiles is loaded (`loadrt NAME`); then every test of
linuxcnc_tests.py that loads one of them runs with the compiled ones in front of our own, and those of `halcompile` with
a program of that name that calls ours. docs/linuxcnc-test-runs.md has the results and the reasons.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

import linuxcnc_tests as tests

HAL = tests.BIN / "hal"
ELSEWHERE = re.compile(
    r'^\s*#?include\s+[<"](kinematics\.h|hostmot2[\w-]*\.h|.*mesa-hostmot2/.*|emcmotcfg\.h|motion\.h|tp\.h|posemath\.h|rtapi_pci\.h|'
    r'rtapi_io\.h|sys/io\.h|rtapi_parport\.h|gtk/.*|libusb.*|linux/.*|.*homing\.h|.*mot_priv\.h)[>"]',
    re.M,
)
INCLUDES = ""  # LinuxCNC's source, where components find headers of their own, and a config.h as its configure makes one
OPTIONS = re.compile(r"^\s*option\s+(homemod|tpmod)\b", re.M)

HALCOMPILE = """#!/bin/sh
# LinuxCNC's program, as far as its tests call it, by `hal compile`
where=. keep= last=
for word do
    case $word in
    --install) where=$HALCOMPILE_INSTALL; last=y ;;
    --compile) last=y ;;
    --personalities=* | --userspace) ;;
    --extra-compile-args=*) export CFLAGS="${word#*=}" ;;
    --extra-link-args=*) export LDFLAGS="${word#*=}" ;;
    --*) echo "halcompile: $word is not here" >&2; exit 1 ;;
    *) file=$word ;;
    esac
done
[ "$last" ] || { keep=--keep; where=$HALCOMPILE_SCRATCH; }
hal compile $keep --output "$where" "$file" || exit
name=$(basename "${file%.*}")
[ "$where" = . ] || [ ! -f "$where/$name" ] || mv "$where/$name" "$EMC2_HOME/bin/"
"""


def hal(*words, folder=None, plugins=None):
    """Standard error and exit status of our program."""
    environment = dict(
        tests.CLEAN,
        HOME=str(folder),
        HALCYON_PLUGIN_PATH=str(plugins or ""),
        NO_COLOR="1",
        CPATH=INCLUDES,
    )
    done = subprocess.run(
        [str(HAL), *words],
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        timeout=300,
    )
    return done.stderr.strip(), done.returncode


def first_error(text):
    return next(
        (line for line in text.splitlines() if "error" in line),
        text.splitlines()[-1] if text else "",
    )


def compile_all(sources, folder):
    """Compiles and loads; returns the names of those that do, and how many do not."""
    plugins, good, bad = folder / "plugins", [], 0
    plugins.mkdir()
    for source in sources:
        text = source.read_text(errors="replace")
        needs = sorted(set(ELSEWHERE.findall(text) + OPTIONS.findall(text)))
        if needs:
            print(f"needs    {source.name}: {', '.join(needs)}", flush=True)
            continue
        output, status = hal("compile", "--output", str(plugins), str(source), folder=folder)
        if status:
            bad += 1
            print(f"FAILED   {source.name}: {first_error(output)}", flush=True)
            continue
        if not (plugins / f"{source.stem}.so").exists():
            good.append(source.stem)
            print(f"compiled {source.name} (a program)", flush=True)
            continue
        (folder / "load.hal").write_text(f"loadrt {source.stem}\n")
        output, status = hal("check", "load.hal", folder=folder, plugins=plugins)
        good.append(source.stem)
        print(
            f"compiled {source.name}"
            + (f" (loads with arguments only: {first_error(output)})" if status else ""),
            flush=True,
        )
    return good, bad


def run_tests(top, compiled, folder):
    """Tests that load a compiled component or compile one themselves."""
    shim, installed, scratch, home = (
        folder / "bin",
        folder / "installed",
        folder / "scratch",
        folder / "emc2",
    )
    for made in (shim, installed, scratch, home, home / "bin"):
        made.mkdir()
    (shim / "halcompile").write_text(HALCOMPILE)
    (shim / "halcompile").chmod(0o755)
    tests.UTILITIES.add("halcompile")
    tests.CLEAN.update(
        EMC2_HOME=str(home),
        PATH=f"{shim}:{home}/bin:{tests.CLEAN['PATH']}",
        HALCYON_PLUGIN_PATH=f"{installed}:{folder / 'plugins'}",
        HALCOMPILE_INSTALL=str(installed),
        HALCOMPILE_SCRATCH=str(scratch),
        RTLIB_DIR=str(installed),
    )
    listed = subprocess.run(
        [str(HAL), "doc"], env=tests.CLEAN, stdout=subprocess.PIPE, text=True, check=True
    ).stdout
    known = {line.split()[0].replace("-", "_") for line in listed.splitlines() if line.strip()} | {
        "threads"
    }
    passed = failed = other = 0
    found = {
        file.parent: file.name
        for name in reversed(tests.SCRIPTS)
        for file in top.rglob(name)
        if file.is_file()
    }
    for test, script in sorted(found.items()):
        name, own = str(test.relative_to(top)), {file.stem for file in test.glob("*.comp")} | {
            file.stem for file in test.glob("*.c")
        }
        loads = {
            word
            for file in test.iterdir()
            if file.suffix in (".hal", ".sh") or file.name == "test"
            for word in re.findall(r"loadrt\s+(\w+)", file.read_text(errors="replace"))
        }
        if not (
            loads & set(compiled)
            or own
            and "halcompile" in (test / script).read_text(errors="replace")
        ):
            continue
        if parts := tests.missing_parts(test, known | own):
            other += 1
            print(f"needs    {name}: {parts}", flush=True)
            continue
        verdict = tests.run(test, script)
        passed, failed = passed + (verdict is True), failed + (verdict is not True)
        print(f"passed   {name}" if verdict is True else f"FAILED   {name}: {verdict}", flush=True)
    return passed, failed, other


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("tests", type=pathlib.Path, nargs="?")
    parser.add_argument("--only", choices=["comp", "c"])
    given = parser.parse_args()
    kinds = [given.only] if given.only else ["comp", "c"]
    sources = sorted(
        file
        for kind in kinds
        for file in (given.source.resolve() / "hal" / "components").glob(f"*.{kind}")
    )
    global INCLUDES
    with tempfile.TemporaryDirectory() as where:
        folder = pathlib.Path(where)
        (folder / "config").mkdir()
        (folder / "config" / "config.h").touch()
        INCLUDES = f"{given.source.resolve()}:{folder / 'config'}"
        good, bad = compile_all(sources, folder)
        print(
            f"{len(good)} compiled, {bad} failed, {len(sources) - len(good) - bad} need unsupported parts"
        )
        if given.tests:
            passed, failed, other = run_tests(given.tests.resolve(), good, folder)
            print(f"tests: {passed} passed, {failed} failed, {other} need unsupported parts")
            bad += failed
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
