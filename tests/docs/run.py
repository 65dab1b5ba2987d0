#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs what the documents show.

In README.md and docs/**/*.md:
  ```hal file=NAME      the block is written to NAME; without file= it is given to `hal check`
  ```cpp file=NAME      written to NAME
  ```text file=NAME     written to NAME
  ```console            lines `$ COMMAND` are run in order, in one folder per document; the lines below a command are
                        its whole output, stdout and stderr together. No output lines: anything is accepted. The exit
                        status must be 0 unless the command ends in `# exit 1`.
  ```console figures    the same for output that was real when the page was written and contains times, counts or addresses: a
                        number, with its unit of time, stands for any number, the slowest function of a late cycle for any
                        function, and the width of columns is not compared.
                        The output of `hal sim` is compared as it is, because it is the same in each run, except its summary.
                        There are no placeholders: a command whose output is too long ends in `| head` or the like.
  `hal` in a command is the program under test. So is `./hal`, and such commands run in the repository's root. Nothing is skipped
but `./hal test` and `./hal bench`, which run this, and `./hal build`.
"""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
from own_network import own_network  # noqa: E402

HAL = pathlib.Path(os.environ.get("HAL_BIN", ROOT / "build/release/bin/hal")).resolve()
NOT_RUN = ("./hal test", "./hal bench", "./hal build")
FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```", re.M | re.S)


NUMBER = re.compile(
    r"(?<=cycle )\d+(?: \d{3})*|\b(?=\w*[a-f])(?=\w*\d)[0-9a-f]{8,}\b|"  # cycle 1 104; a token
    r"(?<![A-Za-z_])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?: ?(?:ns|us|ms|s|min)\b)?"
)


def matches(expected, actual, figures=False):
    """True when the lines agree; with `figures`, any number stands for any number."""

    def plain(line):
        if not figures:
            return line.rstrip()
        return re.sub(
            r"(of it #) in \S+", r"\1", " ".join(NUMBER.sub("#", line).replace("-#", "#").split())
        )

    return [plain(line) for line in expected] == [plain(line) for line in actual]


def is_exact(command, output):
    """True when the output of a command is the same in each run: `hal sim` without the summary, which has a time of this computer."""
    return re.match(r"hal sim\b", command) and not any(
        line.startswith("simulated ") for line in output
    )


def run(command, folder, environment):
    status = 0
    if "# exit " in command:
        command, _, code = command.partition("# exit ")
        status = int(code)
    command = command.strip()
    if command.startswith("./hal "):
        command, folder = str(HAL) + command[len("./hal") :], ROOT
    try:
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=120,
            text=True,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return False, "none: it still ran after 120 s", []
    return done.returncode == status, done.returncode, done.stdout.splitlines()


def check_console(text, where, folder, environment, figures):
    problems, commands = [], []
    for line in text.splitlines():
        if line.startswith("$ "):
            commands.append((line[2:], []))
        elif commands:
            commands[-1][1].append(line)
    for command, expected in commands:
        if command.startswith(NOT_RUN):
            continue
        good, status, actual = run(command, folder, environment)
        for lines in (expected, actual):
            while lines and not lines[-1].strip():
                lines.pop()
        if not good:
            problems.append(
                f"{where}: `{command}` ended with status {status}:\n" + "\n".join(actual)
            )
        elif expected and not matches(expected, actual, figures and not is_exact(command, actual)):
            problems.append(
                f"{where}: `{command}` printed\n"
                + "\n".join(actual)
                + "\n  where the document has\n"
                + "\n".join(expected)
            )
    return len(commands), problems


def end_what_was_left(home):
    """A page may leave a machine running in the background, as its reader would; known by its home folder."""
    mark = f"HOME={home}\0".encode()
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if mark in (entry / "environ").read_bytes() + b"\0":
                os.kill(int(entry.name), signal.SIGTERM)
        except OSError:
            pass  # ended by itself, or not ours


def check_document(path):
    text = path.read_text(encoding="utf-8")
    ran, problems = 0, []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        home = pathlib.Path(folder, ".home")
        environment = dict(
            os.environ,
            PATH=f"{HAL.parent}:{os.environ['PATH']}",
            NO_COLOR="1",
            HOME=str(home),
            XDG_RUNTIME_DIR=str(home),
            XDG_DATA_HOME=str(home),
            XDG_STATE_HOME=str(home),
            TERM="dumb",
        )
        home.mkdir(mode=0o700)
        for block in FENCE.finditer(text):
            language, options, body = block.groups()
            where = f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, block.start()) + 1}"
            name = re.search(r"file=(\S+)", options)
            if name:
                file = pathlib.Path(folder, name.group(1))
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(body, encoding="utf-8")
            elif language == "hal":
                pathlib.Path(folder, "block.hal").write_text(body, encoding="utf-8")
                good, status, actual = run("hal check block.hal", folder, environment)
                ran += 1
                if not good:
                    problems.append(f"{where}: hal check prints\n" + "\n".join(actual))
            elif language == "console":
                count, found = check_console(
                    body, where, folder, environment, "figures" in options.split()
                )
                ran += count
                problems += found
        end_what_was_left(home)
    return ran, problems


def main():
    chosen = [pathlib.Path(a).resolve() for a in sys.argv[1:]] or [
        ROOT / "README.md",
        *sorted((ROOT / "docs").rglob("*.md")),
    ]
    if any(
        "loadrt dds_" in path.read_text() or "HALCYON_DDS" in path.read_text() for path in chosen
    ):
        own_network()  # the pages' domains may be in use here
    total, failed = 0, 0
    for path in chosen:
        ran, problems = check_document(path)
        total += ran
        failed += len(problems)
        for problem in problems:
            print(problem + "\n")
    print(f"{total - failed} passed, {failed} failed")
    return 1 if failed or total == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
