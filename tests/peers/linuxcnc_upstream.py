#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the whole test folder of LinuxCNC with a LinuxCNC: linuxcnc_upstream.py TESTS_FOLDER [--with linuxcnc] [--home SOURCE] [NAME...]

TESTS_FOLDER is the `tests` folder of a LinuxCNC source tree that the user provides; nothing of it is part of this project. The tests run one after the
other in a copy, as an ordinary user. `halrun`, `halcmd`, `halcompile` and the others are ours, `linuxcnc` is `hal linuxcnc`, and `loadrt NAME` prefers
LinuxCNC's compiled module; with `--with linuxcnc` all programs are its own, as the control. LinuxCNC is the installed package or, with `--home`, a
source tree that was built in place; that tree must belong to the user, because halcompile installs into it. NAME is a part of a test's name.

For each class of tests it prints how many passed, failed and were skipped; for each failure the first difference. 77: the package is not installed.
A test ends after 150 s. LIMIT in the environment sets other seconds."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time

import linuxcnc_tests

BIN = linuxcnc_tests.BIN
LIMIT = float(os.environ.get("LIMIT", "150"))
CLASSES = ("whole machine", "HAL", "interpreter", "compiler", "other")
OVERRUNS = 10  # a netlist whose sampler has lost records is run again, as upstream's runner does
PROGRAMS = {
    "rtapi_app",
    "rtapi:0",
    "hal",
    "io",
    "iov2",
    "milltask",
    "linuxcncsvr",
    "halui",
    "motion-logger",
    "linuxcncrsh",
}
MARK = f"LINUXCNC_UPSTREAM={os.getpid()}"
LAUNCHER = """#!/bin/sh
[ "$1" != -r ] || shift
exec hal linuxcnc "$@"
"""


def class_of(file):
    """What the script starts decides."""
    if file.name == "test.hal":
        return "HAL"
    text = file.read_text(errors="replace")
    programs = {pathlib.Path(name).name for name in linuxcnc_tests.shell_programs(text)}
    if "python" in text.split("\n", 1)[0]:
        programs = set(re.findall(r"[\w-]+", text))
    if "linuxcnc" in programs or re.search(
        r"^\s*(?:if |exec )?linuxcnc\s+(?:-r\s+)?\S+\.ini", text, re.M
    ):
        return "whole machine"
    if programs & {"halcompile", "gcc", "g++", "gxx"}:
        return "compiler"
    if "rs274" in programs:
        return "interpreter"
    return (
        "HAL"
        if linuxcnc_tests.OF_HAL.search(text) or programs & {"hal", "haltcl", "mb2hal"}
        else "other"
    )


def processes_of_test():
    """Process ids: what a test has started and left behind, found by a variable of its environment or, where that is not readable, by its name."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if (
                int(folder.name) == os.getpid()
                or str(os.getuid())
                not in re.search(r"^Uid:(.*)", (folder / "status").read_text(), re.M)
                .group(1)
                .split()
            ):
                continue
            state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
            try:
                ours = MARK.encode() in (folder / "environ").read_bytes().split(b"\0")
            except PermissionError:  # set-uid
                ours = (folder / "comm").read_text().strip() in PROGRAMS
            if ours and state not in "ZX":
                found.append(int(folder.name))
        except (OSError, AttributeError):
            pass  # it has ended
    return found


def clean_up():
    """Ends the processes that a test has left behind, and removes its shared memory."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        for process in processes_of_test():
            try:
                os.kill(process, number)
            except OSError:
                pass
        end = time.monotonic() + 3
        while processes_of_test() and time.monotonic() < end:
            time.sleep(0.05)
    for line in pathlib.Path("/proc/sysvipc/shm").read_text().splitlines()[1:]:
        words = line.split()
        if int(words[6]) == 0 and int(words[7]) == os.getuid():  # nobody uses it
            subprocess.run(["ipcrm", "-m", words[1]], stderr=subprocess.DEVNULL, check=False)
    pathlib.Path(tempfile.gettempdir(), "linuxcnc.lock").unlink(missing_ok=True)


