#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""swing_up.py HAL [RUNS]: halfiles/furuta/swing-up.hal from random starts, and again after random pushes.

Each run is a machine of its own on the virtual clock, with the rig's encoders of 2000 counts, its 4 A and its radio. Before the motor may move the pendulum
is pushed at random (up to 2 m/s: it may turn over), which is the start; later it is pushed once more (0.2 to 1 m/s). After each it must be
upright, to stay, in less than 5 s, and the base must not leave the table.
"""
import random
import subprocess
import sys
import tempfile
from pathlib import Path

NETLIST = Path(__file__).resolve().parents[2] / "halfiles/furuta/swing-up.hal"
LIMIT, UPRIGHT, STEP = 5.0, 0.15, 0.05  # s, rad, s


def script(start, push):
    look = f"advance {round(STEP * 1000)}ms\ngetp furuta.pendulum-angle\n" * round((LIMIT + 1) / STEP)
    return f"source {NETLIST}\nsetp furuta.push {start}\n{look}setp furuta.push {push}\n{look}getp furuta.base-down\ngetp pendulum-encoder.quad-errors\n"


def time_to_stay(angles):
    """From when on the pendulum was upright, s; None: it was not at the end."""
    turn = 6.283185307179586
    off = [abs((a + turn / 2) % turn - 0) for a in angles]
    off = [min(o, turn - o) for o in off]
    for i in range(len(off) - 1, -1, -1):
        if off[i] > UPRIGHT:
            return None if i == len(off) - 1 else (i + 2) * STEP
    return STEP


def main():
    hal, runs = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20
    chance = random.Random(1)
    good, slowest = 0, 0.0
    for run in range(runs):
        start, push = chance.uniform(-2, 2), chance.choice((-1, 1)) * chance.uniform(0.2, 1)
        with tempfile.NamedTemporaryFile("w", suffix=".hal") as file:
            file.write(script(start, push))
            file.flush()
            done = subprocess.run([hal, "sim", file.name], capture_output=True, text=True, timeout=120, check=False)
        lines = done.stdout.split()
        if done.returncode != 0 or len(lines) < 3:
            sys.exit(f"hal sim: {done.stderr}")
        *angles, base_down, lost = lines
        half = len(angles) // 2
        times = [time_to_stay([float(a) for a in part]) for part in (angles[:half], angles[half:])]
        fine = all(t is not None and t < LIMIT for t in times) and base_down == "TRUE" and lost == "0"
        good += fine
        slowest = max([slowest] + [t for t in times if t is not None])
        words = ["not upright" if t is None else f"{t:.2f} s" for t in times]
        print(f"start {start:+.2f} m/s: {words[0]}; push {push:+.2f} m/s: {words[1]}{'' if fine else '   FAILED'}{'' if base_down == 'TRUE' else ', base off the table'}")
    print(f"{good} of {runs} upright in less than {LIMIT:g} s, the slowest in {slowest:.2f} s")
    return 0 if good == runs else 1


if __name__ == "__main__":
    sys.exit(main())
