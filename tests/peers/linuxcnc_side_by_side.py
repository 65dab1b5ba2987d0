#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""linuxcnc_side_by_side.py HAL [USER] [--load]: the same machine and program under LinuxCNC's own launcher and under `hal linuxcnc`. Prints whether the
motion controller gives the same positions in each servo cycle, how regular its cycles are, the time until the display runs, and the memory. LinuxCNC
rejects root: USER runs it. --load: with a busy process for each CPU. 77: the package is not installed."""
import os
import pwd
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent / "side_by_side"
PROGRAMS = ("rtapi_app", "rtapi:0", "hal", "io", "milltask", "linuxcncsvr", "halui")


def memory():
    """Proportional resident memory of the machine's programs, MB."""
    total = 0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "comm").read_text().strip() in PROGRAMS or b"rtapi_app" in (
                process / "cmdline"
            ).read_bytes():
                total += sum(
                    int(line.split()[1])
                    for line in (process / "smaps_rollup").read_text().splitlines()
                    if line.startswith("Pss:")
                )
        except OSError:
            pass  # it has ended
    return total / 1024


def run(words, user, environment):
    """(positions of every cycle with motion, seconds until the display runs, MB, the periods of the servo thread in units of the clock it is measured with)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "machine"
        shutil.copytree(HERE, folder)
        if user:
            for path in (Path(name), folder, *folder.iterdir()):
                os.chown(path, user.pw_uid, user.pw_gid)
        begin = time.time()
        machine = subprocess.Popen(
            [*words, "machine.ini"],
            cwd=folder,
            env=environment,
            user=user and user.pw_uid,
            group=user and user.pw_gid,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        used = 0.0
        while machine.poll() is None:
            if (folder / "started.txt").exists():
                used = max(used, memory())
            time.sleep(0.2)
        output = machine.stdout.read()
        if machine.returncode != 0 or not (folder / "samples.txt").exists():
            sys.exit(f"{words[0]} failed:\n{output}")
        started = float((folder / "started.txt").read_text()) - begin
        rows = [line.split() for line in (folder / "samples.txt").read_text().splitlines()]
        if any(row[0] == "overrun" for row in rows):
            sys.exit(f"{words[0]}: the sampler lost records; run it on a quiet machine")
        positions = [tuple(row[1:4]) for row in rows if len(row) >= 4]
        periods = [int(row[4]) for row in rows[1:] if len(row) >= 5]
    moving = [position for before, position in zip(positions, positions[1:]) if position != before]
    return moving, started, used, periods


def regularity(periods):
    """How far periods are from the middle one, which is taken for a millisecond."""
    middle = sorted(periods)[len(periods) // 2]
    away = sorted(abs(period / middle - 1) * 1000 for period in periods)
    return (
        f"half of {len(away)} within {away[len(away) // 2]:.1f} us, 99 % within {away[len(away) * 99 // 100]:.0f} us, all within {away[-1]:.0f} us; "
        f"{sum(period > 1.5 * middle for period in periods)} longer than 1.5 ms"
    )


def main():
    hal = Path(sys.argv[1]).resolve()
    names = [word for word in sys.argv[2:] if word != "--load"]
    user = pwd.getpwnam(names[0]) if names else None
    if not shutil.which("milltask"):
        print("LinuxCNC is not installed: sudo apt-get install linuxcnc-uspace")
        sys.exit(77)
    if os.getuid() == 0 and not user:
        print("LinuxCNC rejects root; name a user who runs it")
        sys.exit(77)
    plain = {**os.environ, "HOME": user.pw_dir if user else os.environ["HOME"]}
    load = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"])
        for _ in range(os.cpu_count() if "--load" in sys.argv else 0)
    ]
    try:
        theirs, their_start, their_memory, their_periods = run(["linuxcnc", "-r"], user, plain)
        ours, our_start, our_memory, our_periods = run(
            [str(hal), "linuxcnc"], user, {**plain, "PATH": f"{hal.parent}:{plain['PATH']}"}
        )
    finally:
        for process in load:
            process.kill()
    differ = sum(a != b for a, b in zip(theirs, ours)) + abs(len(theirs) - len(ours))
    print(
        f"cycles with motion: LinuxCNC {len(theirs)}, Halcyon {len(ours)}; {differ} differ (6 decimals)"
    )
    print(f"periods, LinuxCNC: {regularity(their_periods)}")
    print(f"periods, Halcyon:  {regularity(our_periods)}")
    print(f"until the display runs: LinuxCNC {their_start:.2f} s, Halcyon {our_start:.2f} s")
    print(
        f"memory of the machine's programs: LinuxCNC {their_memory:.0f} MB, Halcyon {our_memory:.0f} MB"
    )
    sys.exit(0 if differ == 0 and theirs else 1)


if __name__ == "__main__":
    main()
