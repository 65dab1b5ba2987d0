# SPDX-License-Identifier: MIT
"""Plots for the machines whose pictures are computed from a simulation: axes, curves, floors, as SVG. Nothing here depends on time or machine."""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.sax.saxutils import escape

INK, GREY, GRID = "#24292f", "#6e7781", "#e4e8ec"
COLOURS = ("#c2410c", "#1d4ed8", "#15803d", "#7e22ce", "#b45309", "#0e7490")


def number(value):
    """A coordinate: two decimals at most."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


class Picture:
    """An SVG file, built from the back to the front. It is shown `scale` times as large as its coordinates."""

    def __init__(self, width, height, title, scale=1):
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width * scale}" height="{height * scale}" '
            'font-family="system-ui, sans-serif" font-size="13">',
            f"<title>{escape(title)}</title>",
            f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        ]

    def line(self, points, colour=INK, width=1.5, dash="", opacity=1.0):
        path = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        extra = (f' stroke-dasharray="{dash}"' if dash else "") + (
            f' stroke-opacity="{opacity:g}"' if opacity != 1 else ""
        )
        self.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" stroke-linejoin="round"{extra}/>'
        )

    def polygon(self, points, colour, opacity):
        path = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        self.parts.append(f'<polygon points="{path}" fill="{colour}" fill-opacity="{opacity:g}"/>')

    def circle(self, x, y, radius, fill="none", stroke="none", width=1.5):
        self.parts.append(
            f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(radius)}" fill="{fill}" stroke="{stroke}" stroke-width="{width:g}"/>'
        )

    def text(self, x, y, words, anchor="start", colour=INK, size=13, turn=0, weight=""):
        rotated = f' transform="rotate({turn} {number(x)} {number(y)})"' if turn else ""
        bold = f' font-weight="{weight}"' if weight else ""
        self.parts.append(
            f'<text x="{number(x)}" y="{number(y)}" text-anchor="{anchor}" fill="{colour}" font-size="{size}"{bold}{rotated}>{escape(words)}</text>'
        )

    def write(self, path):
        path.write_text("\n".join(self.parts) + "\n</svg>\n", encoding="utf-8")


class Axes:
    """A rectangle of a picture with scales: x and y are (from, to), ticks are lists of values."""

    def __init__(
        self,
        picture,
        left,
        top,
        width,
        height,
        x,
        y,
        x_ticks,
        y_ticks,
        x_name="",
        y_name="",
        form="{:g}",
    ):
        self.picture, self.left, self.top, self.width, self.height, self.x, self.y = (
            picture,
            left,
            top,
            width,
            height,
            x,
            y,
        )
        for tick in x_ticks:
            at = self.place(tick, y[0])[0]
            picture.line([(at, top), (at, top + height)], GRID, 1)
            picture.text(at, top + height + 18, form.format(tick), "middle", GREY, 12)
        for tick in y_ticks:
            at = self.place(x[0], tick)[1]
            picture.line([(left, at), (left + width, at)], GRID, 1)
            picture.text(left - 8, at + 4, form.format(tick), "end", GREY, 12)
        picture.line([(left, top), (left, top + height), (left + width, top + height)], INK, 1.2)
        picture.text(left + width / 2, top + height + 38, x_name, "middle")
        if y_name:
            picture.text(left - 44, top + height / 2, y_name, "middle", turn=-90)

    def place(self, x, y):
        return (
            self.left + (x - self.x[0]) / (self.x[1] - self.x[0]) * self.width,
            self.top + self.height - (y - self.y[0]) / (self.y[1] - self.y[0]) * self.height,
        )

    def curve(self, points, colour, width=2.0, dash="", opacity=1.0, dots=False):
        placed = [self.place(x, min(max(y, self.y[0]), self.y[1])) for x, y in points]
        self.picture.line(placed, colour, width, dash, opacity)
        for x, y in placed if dots else ():
            self.picture.circle(x, y, 3, colour)

    def band(self, points, colour, opacity=0.12):
        """points: (x, lower, upper)."""
        self.picture.polygon(
            [self.place(x, low) for x, low, _ in points]
            + [self.place(x, high) for x, _, high in reversed(points)],
            colour,
            opacity,
        )


def floor(axes, path):
    """Draws a floor plan: the lines of the file `floor=` of the simulated robots and sensors. The axes must have equal scales."""
    scale = axes.width / (axes.x[1] - axes.x[0])
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split("#")[0].split()
        if not words:
            continue
        n = [float(word) for word in words[1:]]
        if words[0] == "wall":
            axes.picture.line([axes.place(n[0], n[1]), axes.place(n[2], n[3])], INK, 2.5)
        elif words[0] == "box":
            corners = [axes.place(n[i], n[j]) for i, j in ((0, 1), (2, 1), (2, 3), (0, 3), (0, 1))]
            outer = (n[2] - n[0]) * (n[3] - n[1]) > 0.5 * (axes.x[1] - axes.x[0]) * (
                axes.y[1] - axes.y[0]
            )
            if not outer:
                axes.picture.polygon(corners, GREY, 0.35)
            axes.picture.line(corners, INK, 2.5 if outer else 1.2)
        else:
            x, y = axes.place(n[0], n[1])
            beacon = words[0] == "beacon"
            axes.picture.circle(x, y, n[2] * scale, "#f59e0b" if beacon else "#c5cad0", INK, 1.2)


def output_file(description, name):
    """Returns the file to write, from the command line; default: `name` in the current folder. Ends the program when it cannot be written."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("file", nargs="?", metavar="FILE", help=f"the picture (default: {name})")
    parser.add_argument("-o", "--output", metavar="FILE", help="the same")
    given = parser.parse_args()
    if given.file and given.output:
        parser.error("write FILE or --output FILE, not both")
    target = Path(given.output or given.file or name)
    require_writable(target)
    require_hal()
    return target


