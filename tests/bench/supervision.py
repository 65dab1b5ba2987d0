# SPDX-License-Identifier: MIT
"""Measures how soon a hung thread is made safe: supervision.py HAL [RUNS]. Prints figures without limits.

HAL is the program of a build tree that has the test components (`ninja cli_stall`). For each kind of hang: the time from the moment the
function hangs to the call of its component's emergency function, and the same in limits (default 100 ms).
"""
import ctypes
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

NETLIST = """newthread servo 1000000 {options}
loadrt stall names=s file=events.txt
addf s servo
"""
PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH = 0x4206, 0x4207, 17
LIMIT_MS = 100


def stop_thread(tid):
    """Stops one thread, as a debugger does; when that was, in ns of CLOCK_MONOTONIC."""
    libc = ctypes.CDLL(None)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    if libc.ptrace(PTRACE_SEIZE, tid, None, None) != 0:
        return None
    at = time.monotonic_ns()
    libc.ptrace(PTRACE_INTERRUPT, tid, None, None)
    os.waitpid(tid, 0x40000000)
    return at


def once(hal, options, how):
    """ms from the hang to the emergency call; None: not possible here."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "a.hal").write_text(NETLIST.format(options=options))
        environment = os.environ | {
            "XDG_RUNTIME_DIR": str(folder),
            "HALCYON_PLUGIN_PATH": str(hal.parent.parent / "tests" / "components"),
        }

        def shell(*words):
            return subprocess.run(
                [hal, "shell", *words], env=environment, capture_output=True, text=True, check=False
            ).stdout.strip()

        hung = tid = None
        machine = subprocess.Popen(
            [hal, "run", "a.hal"],
            cwd=folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            while shell("getp", "s.out") != "5":
                time.sleep(0.02)
            if how == "debugger":
                tid = next(
                    int(t.name)
                    for t in Path(f"/proc/{machine.pid}/task").iterdir()
                    if (t / "comm").read_text() == "servo\n"
                )
                if (hung := stop_thread(tid)) is None:
                    return None
            else:
                shell("setp", "s.mode", how)
            for _ in range(500):
                events = dict(
                    reversed(
                        [line.split() for line in (folder / "events.txt").read_text().splitlines()]
                    )
                )
                if "safe" in events:
                    return (int(events["safe"]) - (hung or int(events["hang"]))) / 1e6
                time.sleep(0.01)
            return float("inf")
        finally:
            if hung is not None:
                ctypes.CDLL(None).ptrace(
                    ctypes.c_long(PTRACE_DETACH), ctypes.c_long(tid), None, None
                )
            machine.kill()
            machine.wait()


def main():
    hal, runs = Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 10
    print(
        f"{'hang':32} {'min':>8} {'median':>8} {'max':>8} ms, {'max':>6} in limits of {LIMIT_MS} ms"
    )
    for what, options, how in (
        ("blocked in a system call", "", "1"),
        ("endless loop, SCHED_OTHER", "policy=other", "2"),
        ("endless loop, SCHED_FIFO", "", "2"),
        ("thread stopped by a debugger", "", "debugger"),
    ):
        times = [once(hal, options, how) for _ in range(runs)]
        if None in times:
            print(f"{what:32} not possible here")
            continue
        print(
            f"{what:32} {min(times):8.1f} {statistics.median(times):8.1f} {max(times):8.1f}     {max(times) / LIMIT_MS:6.2f}"
        )


if __name__ == "__main__":
    main()
