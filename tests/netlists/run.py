#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs netlist tests: run.py [HAL] [--once] [TEST...]

A test is a folder with test.hal. `hal sim test.hal` runs in it, twice; both runs must print the same bytes, and they
must be those of `expected`. Where there is a file `expected.stderr`, standard error is compared too; where there is a
file `status`, it holds the exit status (else 0); where there is a file `command`, it is the command line instead.
A test that `hal replay --exact --as-test` has written, which has a file journal.mcap, is run by `hal replay` and must end with status 0.
--once leaves out the second run: under a sanitizer and under the real-time guard, which repeat tests of the release build.
HAL is the program (default: $HAL_BIN, else the newest build); a TEST is a folder, its test.hal, or a part of its name.
"""

import difflib
import os
import shlex
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from program import environment, program  # noqa: E402

TIMEOUT = float(os.environ.get("HALCYON_TEST_TIMEOUT", "10"))


def run(hal, test):
    """Standard output, standard error and exit status of one run."""
    command = ["hal", "sim", "test.hal"]
    if (test / "journal.mcap").exists():
        command = ["hal", "replay", "."]
    elif (test / "command").exists():
        command = shlex.split((test / "command").read_text())
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run(
                ["/usr/bin/env", *command],
                cwd=test,
                env=environment(hal, folder),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                timeout=TIMEOUT,
            )
        except subprocess.TimeoutExpired as late:
            return late.stdout or b"", late.stderr or b"", f"still running after {TIMEOUT:g} s"
    # the warning of a busy host, or an emulator, about a slow constructor is not the netlist's
    err = re.sub(
        rb"(?m)^hal: '.*' \(.*\) has not returned from its constructor for .*\n", b"", done.stderr
    )
    return done.stdout, err, done.returncode


def differences(wanted, got, what):
    text = lambda data: data.decode(errors="backslashreplace").splitlines()
    lines = list(
        difflib.unified_diff(text(wanted), text(got), f"expected {what}", what, lineterm="", n=2)
    )
    return lines or [f"{what}: the same lines, but other line ends"]


def check(hal, test, once):
    """What is wrong with a test, as lines; empty: nothing."""
    if not (test / "expected").exists():
        return ["it has no file 'expected'"]
    if (test / "journal.mcap").exists():
        out, err, status = run(hal, test)
        lines = (out + err).decode(errors="backslashreplace").splitlines()
        return [] if status == 0 else [f"exit status {status}:", *lines]
    first = run(hal, test)
    second = first if once else run(hal, test)
    out, err, status = first
    problems = []
    wanted_status = int((test / "status").read_text()) if (test / "status").exists() else 0
    if status != wanted_status:
        problems += [f"exit status {status}, not {wanted_status}; standard error:"] + err.decode(
            errors="backslashreplace"
        ).splitlines()
    if out != (wanted := (test / "expected").read_bytes()):
        problems += differences(wanted, out, "stdout")
    if (test / "expected.stderr").exists() and err != (
        wanted := (test / "expected.stderr").read_bytes()
    ):
        problems += differences(wanted, err, "stderr")
    if first[0] != second[0] or first[2] != second[2]:
        problems += ["a second run differs from the first:"] + differences(
            first[0], second[0], "stdout"
        )
    return problems


def name_of(test):
    return str(test.relative_to(HERE) if HERE in test.parents else test)


def main():
    arguments = sys.argv[1:]
    hal = program(arguments)
    once = "--once" in arguments
    arguments = [argument for argument in arguments if argument != "--once"]
    tests = sorted(path.parent for path in HERE.rglob("test.hal"))
    tests += [
        folder
        for folder in (Path(argument).resolve() for argument in arguments)
        if (folder / "test.hal").exists() and HERE not in folder.parents
    ]
    if arguments:
        wanted = [
            (
                Path(a).resolve().parent
                if a.endswith(".hal")
                else Path(a).resolve() if Path(a).is_dir() else a
            )
            for a in arguments
        ]
        tests = [
            t
            for t in tests
            if any(t == w or (isinstance(w, str) and w in name_of(t)) for w in wanted)
        ]
    failed = 0
    for test in tests:
        if problems := check(hal, test, once):
            failed += 1
            print(f"FAILED {name_of(test)}")
            print("\n".join("    " + line for line in problems))
    print(f"{len(tests) - failed} of {len(tests)} netlist tests passed")
    return 0 if tests and not failed else 1


if __name__ == "__main__":
    sys.exit(main())
