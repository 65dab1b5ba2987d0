#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the simulated machines of LinuxCNC without a window: linuxcnc_sim_sweep.py CONFIGS_FOLDER [--with linuxcnc] [--home SOURCE] [--part N/OF] [NAME...]

CONFIGS_FOLDER is the `configs` folder of a LinuxCNC source tree that the user provides; nothing of it is part of this project. Each INI file below its
folder `sim` runs in a copy under `hal linuxcnc` (or LinuxCNC's own launcher), as an ordinary user. The display is sim_sweep/display.py; what belongs to
a display (`POSTGUI_HALFILE`, panels, `[APPLICATIONS]`) is left out, a tool change is confirmed at once, and 3D models have their pins but no window.
`--home` names a source tree that was built in place, in the place of the package. NAME is a part of a path.

For each configuration it prints how far it came: started, homed, moved, ran a program, ended in order (all its programs); or the first error. 77: the
package is not installed."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import linuxcnc_upstream

HERE = pathlib.Path(__file__).resolve().parent / "sim_sweep"
STEPS = ("started", "homed", "moved", "program")
OF_DISPLAY = re.compile(
    r"\s*(POSTGUI_HALFILE|POSTGUI_HALCMD|PYVCP|GLADEVCP|EMBED_TAB_\w+|INTRO_GRAPHIC|APP|USER_COMMAND_FILE)\s*=",
    re.I,
)
MACHINE = re.compile(
    r"^\s*DISPLAY\s*=|^#INCLUDE\s", re.M
)  # the display may be in an included file; other INI files are settings of programs
NO_WINDOW = (
    "sim_pin",
    "halshow",
    "halscope",
    "halmeter",
)  # loaded by netlists without a pin of their own


def without_windows(text):
    """The text of an INI file or of an included part of one."""
    lines, section, dropped = [], "", False
    for line in text.splitlines():
        if dropped:  # the rest of a value over several lines
            dropped = line.rstrip().endswith("\\")
            continue
        if found := re.match(r"\s*\[(\w+)\]", line):
            section = found.group(1)
        if OF_DISPLAY.match(line):
            dropped = line.rstrip().endswith("\\")
        elif section == "DISPLAY" and re.match(r"\s*DISPLAY\s*=", line):
            lines.append(f"DISPLAY = {HERE / 'display.py'}")
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"


def copy_of(top, folder):
    configs = linuxcnc_upstream.copy_of(top, folder)
    for file in [*configs.rglob("*.ini"), *configs.rglob("*.inc"), *configs.rglob("*.txt")]:
        if file.is_file() and not file.is_symlink():
            text = file.read_text(encoding="utf-8", errors="surrogateescape")
            if file.suffix == ".ini" or re.search(r"^\[\w+\]", text, re.M):
                file.write_text(without_windows(text), encoding="utf-8", errors="surrogateescape")
    for place in {file.parent for file in configs.rglob("*.ini")}:
        (place / "bin").mkdir(exist_ok=True)
        shutil.copy(HERE / "hal_manualtoolchange", place / "bin")
        for name in NO_WINDOW:
            (place / "bin" / name).symlink_to("/bin/true")
    return configs


def first_error(output):
    """The line that names the problem, of all that was printed."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    for pattern in (
        r"(fault: .*hung-thread.*)",
        r"^sweep: not (.*)",
        r".*(\berror:.*)",
        r"(.*\b(?:error|cannot|failed|Traceback|No such|not found|[Mm]issing)\b.*)",
    ):
        for line in lines:
            if (found := re.match(pattern, line)) and "Can not find -sec" not in line:
                return found.group(1)[:220]
    return lines[-1][:220] if lines else "no output"


def run(ini, command, environment):
    """(the steps that succeeded, an error or an empty text)"""
    output = ini.with_suffix(".sweep-output")
    with open(output, "wb") as out:
        machine = subprocess.Popen(
            [*command, str(ini)],
            cwd=ini.parent,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            status = machine.wait(linuxcnc_upstream.LIMIT)
        except subprocess.TimeoutExpired:
            os.killpg(machine.pid, signal.SIGKILL)
            machine.wait()
            status = None
    left = (
        [
            pathlib.Path(f"/proc/{process}/comm").read_text().strip()
            for process in linuxcnc_upstream.processes_of_test()
            if pathlib.Path(f"/proc/{process}/comm").exists()
        ]
        if status is not None
        else []
    )
    linuxcnc_upstream.clean_up()
    text = output.read_text(errors="replace")
    steps = [step for step in STEPS if f"sweep: {step}\n" in text]
    if status is None:
        return steps, f"still running after {linuxcnc_upstream.LIMIT:.0f} s: {first_error(text)}"
    if status != 0 or len(steps) < len(STEPS):
        return steps, f"exit status {status}: {first_error(text)}"
    return (steps, f"left running: {' '.join(left)}") if left else ([*steps, "ended"], "")


def main():
    words = sys.argv[1:]
    theirs, source = linuxcnc_upstream.take_with(words), linuxcnc_upstream.take_home(words)
    part, parts = 0, 1
    if "--part" in words:
        part, parts = (int(number) for number in words[words.index("--part") + 1].split("/"))
        del words[words.index("--part") : words.index("--part") + 2]
    if not words or words[0].startswith("-"):
        sys.exit(__doc__)
    if not shutil.which("milltask", path=f"{source}/bin" if source else "/usr/bin"):
        print("LinuxCNC is not installed: sudo apt-get install linuxcnc-uspace")
        return 77
    if os.getuid() == 0:
        sys.exit("LinuxCNC rejects root; run this as an ordinary user")
    count = dict.fromkeys([*STEPS, "ended"], 0)
    number = 0
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        configs = copy_of(pathlib.Path(words[0]).resolve(), pathlib.Path(folder))
        common = linuxcnc_upstream.environment_of(theirs, pathlib.Path(folder, ".tools"), source)
        common["PYTHONPATH"] = f"{HERE}:{common.get('PYTHONPATH', '')}".rstrip(":")
        command = (
            [f"{source}/scripts/linuxcnc" if source else "/usr/bin/linuxcnc", "-r"]
            if theirs
            else ["/usr/bin/env", "hal", "linuxcnc"]
        )
        files = sorted(
            file
            for file in (configs / "sim").rglob("*.ini")
            if MACHINE.search(file.read_text(errors="replace"))
        )
        for at, file in enumerate(files):
            name = str(file.relative_to(configs / "sim"))
            if (
                len(words) > 1
                and not any(wanted in name for wanted in words[1:])
                or at % parts != part % parts
            ):
                continue
            home = pathlib.Path(folder, ".home")
            shutil.rmtree(home, ignore_errors=True)
            home.mkdir()
            begin = time.monotonic()
            steps, problem = run(
                file, command, common | {"HOME": str(home), "XDG_RUNTIME_DIR": str(home)}
            )
            number += 1
            for step in steps:
                count[step] += 1
            print(
                f"{'FAILED' if problem else 'passed'} {name} ({time.monotonic() - begin:.1f} s): {problem or ', '.join(steps)}"
                + (f" (after: {', '.join(steps)})" if problem and steps else ""),
                flush=True,
            )
    print(f"{number} configurations; " + ", ".join(f"{step} {of}" for step, of in count.items()))
    return 0 if count["ended"] == number else 1


if __name__ == "__main__":
    sys.exit(main())
