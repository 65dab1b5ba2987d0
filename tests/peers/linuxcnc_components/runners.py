# SPDX-License-Identifier: MIT
"""Runs a component with a stimulus: LinuxCNC's or ours in `hal sim`, or LinuxCNC's under its own `halrun`.

In `hal sim`, `loadrt --linuxcnc NAME` loads LinuxCNC's compiled module: the machine code under test is LinuxCNC's, the virtual clock is ours.
"""
import os
import subprocess
import tempfile
from pathlib import Path

from .inventory import parse

LETTER = {"bit": "b", "float": "f", "s32": "s", "u32": "u", "s64": "l", "u64": "k"}
PERIOD_NS = 1_000_000
MAX_COLUMNS = 20  # of a channel of LinuxCNC's streamer and sampler


class RunError(Exception):
    """The component could not be loaded, or did not finish its cycles."""


def as_text(value):
    if isinstance(value, bool):
        return str(int(value))
    return repr(value)


def setp_text(value):
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return repr(value)


class Recording:
    """What a component did: per output a value of each cycle, and per parameter its text after each segment."""

    def __init__(self, columns, rows, parameters):
        self.columns = {name: [row[i] for row in rows] for i, name in enumerate(columns)}
        self.cycles = len(rows)
        self.parameters = parameters


def read_value(text):
    if text in ("TRUE", "true"):
        return 1.0
    if text in ("FALSE", "false"):
        return 0.0
    return float(text)


class SimRunner:
    """`hal sim`. `source` is 'native' or 'linuxcnc'; `plugins` a folder of compiled components that comes first."""

    def __init__(self, hal, source, plugins=None, order=()):
        self.hal, self.source, self.plugins, self.order = str(hal), source, plugins, order

    def environment(self):
        environment = dict(os.environ, NO_COLOR="1")
        environment.pop("HALCYON_MODULES", None)
        if self.plugins:
            environment["HALCYON_PLUGIN_PATH"] = ":".join(
                str(part) for part in (self.plugins, environment.get("HALCYON_PLUGIN_PATH")) if part
            )
        return environment

    def loadrt(self, variant):
        flag = "" if self.plugins else f"--{self.source} "
        return f"loadrt {flag}{variant}"

    def sim(self, folder, text, timeout=60):
        file = Path(folder, "run.hal")
        file.write_text(text)
        try:
            return subprocess.run(
                [self.hal, "sim", "--quiet", str(file)],
                env=self.environment(),
                cwd=folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=timeout,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise RunError(f"a function hangs: {error}") from error

    def inventory(self, variant):
        with tempfile.TemporaryDirectory() as folder:
            done = self.sim(folder, f"{self.loadrt(variant)}\nshow pin\nshow param\nshow funct\n")
            if done.returncode != 0:
                raise RunError(done.stderr.strip())
            return parse(done.stdout)

    def run(self, variant, inventory, stimulus, cycles):
        """`inventory` is what both sides have."""
        with tempfile.TemporaryDirectory() as folder:
            text, recorded = self.netlist(Path(folder), variant, inventory, stimulus, cycles)
            done = self.sim(folder, text)
            csv = Path(folder, "out.csv")
            if done.returncode != 0 or not csv.exists():
                raise RunError(done.stderr.strip() or f"status {done.returncode}")
            rows = [
                [read_value(cell) for cell in line.split(",")[1:]]
                for line in csv.read_text().splitlines()[1:]
            ]
            if recorded and any(len(row) != len(recorded) for row in rows):
                raise RunError(f"a record without {len(recorded)} values: {csv.read_text()[:200]}")
            if len(rows) != cycles:
                raise RunError(f"{len(rows)} of {cycles} samples; {done.stderr.strip()}")
            return Recording(recorded, rows, self.parameters(inventory, done.stdout))

    @staticmethod
    def parameters(inventory, output):
        """The values of the parameters after each segment, in the order in which the netlist reads them."""
        names = [item.name for item in inventory.readable_parameters()]
        values = output.split()
        if names and len(values) % len(names):
            raise RunError(f"{len(values)} values of {len(names)} parameters: {output[:200]}")
        return {name: values[i :: len(names)] for i, name in enumerate(names)}

    def netlist(self, folder, variant, inventory, stimulus, cycles):
        streams = stimulus.streams
        outputs = [item for item in inventory.pins("OUT", "I/O") if item.type in LETTER]
        by_name = inventory.items
        functions = sorted(inventory.functions, key=lambda name: (self.rank(name), name))
        lines = [f"loadrt threads name1=t period1={PERIOD_NS}", self.loadrt(variant)]
        if streams:
            letters = "".join(LETTER[by_name[name].type] for name in streams)
            lines += [
                f"loadrt --native streamer depth={cycles + 10} cfg={letters}",
                "addf streamer.0 t",
            ]
        letters = "".join(LETTER[item.type] for item in outputs) or "b"
        lines += [f"addf {function} t" for function in functions]
        lines += [f"loadrt --native sampler depth={cycles + 10} cfg={letters}", "addf sampler.0 t"]
        lines += [f"net in-{i} streamer.0.pin.{i} => {name}" for i, name in enumerate(streams)]
        lines += [f"net out-{i} {item.name} => sampler.0.pin.{i}" for i, item in enumerate(outputs)]
        signal = {item.name: f"out-{i}" for i, item in enumerate(outputs)}
        if streams:
            folder.joinpath("in.txt").write_text(
                "".join(
                    " ".join(as_text(column[i]) for column in streams.values()) + "\n"
                    for i in range(cycles)
                )
            )
        segments = len(stimulus.settings)
        for number, changes in enumerate(stimulus.settings):
            for name, value in changes.items():
                lines.append(
                    f"sets {signal[name]} {setp_text(value)}"
                    if name in signal
                    else f"setp {name} {setp_text(value)}"
                )
            if number == 0:
                lines += [f"loadusr -w {self.hal} play in.txt"] if streams else []
                lines.append("start")
            span = cycles * (number + 1) // segments - cycles * number // segments
            lines.append(f"advance {span} cycles")
            lines += [f"getp {item.name}" for item in inventory.readable_parameters()]
        lines.append(f"loadusr -w {self.hal} record --csv -n {cycles} 0 out.csv")
        return "\n".join(lines) + "\n", [item.name for item in outputs]

    def rank(self, name):
        for number, ending in enumerate(self.order):
            if name.endswith(ending):
                return number
        return len(self.order)