def environment_of(theirs, tools, home):
    name, value = MARK.split("=")
    libraries = sysconfig.get_config_vars()
    common = {
        name: value,
        "LC_ALL": "C",
        "LANGUAGES": "",
        "EMC2_HOME": "/usr",
        "SYSTEM_BUILD": "1",
        "HEADERS": "/usr/include/linuxcnc",
        "LIBDIR": "/usr/lib",
        "LINUXCNC_EMCSH": "wish",
        "PYTHON_CPPFLAGS": f"-I{libraries['INCLUDEPY']}",
        "USER": os.environ.get("USER", "user"),
        "PYTHON_LIBS": f"-lpython{libraries['py_version_short']}",
        "RUNTESTS": str(pathlib.Path(__file__).resolve()),
    }
    common["PYTHON_EXTRA_LIBS"] = common["PYTHON_LIBS"]
    if home:
        common |= in_place(home)
    if theirs and home:
        return common | {
            "PATH": f"{home}/bin:{home}/scripts:{home}/tcl:/usr/bin:/bin:/usr/sbin",
            "REALTIME": "realtime",
        }
    if theirs:
        return common | {
            "PATH": "/usr/bin:/bin:/usr/sbin",
            "REALTIME": "/usr/lib/linuxcnc/realtime",
        }
    tools.mkdir()
    for program, text in (("linuxcnc", LAUNCHER), ("realtime", linuxcnc_tests.REALTIME)):
        (tools / program).write_text(text)
        (tools / program).chmod(0o755)
    ours = common | {
        "PATH": f"{tools}:{BIN}:/usr/bin:/bin:/usr/sbin",
        "REALTIME": str(tools / "realtime"),
        "HALCYON_MODULES": "linuxcnc",
        "HAL_RTMOD_DIR": "/usr/lib/linuxcnc/modules",
        "PYTHONPATH": f"{linuxcnc_tests.MODULE}:/usr/lib/python3/dist-packages",
        "LD_LIBRARY_PATH": str(BIN.parent / "lib/halcyon/linuxcnc"),
    }
    if home:
        ours[
            "PATH"
        ] = f"{tools}:{BIN.parent}/lib/halcyon/linuxcnc/bin:{BIN}:{home}/bin:{home}/scripts:{home}/tcl:/usr/bin:/bin:/usr/sbin"
        ours |= {"HAL_RTMOD_DIR": f"{home}/rtlib", "LINUXCNC_HOME": str(home)}
        for name in ("PYTHONPATH", "LD_LIBRARY_PATH"):
            ours[name] = ours[name].split(":")[0] + ":" + common[name]
    return ours


def in_place(home):
    """What `. scripts/rip-environment` of a source tree sets."""
    return {
        "EMC2_HOME": str(home),
        "SYSTEM_BUILD": "",
        "HEADERS": f"{home}/include",
        "LIBDIR": f"{home}/lib",
        "LINUXCNC_RIP_FLAG": "True",
        "LINUXCNC_NCFILES_DIR": f"{home}/nc_files",
        "TCLLIBPATH": f"{home}/tcl",
        "LD_LIBRARY_PATH": f"{home}/lib",
        "PYTHONPATH": f"{home}/lib/python",
    }


