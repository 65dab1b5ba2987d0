#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs LinuxCNC's own HAL tests against Halcyon: linuxcnc_tests.py TESTS_FOLDER [NAME...]

TESTS_FOLDER is the `tests` folder of a LinuxCNC source tree the user has; nothing of it is part of this project. A test
is a folder with test.hal, test.sh or test, run in a copy of it as upstream's runner does: `halrun -f test.hal`,
`bash -x test.sh`, `./test`. Then `checkresult`, or a comparison of standard output with `expected`, decides.

A test is run when all it needs is in its folder, beside our program, or a plain system utility; a LinuxCNC that is
installed is not looked at. Every other test is listed with what it needs, and is not counted as passed; a test.sh that is
not about HAL is not listed. NAME is a part of a test's name. docs/linuxcnc-test-runs.md has the results and the reasons.
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
SCRIPTS = ("test.hal", "test.sh", "test")
MODULE = BIN.parent / "python"
CLEAN = {"PATH": f"{BIN}:/usr/bin:/bin", "LC_ALL": "C", "PYTHONPATH": str(MODULE)}

OF_HAL = re.compile(
    r"\bhal(run|cmd|compile|sampler|streamer)\b|\bREALTIME\b"
)  # a test without one of these is not about HAL
UTILITIES = set(
    """awk basename bash cat chmod cmp cp cut date diff dirname egrep env expr false fgrep find grep head id kill ln ls mkdir
    mkfifo mktemp mv nproc od paste pgrep printf ps python3 realpath rm rmdir sed seq sh sleep sort stat stdbuf tail tee timeout touch tr
    true uname uniq wc xargs""".split()
)
SHELL = set(
    """! . : [ [[ alias break case cd command continue declare do done echo elif else esac eval exec exit export fi for function if
    in let local printf pwd read readonly return set shift source test then time trap ulimit umask unset until wait while""".split()
)
BEFORE_COMMAND = {
    "!",
    "if",
    "then",
    "else",
    "elif",
    "do",
    "while",
    "until",
    "exec",
    "time",
    "env",
    "$SUDO",
    "${SUDO}",
}
PYTHON = {"linuxcnc", "rs274", "gcode", "hal_glib", "_hal"} | (
    set() if MODULE.is_dir() else {"hal", "pyhal"}
)  # LinuxCNC's modules

# What $REALTIME start and stop are upstream: an empty instance, to which halcmd connects.
REALTIME = """#!/bin/sh
case $1 in
start) : > realtime.hal
       hal run --no-picture realtime.hal > /dev/null 2>&1 &
       echo $! > realtime.pid
       until halcmd status > /dev/null 2>&1; do sleep 0.1; done ;;
stop)  kill -INT "$(cat realtime.pid)" 2> /dev/null
       while halcmd status > /dev/null 2>&1; do sleep 0.1; done ;;
esac
"""


def shell_programs(text):
    """The programs a shell script starts: first words of commands, as far as they are known without running it."""
    text = re.sub(
        r"<<-?\s*['\"]?(\w+)['\"]?(.*)\n(?:.*\n)*?\s*\1\s*$", r"\2", text, flags=re.M
    )  # here-documents
    text = re.sub(r"(^|\s)#.*", r"\1", text).replace("\\\n", " ")
    text = re.sub(r"'[^']*'|\"(?:[^\"\\]|\\.)*\"", "Q", text)
    text = re.sub(r"\$\(\(.*?\)\)|\d*[<>]&\d?-?|\d*>{1,2}\s*\S+|<\s*\S+", " ", text)
    functions = set(re.findall(r"^\s*(?:function\s+)?(\w+)\s*\(\)", text, re.M))
    for command in re.split(r"\$\(|[\n;|&()`]", text):
        words = command.split()
        while words and (words[0] in BEFORE_COMMAND or re.match(r"\w+\+?=", words[0])):
            words = words[1:]
        if (
            words
            and words[0] not in SHELL | functions
            and re.fullmatch(r"\$?[A-Za-z./][\w./-]*", words[0])
            and words[0] != "Q"
        ):
            yield words[0]