def require_writable(*files):
    """Ends the program when one of the files cannot be written: before a computation, not after it."""
    for file in files:
        if file.is_dir():
            sys.exit(f"{file}: this is a folder; name a file: --output {file / 'picture.svg'}")
        if not file.parent.is_dir():
            sys.exit(
                f"{file}: the folder {file.parent} is missing; create it: mkdir -p {file.parent}"
            )
        if not os.access(file if file.exists() else file.parent, os.W_OK):
            sys.exit(f"{file}: not writable; choose another place with --output, such as /tmp")


def require_hal():
    """Returns the program: $HAL_BIN, `hal` of the PATH, or ./hal of this clone. Ends this program when it is missing."""
    of_clone = Path(__file__).resolve().parent.parent / "hal"
    is_only_one = not shutil.which("hal") and os.access(of_clone, os.X_OK)
    hal = os.environ.get("HAL_BIN", str(of_clone) if is_only_one else "hal")
    if not shutil.which(hal):
        sys.exit(f"'{hal}' is missing or not executable; set HAL_BIN=/path/to/hal")
    return hal


def simulate(netlist, lines, pins, samples, every_s, ini=None):
    """Runs a netlist and `lines`, then samples the pins; returns a list of lists of texts. Ends the program when the simulation fails."""
    script = [*lines] + [
        f"advance {every_s:g}s",
        *(f"getp {pin}" for pin in pins),
    ] * samples
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "run.hal")
        file.write_text("\n".join(script) + "\n", encoding="utf-8")
        done = subprocess.run(
            [require_hal(), "sim", *(["-i", ini] if ini else []), netlist, file],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    words = [
        line for line in done.stdout.splitlines() if " " not in line
    ]  # a line of words is what a component reports
    if done.returncode != 0:
        sys.exit(f"hal sim ended with status {done.returncode}:\n{done.stderr}")
    return [words[i : i + len(pins)] for i in range(0, samples * len(pins), len(pins))]
