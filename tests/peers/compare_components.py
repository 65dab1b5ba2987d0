#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares Halcyon's pid, limit3, encoder, stepgen and pwmgen with LinuxCNC's own: compare_components.py SOURCE_FOLDER [NAME...]

SOURCE_FOLDER is `src/hal/components` of a LinuxCNC source tree that the user provides; it is not part of this project. Each component
is compiled unmodified with `hal compile` and runs in `hal sim` in the same netlist and with the same inputs as ours. Every output of
every cycle is compared to 1e-12 relative. Each line is one feature with its verdict: `equal`, or `differs` with the reason and, for each
pin, the number of cycles and the maximum difference. component_cases.py holds the expected differences: any other result is printed as
UNEXPECTED, and the exit status is 1. NAME is a component. HAL_BIN is the program; HALCYON_PLUGIN_PATH is the path of our components
where the program does not find them.
"""
import math
import os
import pathlib
import subprocess
import sys
import tempfile

from component_cases import CASES, N

ROOT = pathlib.Path(__file__).resolve().parents[2]
HAL = os.environ.get("HAL_BIN", str(ROOT / "build/release/bin/hal"))
OURS = os.environ.get("HALCYON_PLUGIN_PATH", "")
TOLERANCE = 1e-12

INSTANCE = {
    "pid": "pid.0",
    "limit3": "limit3.0",
    "encoder": "encoder.0",
    "stepgen": "stepgen.0",
    "pwmgen": "pwmgen.0",
}
FUNCTIONS = {
    "pid": ["pid.0.do-pid-calcs"],
    "limit3": ["limit3.0"],
    "encoder": ["encoder.update-counters", "encoder.capture-position"],
    "stepgen": ["stepgen.make-pulses", "stepgen.update-freq", "stepgen.capture-position"],
    "pwmgen": ["pwmgen.make-pulses", "pwmgen.update"],
}


def text(value):
    return str(int(value)) if isinstance(value, bool) else repr(value)


def letter(values):
    return "b" if isinstance(values[0], bool) else "f" if isinstance(values[0], float) else "s"


def netlist(row, data, csv):
    prefix, (fast, *rest) = INSTANCE[row.component] + ".", FUNCTIONS[row.component]
    cfg_in, cfg_out = "".join(letter(v) for v in row.inputs.values()), "".join(
        pin[0] for pin in row.outputs
    )
    lines = [
        "loadrt threads name1=t period1=1000000"
        + (" name2=slow period2=10000000" if row.slow else ""),
        f"loadrt {row.component} {row.arguments}",
        f"loadrt streamer depth={N + 10} cfg={cfg_in}",
        f"loadrt sampler depth={N + 10} cfg={cfg_out}",
        "addf streamer.0 t",
        f"addf {fast} t",
    ]
    lines += [f"addf {function} t" for function in rest if not row.slow] + ["addf sampler.0 t"]
    lines += [f"addf {function} slow" for function in rest if row.slow] + list(row.extra)
    lines += [f"net in-{i} streamer.0.pin.{i} => {prefix}{pin}" for i, pin in enumerate(row.inputs)]
    for i, pin in enumerate(row.outputs):  # a row with a plant already has the signal of its output
        signal = "effort" if row.extra and pin == "f:output" else f"out-{i}"
        lines.append(f"net {signal} {prefix}{pin[2:]} => sampler.0.pin.{i}")
    lines += [
        f"setp {prefix}{name} {value}"
        for name, value in row.settings.items()
        if name not in row.inputs
    ]
    lines += [
        f"loadusr -w {HAL} play {data}",
        "start",
        f"advance {N} cycles",
        f"loadusr -w {HAL} record --csv -n {N} 0 {csv}",
    ]
    return "\n".join(lines) + "\n"


def samples(row, first, folder, tag):
    """Returns rows of numbers, or an error message."""
    data, csv, file = (pathlib.Path(folder, tag + ending) for ending in (".in", ".csv", ".hal"))
    csv.unlink(missing_ok=True)
    data.write_text(
        "".join(
            " ".join(text(column[i]) for column in row.inputs.values()) + "\n" for i in range(N)
        )
    )
    file.write_text(netlist(row, data, csv))
    path = ":".join(part for part in (first, OURS) if part)
    done = subprocess.run(
        [HAL, "sim", str(file)],
        env=dict(os.environ, HALCYON_PLUGIN_PATH=path),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    )
    if done.returncode != 0 or not csv.exists():
        return (done.stdout.strip().splitlines() or ["no output"])[0]
    number = {"TRUE": 1.0, "FALSE": 0.0}
    return [  # without the time
        [number.get(v) if v in number else float(v) for v in line.split(",")[1:]]
        for line in csv.read_text().splitlines()[1:]
    ]


def states(rows):
    """Returns the sequence of output states, from the first with an active output."""
    changes = [row for row, before in zip(rows, [None] + rows) if row != before]
    return changes[next((i for i, row in enumerate(changes) if any(row)), 0) :]


def different(a, b):
    if math.isnan(a) or math.isnan(b):
        return math.isnan(a) != math.isnan(b)
    return a != b and abs(a - b) > TOLERANCE * max(abs(a), abs(b), 1.0)


def distance(a, b):
    return abs(a - b) if math.isfinite(a - b) else math.inf


def compare(row, folder):
    """Returns {pin: (number of differing cycles, maximum difference, first cycle, our and their value in it)}, or an error message."""
    ours, theirs = samples(row, "", folder, "ours"), samples(row, folder, folder, "theirs")
    for who, rows in (("ours", ours), ("LinuxCNC's", theirs)):
        if isinstance(rows, str):
            return f"{who}: {rows}"
        if len(rows) != N:
            return f"{who}: {len(rows)} samples"
    if row.in_order:
        ours, theirs = states(ours), states(theirs)
        if len(ours) != len(theirs) or len(ours) < 100:
            return f"{len(ours)} and {len(theirs)} states"
    found = {}
    for i, pin in enumerate(row.outputs):
        pairs = [
            (n, a[i], b[i])
            for n, (a, b) in enumerate(zip(ours[row.later :], theirs))
            if different(a[i], b[i])
        ]
        if pairs:
            found[pin[2:]] = (len(pairs), max(distance(a, b) for _, a, b in pairs), *pairs[0])
    return found


def verdict(row, found):
    """Returns the line to print, and whether the result is as expected."""
    if isinstance(found, str):
        return f"UNEXPECTED  {row.name}: {found}", False
    measured = "; ".join(
        f"{pin} in {cycles} cycles, at most {most:.3g}" for pin, (cycles, most, *_) in found.items()
    )
    if not found:
        return (
            (f"equal    {row.name}", True)
            if not row.reason
            else (f"UNEXPECTED  {row.name}: equal, but expected: {row.reason}", False)
        )
    beyond = [
        f"{pin} first in {n} ({a:.17g}, LinuxCNC's {b:.17g})"
        for pin, (cycles, most, n, a, b) in found.items()
        if cycles > row.bounds.get(pin, (0, 0))[0] or most > row.bounds[pin][1]
    ]
    if beyond:
        return f"UNEXPECTED  {row.name}: {measured}; {'; '.join(beyond)}", False
    return f"differs  {row.name}: {row.reason} [{measured}]", True


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    source, wanted = pathlib.Path(sys.argv[1]), sys.argv[2:] or list(INSTANCE)
    count = {"equal": 0, "differs": 0, "UNEXPECTED": 0}
    with tempfile.TemporaryDirectory() as folder:
        for name in wanted:
            file = next(
                (f for f in (source / f"{name}.c", source / f"{name}.comp") if f.exists()), None
            )
            if name not in CASES:
                sys.exit(f"unknown component '{name}'; use one of {', '.join(CASES)}")
            if file is None:
                sys.exit(
                    f"{source}: missing {name}.c or {name}.comp; pass src/hal/components of a LinuxCNC source tree"
                )
            done = subprocess.run(
                [HAL, "compile", "--output", folder, str(file)],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                check=False,
            )
            if done.returncode != 0:
                sys.exit(done.stdout)
            print(f"{name}:")
            for row in CASES[name]():
                line, _ = verdict(row, compare(row, folder))
                count[line.split()[0]] += 1
                print("  " + line, flush=True)
    print(
        f"{count['equal']} equal, {count['differs']} differ as expected, {count['UNEXPECTED']} unexpected"
    )
    return 1 if count["UNEXPECTED"] else 0


sys.exit(main())
