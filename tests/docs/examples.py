#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the examples of the components' manuals: examples.py [HAL] [COMPONENT...]

The indented lines of a component's text that are commands are its example. They run on the virtual clock for 20 cycles, behind the
threads they name; every component must have an example. A line `NAME.ENDING`: before indented lines makes them a file beside the example.
Prints which have none and which fail.
"""

import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
from own_network import own_network  # noqa: E402

COMMANDS = (
    "loadrt",
    "addf",
    "initf",
    "net",
    "setp",
    "sets",
    "newsig",
    "newthread",
    "linkps",
    "linksp",
    "linkpp",
    "alias",
    "unlinkp",
    "start",
)
PERIODS = {
    "base": 50_000,
    "fast": 100_000,
    "servo": 1_000_000,
    "slow": 10_000_000,
}  # by how the name begins; else as servo


def program(arguments):
    if arguments and Path(arguments[0]).name == "hal" and os.access(arguments[0], os.X_OK):
        return Path(arguments.pop(0)).resolve()
    return Path(os.environ.get("HAL_BIN", ROOT / "build/release/bin/hal")).resolve()


def run(hal, *words, folder=None):
    environment = {
        **os.environ,
        "NO_COLOR": "1",
        "HOME": str(folder or "/nonexistent"),
        "XDG_RUNTIME_DIR": str(folder or "/nonexistent"),
    }
    environment.pop("XDG_DATA_HOME", None)
    return subprocess.run(
        [str(hal), *map(str, words)],
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        timeout=float(os.environ.get("HALCYON_TEST_TIMEOUT", "60")),
    )


FILE = re.compile(r"^`([\w.-]+)`:\n\n((?:    .*\n|\n(?=    ))+)", re.MULTILINE)


def example_of(text):
    """The commands among the indented lines, continued ones too."""
    lines, goes_on = [], False
    for line in text.splitlines():
        if line.startswith("    ") and (
            goes_on or line.split()[:1] and line.split()[0] in COMMANDS
        ):
            lines.append(line.strip())
            goes_on = line.rstrip().endswith("\\")
        else:
            goes_on = False
    return lines if any(line.startswith("loadrt") for line in lines) else []


def files_of(text):
    """Name to content of the files that the text shows."""
    shown = FILE.findall(text)
    return {name: re.sub(r"^    ", "", content, flags=re.MULTILINE) for name, content in shown}


def period_of(thread):
    return next(
        (period for name, period in PERIODS.items() if thread.startswith(name)), PERIODS["servo"]
    )


def netlist(lines):
    made = {
        word.split("=")[1]
        for line in lines
        if line.startswith("loadrt threads")
        for word in line.split()
        if word.startswith("name")
    }
    made |= {line.split()[1] for line in lines if line.startswith("newthread")}
    used = []
    for line in lines:
        words = line.split()
        if words[0] in ("addf", "initf") and len(words) > 2:
            thread = words[2]  # behind --auto, too
            if thread not in made and thread not in used:
                used.append(thread)
    threads = [f"newthread {name} {period_of(name)}" for name in sorted(used, key=period_of)]
    if not threads and not made:
        threads = ["newthread servo 1000000"]
    return "\n".join(
        [*threads, *(line for line in lines if line != "start"), "start", "advance 20 cycles", ""]
    )


def check(hal, name):
    """None when the example runs; else why not."""
    manual = run(hal, "doc", name, "--markdown")
    if manual.returncode != 0:
        return manual.stderr.strip()
    if "A compiled module of LinuxCNC: " in manual.stdout:
        return None  # installed on this computer, with a manual of its own
    text = manual.stdout.partition("\n## Description\n")[2]
    lines = example_of(FILE.sub("", text))
    if not lines:
        return "it has no example"
    loads = [line.replace(" --native", "") for line in lines if line.startswith("loadrt")]
    loaded = [line.split()[1].replace("-", "_") for line in loads]
    family = name.replace("-", "_").split("_")[0]  # conv_bit_float and its kind share a text
    if not any(
        one == name.replace("-", "_") or family == "conv" and one.startswith("conv_")
        for one in loaded
    ):
        return "its example does not load it"
    with tempfile.TemporaryDirectory() as folder:
        for other, content in files_of(text).items():
            (Path(folder) / other).write_text(content)
        (Path(folder) / "example.hal").write_text(netlist(lines))
        done = run(hal, "sim", "example.hal", folder=folder)
        return (
            None
            if done.returncode == 0
            else f"exit status {done.returncode}\n{netlist(lines)}\n{done.stderr.strip()}"
        )


def main():
    if (
        own_network()
    ):  # the examples of DDS and of buses over UDP meet nobody else's; where it cannot be made they are on this machine's loopback
        subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
    arguments = sys.argv[1:]
    hal = program(arguments)
    names = arguments or [
        line.split()[0]
        for line in run(hal, "doc").stdout.splitlines()
        if line.split()[0] != "threads"
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = dict(zip(names, pool.map(lambda name: check(hal, name), names)))
    failed = {name: why for name, why in results.items() if why}
    for name, why in failed.items():
        print(f"FAILED {name}: {why}\n")
    print(
        f"{len(names) - len(failed)} of {len(names)} examples run"
        + (f"; not: {' '.join(failed)}" if failed else "")
    )
    return 1 if failed or not names else 0


if __name__ == "__main__":
    sys.exit(main())
