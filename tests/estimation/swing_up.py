#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""swing_up.py HAL [RUNS [NETLIST]] [--off PERCENT]: halfiles/furuta/swing-up.hal, or another netlist of that rig, from random starts, and
again after random pushes. --off: ten parameters of the rig differ at random from those of the controller, each by up to so much.

Each run is a machine of its own on the virtual clock, with the rig's encoders of 2000 counts, its 4 A and its radio, camera or wire. Before the motor
may move the pendulum is pushed at random (up to 2 m/s: it may turn over), which is the start; later it is pushed once more (0.2 to 1 m/s).
After each it must be upright, to stay, in less than 5 s (with --off: 9 s), and the base must not leave the table.
"""
import argparse
import random
import subprocess
import sys
import tempfile
from pathlib import Path

HALFILES = Path(__file__).resolve().parents[2] / "halfiles"
LIMIT, LIMIT_OFF, UPRIGHT, STEP = 5.0, 9.0, 0.15, 0.05  # s, s with other parameters, rad, s
PARAMETERS = {
    "torque-constant": 0.0677,
    "resistance": 0.68,
    "arm-length": 0.2,
    "arm-mass": 0.2,
    "arm-viscous": 5e-4,
    "arm-coulomb": 0.008,
    "pendulum-mass": 0.1,
    "pendulum-centre": 0.15,
    "pendulum-inertia": 7.5e-4,
    "pendulum-viscous": 2e-4,
}


def script(netlist, start, push, rig_values, limit):
    text = netlist.read_text()
    rig, angle, base = (
        ("canopen-axis-io.0", "second-position", "canopen.0.rig.base-down")
        if "canopen_axis_io" in text
        else ("furuta", "pendulum-angle", "furuta.base-down")
    )
    look = f"advance {round(STEP * 1000)}ms\ngetp {rig}.{angle}\n" * round((limit + 1) / STEP)
    edges = "getp pendulum-encoder.quad-errors\n" if "pendulum-encoder" in text else ""
    others = "".join(f"setp {rig}.{name} {value:g}\n" for name, value in rig_values)
    return f"source {netlist}\n{others}setp {rig}.push {start}\n{look}setp {rig}.push {push}\n{look}getp {base}\n{edges}"


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
    arguments = argparse.ArgumentParser()
    arguments.add_argument("hal")
    arguments.add_argument("runs", nargs="?", type=int, default=20)
    arguments.add_argument(
        "netlist", nargs="?", type=Path, default=HALFILES / "furuta/swing-up.hal"
    )
    arguments.add_argument("--off", type=float, default=0.0, metavar="PERCENT")
    arguments.add_argument(
        "--least", type=int, help="exit status 0 with at least so many good runs (default: all)"
    )
    given = arguments.parse_args()
    limit = LIMIT_OFF if given.off else LIMIT
    hal, runs, netlist = given.hal, given.runs, given.netlist.resolve()
    chance = random.Random(1)
    good, needed = 0, ([], [])
    for _ in range(runs):
        start, push = chance.uniform(-2, 2), chance.choice((-1, 1)) * chance.uniform(0.2, 1)
        rig_values = (
            [
                (name, value * (1 + chance.uniform(-1, 1) * given.off / 100))
                for name, value in PARAMETERS.items()
            ]
            if given.off
            else []
        )
        with tempfile.NamedTemporaryFile("w", suffix=".hal") as file:
            file.write(script(netlist, start, push, rig_values, limit))
            file.flush()
            done = subprocess.run(
                [hal, "sim", file.name], capture_output=True, text=True, timeout=600, check=False
            )
        lines = done.stdout.split()
        looks = round((limit + 1) / STEP)
        if done.returncode != 0 or len(lines) <= 2 * looks:
            sys.exit(f"hal sim: {done.stderr}")
        angles, (base_down, *lost) = [float(a) for a in lines[: 2 * looks]], lines[2 * looks :]
        times = [time_to_stay(part) for part in (angles[:looks], angles[looks:])]
        fine = (
            all(t is not None and t < limit for t in times)
            and base_down == "TRUE"
            and lost in ([], ["0"])
        )
        good += fine
        for list_, t in zip(needed, times):
            list_.append(float("inf") if t is None else t)
        words = ["not upright" if t is None else f"{t:.2f} s" for t in times]
        print(
            f"start {start:+.2f} m/s: {words[0]}; push {push:+.2f} m/s: {words[1]}{'' if fine else '   FAILED'}{'' if base_down == 'TRUE' else ', base off the table'}"
        )
    for what, times in zip(("starts", "pushes"), needed):
        times.sort()
        print(
            f"{what}: fastest {times[0]:.2f} s, half in {times[runs // 2]:.2f} s, 9 of 10 in {times[(runs - 1) * 9 // 10]:.2f} s, slowest {times[-1]:.2f} s"
        )
    print(f"{good} of {runs} upright in less than {limit:g} s")
    return 0 if good >= (runs if given.least is None else given.least) else 1


if __name__ == "__main__":
    sys.exit(main())
