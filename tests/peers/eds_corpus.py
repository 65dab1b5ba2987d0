#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Reads a folder of device descriptions with `hal can eds check` and, when it is installed, with the Python package canopen.

eds_corpus.py FOLDER [--table]

The files belong to their vendors and are not part of this project. Nothing may crash; a file is read, or rejected with a
reason that names a line. --table prints a line per file (Markdown), without it there is a summary and what stands out.
Needs $HAL_BIN or a built program; the package: pip install canopen, in an environment of its own.
"""
import os
import re
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from program import program  # noqa: E402

ENDINGS = {".eds", ".dcf", ".xdd", ".xdc"}
SUMMARY = re.compile(r"(\d+) objects?, (\d+) entr(?:y|ies), .*; (\d+) warnings?, (\d+) notes?$")


def ours(hal, path):
    """(objects, entries, warnings, notes, milliseconds), or the reason of its rejection, or how the program ended."""
    start = time.monotonic()
    done = subprocess.run(
        [hal, "can", "eds", "check", path],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        timeout=60,
    )
    took = 1000 * (time.monotonic() - start)
    lines = done.stderr.decode().splitlines()
    found = SUMMARY.search(lines[-1]) if lines else None
    if done.returncode in (0, 1) and found:
        return (*map(int, found.groups()), took)
    if done.returncode == 1 and lines and "rejected" in lines[-1]:
        return next((line for line in lines if " error: " in line), "rejected without a reason")
    return f"CRASH: status {done.returncode}"


def theirs(path):
    """How many objects the package canopen finds, or why it does not read the file; None when it is not installed."""
    try:
        import canopen
    except ImportError:
        return None
    try:
        return sum(
            index >= 0x1000 for index in canopen.import_od(str(path), node_id=1)
        )  # it counts dummies as objects, too
    except Exception as reason:  # whatever it is
        return f"{type(reason).__name__}: {reason}"


def main():
    arguments = [a for a in sys.argv[1:] if a != "--table"]
    if len(arguments) != 1:
        sys.exit(__doc__)
    hal = program()
    files = sorted(p for p in Path(arguments[0]).rglob("*") if p.suffix.lower() in ENDINGS)
    if not files:
        sys.exit(f"eds_corpus.py: no device description below {arguments[0]}")
    table = "--table" in sys.argv
    if table:
        print(
            "| file | objects | entries | warnings | notes | canopen |\n| --- | --- | --- | --- | --- | --- |"
        )
    read = rejected = crashed = clean = warnings = theirs_read = theirs_there = entries = 0
    slowest = (0.0, "")
    for path in files:
        mine, other = ours(hal, path), theirs(path)
        theirs_there += other is not None
        theirs_read += isinstance(other, int)
        word = (
            "-"
            if other is None
            else other
            if isinstance(other, int)
            else str(other)[:60].replace("|", "/")
        )
        if isinstance(mine, tuple):
            read += 1
            entries += mine[1]
            warnings += mine[2]
            clean += mine[2] == 0
            slowest = max(slowest, (mine[4], path.name))
            row = f"| {path.name} | {mine[0]} | {mine[1]} | {mine[2]} | {mine[3]} | {word} |"
        else:
            rejected += not mine.startswith("CRASH")
            crashed += mine.startswith("CRASH")
            row = f"| {path.name} | {mine} | | | | {word} |"
        if table:
            print(row)
        elif not isinstance(mine, tuple) or isinstance(other, str):
            print(row)
        elif isinstance(other, int) and other != mine[0]:
            print(f"{path.name}: {mine[0]} objects here, {other} in canopen")
    print(
        f"{len(files)} files: {read} read ({clean} without a warning), {rejected} rejected, {crashed} crashed; "
        f"{entries} entries, {warnings} warnings; "
        f"slowest {slowest[0]:.0f} ms ({slowest[1]})"
    )
    if theirs_there:
        print(f"Python package canopen: {theirs_read} read, {theirs_there - theirs_read} not")
    return 1 if crashed else 0


if __name__ == "__main__":
    sys.exit(main())
