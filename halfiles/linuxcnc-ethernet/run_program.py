#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A display without a window: switches the machine on, homes it, runs the program (default program.ngc), and draws the path that was driven.

The path is written to the folder $PATH_FOLDER, by default `driven` in the folder where `hal linuxcnc` was typed.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import linuxcnc  # LinuxCNC's Python module

HERE = Path(__file__).resolve().parent
# hal linuxcnc runs its programs in the folder of the INI file, and PWD remains that of the shell.
OUT = Path(os.environ.get("PATH_FOLDER") or Path(os.environ.get("PWD", "."), "driven"))
AXES = "xyzac"

command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()


def messages():
    found = []
    while (message := errors.poll()) is not None:
        found.append(message[1])
    return found


def wait(what, condition, seconds=float("inf")):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        status.poll()
        if condition():
            return
        time.sleep(0.01)
    sys.exit(
        f"run_program: {what}: not within {seconds} s; "
        + ("; ".join(messages()) or "LinuxCNC gives no reason")
    )


def counts():
    """Cycles of the servo thread so far, and how many of them it missed."""
    return [
        int(
            subprocess.run(
                ["hal", "shell", "getp", f"servo-thread.{pin}"],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for pin in ("threadbeat", "missed")
    ]


def main():
    arguments = [word for word in sys.argv[1:] if word.endswith(".ngc")]
    program = Path(arguments[0] if arguments else HERE / "program.ngc").resolve()
    try:
        OUT.mkdir(parents=True, exist_ok=True)
        (OUT / "path.csv").open("a", encoding="utf-8").close()
    except OSError as error:
        sys.exit(f"run_program: {error.filename}: {error.strerror}; set PATH_FOLDER=FOLDER")

    # the nodes of the bus come first: a reset without them has no effect
    for _ in range(300):
        command.state(linuxcnc.STATE_ESTOP_RESET)
        time.sleep(0.1)
        status.poll()
        if status.task_state == linuxcnc.STATE_ESTOP_RESET:
            break
    command.state(linuxcnc.STATE_ON)
    wait("machine on", lambda: status.task_state == linuxcnc.STATE_ON, 5)
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.home(-1)
    wait("homing", lambda: all(status.homed[: len(AXES)]), 10)
    print("homed; running " + program.name, flush=True)

    values = [
        f"joint.{joint}.motor-pos-{end}" for joint in range(len(AXES)) for end in ("cmd", "fb")
    ] + ["motion.in-position"]
    record = subprocess.Popen(
        ["hal", "record", OUT / "path.csv", *values], stdout=subprocess.DEVNULL
    )
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(str(program))
    before = counts()
    begin = time.monotonic()
    command.auto(linuxcnc.AUTO_RUN, 0)
    wait("start of the program", lambda: status.interp_state != linuxcnc.INTERP_IDLE, 5)
    wait(
        "end of the program",
        lambda: status.interp_state == linuxcnc.INTERP_IDLE
        or status.task_state != linuxcnc.STATE_ON,
    )
    seconds = time.monotonic() - begin
    failed = messages()
    if status.task_state != linuxcnc.STATE_ON:
        failed.insert(0, "the machine went off")
    record.send_signal(signal.SIGINT)
    if record.wait() != 0:
        failed.append("hal record failed")
    if failed:
        sys.exit("run_program: " + "; ".join(failed))
    cycles, missed = (after - start for after, start in zip(counts(), before))
    print(
        f"{program.name} took {seconds:.1f} s; of {cycles + missed} cycles of the servo thread {missed} were missed",
        flush=True,
    )
    subprocess.run(
        [sys.executable, HERE / "draw_path.py", OUT / "path.csv", OUT / "path.png"], check=True
    )


if __name__ == "__main__":
    main()
