#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs error tests: run.py [HAL] [--every-code] [TEST...]

CODE.hal provokes the diagnostic CODE: `hal check CODE.hal`, or the command line in CODE.cmd, or the shell script CODE.sh
runs in this folder, and its whole standard error must be CODE.expected, which must mention [CODE]. CODE-more.hal is a
further test of CODE. Files the tests source have another ending (.inc). A script has the program in its PATH and an
empty folder of its own in $HOME.
Without TEST (or with --every-code, which runs nothing) each code of `hal explain` must have a test, and each test a code.
"""
import difflib
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from program import environment, program  # noqa: E402

# No command line provokes these alike on every machine; tests/unit/session_memory.cpp, tests/cli/cell_test.py and
# tests/cli/program_life_test.py do.
ELSEWHERE = {"out-of-memory", "thread-refused", "no-dds", "not-permitted"}
TIMEOUT = float(os.environ.get("HALCYON_TEST_TIMEOUT", "10"))


def run(hal, command):
    """Standard error and exit status of a command line."""
    with tempfile.TemporaryDirectory() as folder:
        # a file that is not a plugin, and the components made for tests
        plugins = {"HALCYON_PLUGIN_PATH": f"plugins:{hal.parent.parent / 'tests' / 'plugins'}"}
        try:
            done = subprocess.run(
                ["/usr/bin/env", *command],
                cwd=HERE,
                env=environment(hal, folder) | plugins,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                timeout=TIMEOUT,
            )
        except subprocess.TimeoutExpired as late:
            return late.stderr or b"", f"still running after {TIMEOUT:g} s"
    return done.stderr, done.returncode


def codes(hal):
    """All diagnostic codes."""
    listed = subprocess.run(
        [str(hal), "explain"], stdout=subprocess.PIPE, check=True, timeout=TIMEOUT
    ).stdout.decode()
    return {line.split()[0] for line in listed.splitlines() if line and not line.startswith(" ")}


def code_of(test, known):
    """The longest code the test's name begins with, at a dash."""
    parts = test.split("-")
    names = ["-".join(parts[:n]) for n in range(len(parts), 0, -1)]
    return next((name for name in names if name in known), None)


def check(hal, test, known):
    """What is wrong with a test, as lines; empty: nothing."""
    expected = HERE / f"{test}.expected"
    if not expected.exists():
        return [f"it has no file '{test}.expected'"]
    code = code_of(test, known)
    if not code:
        return ["no diagnostic code has this name; see: hal explain"]
    command = ["hal", "check", f"{test}.hal"]
    if (HERE / f"{test}.cmd").exists():
        command = shlex.split((HERE / f"{test}.cmd").read_text(), comments=True)
    if (HERE / f"{test}.sh").exists():
        command = ["sh", "-eu", f"{test}.sh"]
    got, status = run(hal, command)
    wanted = expected.read_bytes()
    problems = []
    if not isinstance(status, int) or status < 0:
        problems.append(f"ended with {status}")
    if f"[{code}]".encode() not in wanted:
        problems.append(f"'{test}.expected' does not mention [{code}]")
    if got != wanted:
        text = lambda data: data.decode(errors="backslashreplace").splitlines()
        problems += list(
            difflib.unified_diff(text(wanted), text(got), "expected", "stderr", lineterm="", n=2)
        ) or ["the same lines, but other line ends"]
    return problems


def main():
    arguments = sys.argv[1:]
    hal = program(arguments)
    coverage_only = "--every-code" in arguments
    names = [Path(a).stem for a in arguments if a != "--every-code"]
    known = codes(hal)
    everything = sorted(
        {path.stem for pattern in ("*.hal", "*.cmd", "*.sh") for path in HERE.glob(pattern)}
    )
    tests = [] if coverage_only else [t for t in everything if not names or t in names]
    failed = 0
    for test in tests:
        if problems := check(hal, test, known):
            failed += 1
            print(f"FAILED {test}")
            print("\n".join("    " + line for line in problems))
    if not names:
        tested = {code_of(test, known) for test in everything}
        for code in sorted(known - tested - ELSEWHERE):
            failed += 1
            print(f"FAILED {code}: no test; write {code}.hal and {code}.expected")
        for path in sorted(HERE.glob("*.expected")):
            if not code_of(path.stem, known) or path.stem not in everything:
                failed += 1
                print(f"FAILED {path.name}: no code has this name, or there is no {path.stem}.hal")
    print(
        f"{len(tests)} error tests run, {failed} failed"
        if not coverage_only
        else f"{len(known)} codes, {failed} without test"
    )
    return 0 if (tests or coverage_only) and not failed else 1


if __name__ == "__main__":
    sys.exit(main())
