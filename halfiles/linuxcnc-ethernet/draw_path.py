#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""draw_path.py PATH.csv PICTURE: the path of X and Y that was driven, with the following error as colour, and the error of each axis over time."""
import csv
import sys

AXES = "XYZAC"


def read(path):
    """Per axis the rows of command and feedback, ms apart; and the times."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    time_key = next(key for key in rows[0] if key.startswith("time"))
    rows = [
        row
        for row in rows
        if all(
            row[f"joint.{joint}.motor-pos-{end}"]
            for joint in range(len(AXES))
            for end in ("cmd", "fb")
        )
    ]
    times = [float(row[time_key]) for row in rows]
    times = [time - times[0] for time in times]
    pairs = {
        axis: [
            (float(row[f"joint.{joint}.motor-pos-cmd"]), float(row[f"joint.{joint}.motor-pos-fb"]))
            for row in rows
        ]
        for joint, axis in enumerate(AXES)
    }
    return times, pairs


def main():
    source, target = sys.argv[1:3]
    times, pairs = read(source)
    # the feedback of a cycle belongs to the command of two cycles before: it has crossed the segment twice
    late = 2
    errors = {
        axis: [command - feedback for (command, _), (_, feedback) in zip(values, values[late:])]
        for axis, values in pairs.items()
    }
    for axis, values in errors.items():
        print(
            f"{axis}: following error {max(map(abs, values)):.3f} {'mm' if axis in 'XYZ' else 'degrees'} at most",
            flush=True,
        )
    try:
        import matplotlib

        matplotlib.use("agg")
        from matplotlib import collections, pyplot
    except ImportError:
        print("no picture: it needs matplotlib (sudo apt-get install python3-matplotlib)")
        return
    figure, (path, over_time) = pyplot.subplots(
        1, 2, figsize=(12, 5.5), gridspec_kw={"width_ratios": [1, 1.2]}
    )
    points = [(x, y) for (_, x), (_, y) in zip(pairs["X"][late:], pairs["Y"][late:])]
    size = [(x * x + y * y) ** 0.5 for x, y in zip(errors["X"], errors["Y"])]
    step = max(1, len(points) // 4000)
    kept = points[::step]
    lines = collections.LineCollection(
        list(zip(kept, kept[1:])), array=size[::step][1:], cmap="viridis", linewidths=1.6
    )
    path.add_collection(lines)
    path.set_aspect("equal")
    path.autoscale()
    path.set_xlabel("X (mm)")
    path.set_ylabel("Y (mm)")
    figure.colorbar(lines, ax=path, label="following error (mm)")
    for axis, values in errors.items():
        over_time.plot(times[: len(values) : step], values[::step], label=axis, linewidth=0.8)
    over_time.set_xlabel("time (s)")
    over_time.set_ylabel("following error (mm, degrees)")
    over_time.legend(loc="upper center", ncols=5)
    figure.tight_layout()
    figure.savefig(target, dpi=110)
    print(f"the path is drawn in {target}")


if __name__ == "__main__":
    main()
