#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The display: homes, runs the program, and records each servo cycle in samples.txt; started.txt has the time when it was ready."""
import signal
import subprocess
import sys
import time

import linuxcnc

command, status = linuxcnc.command(), linuxcnc.stat()


def wait(condition, seconds=60):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        status.poll()
        if condition():
            return
        time.sleep(0.01)
    sys.exit("drive: it takes too long")


with open("started.txt", "w", encoding="utf-8") as file:
    file.write(f"{time.time()}\n")
command.state(linuxcnc.STATE_ESTOP_RESET)
command.wait_complete()
command.state(linuxcnc.STATE_ON)
wait(lambda: status.task_state == linuxcnc.STATE_ON)
command.home(-1)
wait(lambda: all(status.homed[:3]))
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.program_open("program.ngc")
with open("samples.txt", "w", encoding="utf-8") as file:
    sampler = subprocess.Popen(["halsampler", "-t"], stdout=file)
    time.sleep(0.5)
    command.auto(linuxcnc.AUTO_RUN, 0)
    wait(lambda: status.interp_state != linuxcnc.INTERP_IDLE)
    wait(lambda: status.interp_state == linuxcnc.INTERP_IDLE)
    time.sleep(0.5)
    sampler.send_signal(signal.SIGINT)
    sampler.wait()