def skipped(here, environment):
    """Why the test does not want to run, or an empty text."""
    skip = here / "skip"
    if not skip.exists():
        return ""
    if not os.access(skip, os.X_OK):
        return "disabled by its folder"
    asked = subprocess.run(
        [str(skip)],
        cwd=here,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return (
        ""
        if asked.returncode == 0
        else (asked.stderr + asked.stdout).strip().split("\n")[-1]
        or f"skip exited with {asked.returncode}"
    )


def start(here, script, environment):
    """The exit status, or None when the time was over."""
    command = {
        "test.hal": ["halrun", "-f", "test.hal"],
        "test.sh": ["bash", "-x", "test.sh"],
        "test": ["./test"],
    }[script]
    with open(here / "result", "wb") as out, open(here / "stderr", "wb") as err:
        # Not the folder of the first word in our own PATH: that of the test.
        process = subprocess.Popen(
            ["/usr/bin/env", *command],
            cwd=here,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            start_new_session=True,
        )
        try:
            return process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return None


def run(here, script, environment):
    """True, or why it failed."""
    for _ in range(OVERRUNS):
        status = start(here, script, environment)
        clean_up()
        if script != "test.hal" or not re.search(
            r"^overrun$", (here / "result").read_text(errors="replace"), re.M
        ):
            break
    if status is None:
        return f"still running after {LIMIT:.0f} s"
    if status != 0:
        lines = [
            line
            for line in (here / "stderr").read_text(errors="replace").splitlines()
            if line.strip() and not line.startswith("+")
        ]
        errors = [line for line in lines if re.search(r"\b(error|cannot)\b", line)] or lines[-1:]
        return f"exit status {status}: {errors[0].strip()[:200] if errors else 'no message'}"
    return linuxcnc_tests.judge(here, environment)


def copy_of(top, folder):
    """The folder, writable, and links to what is beside them in the source tree."""
    shutil.copytree(top, folder / top.name, symlinks=True)
    for beside in top.parent.iterdir():
        if beside != top:
            (folder / beside.name).symlink_to(beside)
    return folder / top.name


def take_home(words):
    """Removes `--home SOURCE` from the words; the folder, or None."""
    if "--home" not in words[:-1]:
        return None
    at = words.index("--home")
    home = pathlib.Path(words[at + 1]).resolve()
    del words[at : at + 2]
    return home


def missing_prerequisite(here, home):
    """Why a test does not apply to a source tree: what its configuration has not found; or an empty text."""
    wanted = here / "musthave"
    if not home or not wanted.exists():
        return ""
    has = (home / "src/config.h").read_text()
    missing = [
        name
        for name in wanted.read_text().split()
        if not re.search(rf"^#define HAVE_{name}", has, re.M)
    ]
    return f"LinuxCNC was built without {', '.join(missing)}" if missing else ""


def take_with(words):
    """Removes `--with linuxcnc` from the words; True if it was there."""
    theirs = "--with" in words and words[words.index("--with") + 1 :][:1] == ["linuxcnc"]
    if theirs:
        del words[words.index("--with") : words.index("--with") + 2]
    return theirs


def main():
    words = sys.argv[1:]
    theirs, home = take_with(words), take_home(words)
    if not words or words[0].startswith("-"):
        sys.exit(__doc__)
    if not shutil.which("milltask", path=f"{home}/bin" if home else "/usr/bin"):
        print("LinuxCNC is not installed: sudo apt-get install linuxcnc-uspace linuxcnc-uspace-dev")
        return 77
    if os.getuid() == 0:
        sys.exit("LinuxCNC rejects root; run this as an ordinary user")
    count = {kind: {"passed": 0, "FAILED": 0, "skipped": 0} for kind in CLASSES}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        top = copy_of(pathlib.Path(words[0]).resolve(), pathlib.Path(folder))
        common = environment_of(theirs, pathlib.Path(folder, ".tools"), home)
        own = pathlib.Path(
            folder, ".home"
        )  # one for all, as upstream: a display may read task's tools before task has made the file
        own.mkdir()
        files = sorted(
            file for name in linuxcnc_tests.SCRIPTS for file in top.rglob(name) if file.is_file()
        )
        for file in files:
            here, name = file.parent, str(file.parent.relative_to(top))
            if len(words) > 1 and not any(part in name for part in words[1:]):
                continue
            environment = common | {
                "HOME": str(own),
                "XDG_RUNTIME_DIR": str(own),
                "TEST_DIR": str(here),
                "USER_MODULE_DIR": str(here),
                "TOPDIR": str(top.parent),
                "PATH": f"{here}:{common['PATH']}",
            }
            if theirs and home:
                del environment[
                    "USER_MODULE_DIR"
                ]  # upstream's runner sets it for an installed package only
            kind, begin = class_of(file), time.monotonic()
            reason = missing_prerequisite(here, home) or skipped(here, environment)
            verdict = "skipped" if reason else run(here, file.name, environment)
            word = verdict if reason else "passed" if verdict is True else "FAILED"
            if word == "FAILED" and (here / "xfail").exists():
                word, reason = "skipped", f"fails, as its folder expects: {verdict}"
            elif word == "FAILED":
                reason = verdict
            count[kind][word] += 1
            print(
                f"{word} {name} ({kind}, {time.monotonic() - begin:.1f} s){': ' * bool(reason)}{reason}",
                flush=True,
            )
    for kind, row in count.items():
        print(f"{kind}: {row['passed']} passed, {row['FAILED']} failed, {row['skipped']} skipped")
    total = {
        word: sum(row[word] for row in count.values()) for word in ("passed", "FAILED", "skipped")
    }
    print(f"all: {total['passed']} passed, {total['FAILED']} failed, {total['skipped']} skipped")
    return 1 if total["FAILED"] else 0


if __name__ == "__main__":
    sys.exit(main())