def missing_parts(test, components):
    """What the test needs and this project does not have, or an empty text."""
    needs = []

    def program(name):
        name = name.removeprefix("./")
        if not (
            (test / name).is_file()
            or (test / f"{pathlib.Path(name).name}.comp").is_file()
            or (BIN / name).is_file()
            or pathlib.Path(name).name in UTILITIES
            or name == "$REALTIME"
        ):
            needs.append(f"program {name}")

    for file in sorted(
        f
        for f in test.iterdir()
        if f.is_file() and f.name not in ("checkresult", "expected", "skip")
    ):
        text = file.read_text(errors="replace")
        first = text.split("\n", 1)[0]
        if file.suffix == ".hal":
            needs += [
                f"component {w}"
                for w in re.findall(r"^\s*loadrt\s+(\S+)", text, re.M)
                if w.replace("-", "_") not in components
                and not any((test / f"{w}{end}").is_file() for end in (".comp", ".c"))
            ]
            for name in re.findall(r"^\s*loadusr\s+(?:-Wn\s+\S+\s+|-\S+\s+)*(\S+)", text, re.M):
                program(name)
        elif file.suffix == ".py" or first.startswith("#!") and "python" in first:
            needs += [
                f"Python module {m}"
                for m in re.findall(r"^\s*(?:import|from)\s+(\w+)", text, re.M)
                if m in PYTHON
            ]
        elif file.suffix == ".sh" or first.startswith("#!") and "sh" in first:
            for name in shell_programs(text):
                program(name)
    # A skip that looks for LinuxCNC's own Tcl package does not concern a test that runs `halrun FILE.ini`.
    if (test / "skip").is_file() and not list(test.glob("*.ini")):
        asked = subprocess.run(
            ["bash", "skip"],
            cwd=test,
            env=CLEAN,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
        if asked.returncode != 0:
            needs.append(asked.stderr.strip().removeprefix("skip: "))
    return ", ".join(dict.fromkeys(needs))


def run(test, script):
    """True, or why it failed."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder, test.name)
        shutil.copytree(test, here)
        (here / "realtime.sh").write_text(REALTIME)
        (here / "realtime.sh").chmod(0o755)
        (here / "bin").mkdir(exist_ok=True)
        (here / "bin/realtime").symlink_to("../realtime.sh")  # a program in the PATH upstream
        environment = dict(
            CLEAN,
            PATH=f"{here}/bin:{CLEAN['PATH']}",
            HOME=folder,
            XDG_RUNTIME_DIR=folder,
            TOPDIR=str(ROOT),
            REALTIME=str(here / "realtime.sh"),
        )
        command = {"test.hal": ["halrun", "-f"], "test.sh": ["bash", "-x"], "test": []}[script]
        with open(here / "result", "wb") as out, open(here / "stderr", "wb") as err:
            try:
                status = subprocess.run(
                    command + [f"./{script}"],
                    cwd=here,
                    env=environment,
                    timeout=60,
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=err,
                ).returncode
            except subprocess.TimeoutExpired:
                return "still running after 60 s"
        if status != 0:
            output = (here / "stderr").read_text(errors="replace").strip().splitlines()
            return f"status {status}: {output[-1] if output else ''}"
        return judge(here, environment)


def judge(here, environment):
    """True, or why what the test has printed is wrong."""
    if (here / "checkresult").exists():
        # by a shell, because some have no first line that names theirs
        judged = subprocess.run(
            ["bash", "-c", '"$0" "$1"', str(here / "checkresult"), str(here / "result")],
            cwd=here,
            env=environment,
            timeout=60,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        return (
            True
            if judged.returncode == 0
            else "checkresult: " + judged.stdout.decode(errors="replace").strip()[-200:]
        )
    if (here / "expected").exists():
        wanted, got = ((here / name).read_text(errors="replace") for name in ("expected", "result"))
        if wanted == got:
            return True
        lines = zip(wanted.splitlines(), got.splitlines())
        first = next(((i, w, g) for i, (w, g) in enumerate(lines, 1) if w != g), None)
        return (
            f"line {first[0]} is '{first[2]}', expected '{first[1]}'"
            if first
            else "another number of lines"
        )
    return "no expected and no checkresult"


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    top = pathlib.Path(sys.argv[1]).resolve()
    listed = subprocess.run(
        [str(BIN / "hal"), "doc"], stdout=subprocess.PIPE, text=True, check=True
    ).stdout
    components = {
        line.split()[0].replace("-", "_") for line in listed.splitlines() if line.strip()
    } | {"threads"}
    passed, failed, needs = 0, 0, 0
    tests = {
        file.parent: file.name
        for name in reversed(SCRIPTS)
        for file in top.rglob(name)
        if file.is_file()
        and (name == "test.hal" or OF_HAL.search(file.read_text(errors="replace")))
    }
    for test, script in sorted(tests.items()):
        name = str(test.relative_to(top))
        if len(sys.argv) > 2 and not any(part in name for part in sys.argv[2:]):
            continue
        parts = missing_parts(test, components)
        if parts:
            needs += 1
            print(f"needs   {name}: {parts}", flush=True)
            continue
        verdict = run(test, script)
        passed, failed = passed + (verdict is True), failed + (verdict is not True)
        print(f"passed  {name}" if verdict is True else f"FAILED  {name}: {verdict}", flush=True)
    print(f"{passed} passed, {failed} failed, {needs} need unsupported parts")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
