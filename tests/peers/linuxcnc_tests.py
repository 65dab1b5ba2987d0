#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs LinuxCNC's own HAL tests against Halcyon: linuxcnc_tests.py TESTS_FOLDER [NAME...]

TESTS_FOLDER is the `tests` folder of a LinuxCNC source tree the user has; nothing of it is part of this project. A test
is a folder with test.hal: `halrun -f test.hal` runs in a copy of it, then `checkresult`, or a comparison of
standard output with `expected`, judges, as upstream's runner does. A test that needs a component, program or file that is not
here is listed with what it needs; it is not counted as passed.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("HAL_BIN", ROOT / "build/release/bin/hal")).resolve().parent


def missing(test, components):
    """What the test needs and this project does not have, or an empty text."""
    text = (test / "test.hal").read_text(errors="replace")
    wanted = re.findall(r"^\s*loadrt\s+(\S+)", text, re.M)
    absent = [w for w in dict.fromkeys(wanted) if w.replace("-", "_") not in components]
    programs = [p for p in re.findall(r"^\s*loadusr\s+(?:-\S+\s+)*(\S+)", text, re.M)
                if not (test / p).exists() and not shutil.which(p, path=f"{BIN}:{os.environ['PATH']}")]
    return ", ".join([f"component {a}" for a in absent] + [f"program {p}" for p in programs])


def run(test):
    """True, or why it failed."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder, test.name)
        shutil.copytree(test, here)
        environment = dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}", HOME=folder, XDG_RUNTIME_DIR=folder, TOPDIR=str(ROOT), REALTIME="true")
        try:
            done = subprocess.run(["halrun", "-f", "test.hal"], cwd=here, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, timeout=60)
        except subprocess.TimeoutExpired:
            return "still running after 60 s"
        (here / "result").write_bytes(done.stdout)
        (here / "stderr").write_bytes(done.stderr)
        if done.returncode != 0:
            return f"status {done.returncode}: " + done.stderr.decode(errors="replace").strip().splitlines()[0:1].__str__()
        if (here / "checkresult").exists():
            judge = subprocess.run([str(here / "checkresult"), str(here / "result")], cwd=here, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
            return True if judge.returncode == 0 else "checkresult: " + judge.stdout.decode(errors="replace").strip()[-200:]
        if (here / "expected").exists():
            wanted = (here / "expected").read_bytes()
            if wanted == done.stdout:
                return True
            lines = zip(wanted.decode().splitlines(), done.stdout.decode(errors="replace").splitlines())
            first = next(((i, w, g) for i, (w, g) in enumerate(lines, 1) if w != g), None)
            return f"line {first[0]} is '{first[2]}', expected '{first[1]}'" if first else "another number of lines"
        return "no expected and no checkresult"


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    top = pathlib.Path(sys.argv[1]).resolve()
    listed = subprocess.run([str(BIN / "hal"), "doc"], stdout=subprocess.PIPE, text=True, check=True).stdout
    components = {line.split()[0].replace("-", "_") for line in listed.splitlines() if line.strip()} | {"threads"}
    passed, failed, needs = 0, 0, 0
    for file in sorted(top.rglob("test.hal")):
        test, name = file.parent, str(file.parent.relative_to(top))
        if len(sys.argv) > 2 and not any(part in name for part in sys.argv[2:]):
            continue
        lacks = missing(test, components)
        if lacks:
            needs += 1
            print(f"needs   {name}: {lacks}")
            continue
        verdict = run(test)
        passed, failed = passed + (verdict is True), failed + (verdict is not True)
        print(f"passed  {name}" if verdict is True else f"FAILED  {name}: {verdict}")
    print(f"{passed} passed, {failed} failed, {needs} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
