#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""Compares our components with LinuxCNC's of the same names: linuxcnc_components.py HAL [options]

HAL is our program. For every component that exists on both sides: pins, parameters and functions with types, directions and defaults;
and every output and parameter under random and edge inputs, cycle by cycle. LinuxCNC's side is the compiled module of the package linuxcnc-uspace,
loaded unmodified with `loadrt --linuxcnc` on the virtual clock; with --halrun, LinuxCNC's own halrun. --netlists N compares N random netlists
under both halrun programs. --newer FOLDER has components of LinuxCNC 2.10, compiled with `hal compile`, for those in which 2.10 differs from 2.9.

Each intended difference is in linuxcnc_components/entries.py with its reason; any other one fails, and so does one that no longer occurs.
Without LinuxCNC the inventory is compared with linuxcnc_components/inventory.json, and the rest is skipped. --write-docs and --write-inventory update
docs/linuxcnc-same-names.md and that file.
"""
import argparse
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from linuxcnc_components import (
    comparison,
    documentation,
    entries,
    expected,
    halrun,
    inventory,
    netlists,
    stimulus,
)
from linuxcnc_components.runners import RunError, SimRunner
from linuxcnc_components.variants import variants
from linuxcnc_components.view import View

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FACTS = HERE / "linuxcnc_components" / "inventory.json"
MODULES = Path("/usr/lib/linuxcnc/modules")
FOLDERS = ("logic", "math", "control", "motion", "io", "safety", "sim")
ORDER = (
    "make-pulses",
    "update-counters",
    "capture-position",
    "update-freq",
)  # of functions in the thread; the others follow by name
WITNESS_CYCLES = 400
CRASHED = "LinuxCNC's module crashed or hung"
ENDS = ("crashed", "hangs", f"SEGV ({MODULES}/")  # the last in words of a sanitizer


def our_components():
    return {
        path.stem for folder in FOLDERS for path in (ROOT / "components" / folder).glob("*.cpp")
    }


def common(ours, theirs):
    """The part of an inventory that both sides have in the same way."""
    items = {
        name: item
        for name, item in theirs.items.items()
        if name in ours.items
        and (ours.items[name].kind, ours.items[name].type, ours.items[name].direction)
        == (item.kind, item.type, item.direction)
    }
    return inventory.Inventory(items, [name for name in theirs.functions if name in ours.functions])


def format_value(value):
    return (
        f"{value:.9g}"
        if isinstance(value, float)
        else str(int(value))
        if isinstance(value, bool)
        else str(value)
    )


def inputs_at(given, cycle, cycles):
    """The inputs of the cycle before and of the cycle, then the settings."""
    streams = {
        name: values[max(0, cycle - 1) : cycle + 1] for name, values in given.streams.items()
    }
    settings = {}
    for changes in given.settings[: cycle * len(given.settings) // cycles + 1]:
        settings.update(changes)
    text = " ".join(
        f"{name.split('.', 1)[-1]}={'->'.join(map(format_value, values))}"
        for name, values in streams.items()
    )
    return text + "".join(
        f" {name.split('.', 1)[-1]}:={format_value(value)}" for name, value in settings.items()
    )


class Comparison:
    """One side is ours; the other is LinuxCNC 2.9 or, for a component that is newer there, 2.10."""

    def __init__(self, options):
        self.options = options
        self.native = SimRunner(options.hal, "native", order=ORDER)
        self.older = SimRunner(options.hal, "linuxcnc", order=ORDER)
        self.newer = (
            SimRunner(options.hal, "native", plugins=options.newer, order=ORDER)
            if options.newer
            else None
        )
        self.real = halrun.HalrunRunner(ORDER) if options.halrun else None
        self.used = set()

    def reference(self, component):
        """(runner, version) of LinuxCNC's side."""
        if self.real:
            return self.real, "2.9"
        if (
            self.newer
            and (component in expected.NEWER or self.options.all_newer)
            and (self.options.newer / f"{component}.so").exists()
        ):
            return self.newer, "2.10"
        return self.older, "2.9"

    def inventories(self, variant):
        runner, version = self.reference(variant.component)
        ours, theirs = self.native.inventory(variant), runner.inventory(variant)
        return ours, theirs, self.inventory_lines(variant, ours, theirs, version)

    def inventory_lines(self, variant, ours, theirs, version):
        lines = []
        for name, a, b in inventory.differences(ours, theirs):
            entry = next(
                (
                    e
                    for e in expected.INVENTORY
                    if version in e.versions and e.concerns(variant.component, name)
                ),
                None,
            )
            self.used.add(id(entry))
            if entry is None:
                lines.append(f"{variant} | inventory | {name} | LinuxCNC {b} | ours {a}")
        return lines

    def run(self, variant, both, inputs, cycles):
        """(lines, behaviours that were seen)."""
        runner, version = self.reference(variant.component)
        absolute = 2e-6 if runner is self.real else comparison.ABSOLUTE
        results = []
        for who, side in (("ours", self.native), ("LinuxCNC's", runner)):
            try:
                results.append(side.run(variant, both, inputs, cycles))
            except RunError as error:
                if who != "ours" and any(word in str(error) for word in ENDS):
                    print(
                        f"{variant} | {inputs.seed} | LinuxCNC's own: {str(error)[:150]}",
                        flush=True,
                    )
                    return [], {CRASHED}
                return [f"{variant} | {inputs.seed} | {who}: {error}"], set()
        ours, theirs = results
        lines, seen, view = [], set(), View(both, inputs, cycles)
        for found in comparison.differences(ours, theirs, absolute):
            left = found
            for entry in expected.BEHAVIOURS:
                if (
                    left is None
                    or version not in entry.versions
                    or not entry.concerns(variant.component, found.name)
                ):
                    continue
                before = len(left.cycles)
                left = entry.remaining(view, left)
                if left is None or len(left.cycles) < before:
                    seen.add(id(entry))
            if left:
                i = left.first
                lines.append(
                    f"{variant} | {inputs.seed} | {left.name} @{i} ({len(left.cycles)}) | LinuxCNC {left.theirs[i]} | ours {left.ours[i]} | {inputs_at(inputs, i, cycles)[:900]}"
                )
        return lines, seen

    def variant(self, variant):
        options = self.options
        try:
            ours, theirs, lines = self.inventories(variant)
        except RunError as error:
            return [f"{variant} | load | {error}"]
        if variant.component in expected.INVENTORY_ONLY or variant.component in expected.UNLIKE:
            return lines
        both = common(ours, theirs)
        for kind in options.classes:
            for number in range(options.rounds):
                inputs = stimulus.random_stimulus(
                    both,
                    variant,
                    kind,
                    f"{options.seed}.{number}",
                    options.cycles,
                    segments=1 if options.halrun else stimulus.SEGMENTS,
                )
                found, seen = self.run(variant, both, inputs, options.cycles)
                lines += found
                self.used |= seen
        return lines

    def stimuli_of(self, entry, both):
        """The stimuli of which one must show the behaviour, with their numbers of cycles."""
        variant, *rest = entry.witness
        if len(rest) == 1:
            for number in range(10):
                yield stimulus.random_stimulus(
                    both, variant, rest[0], f"witness.{number}", 1000
                ), 1000
            return
        streams, settings = rest
        inputs = stimulus.Stimulus("witness", f"witness of {entry.component} {entry.pins}")
        inputs.streams = {
            name: (values + [values[-1]] * WITNESS_CYCLES)[:WITNESS_CYCLES]
            for name, values in streams.items()
        }
        inputs.settings = settings if isinstance(settings, list) else [settings]
        yield inputs, WITNESS_CYCLES

    def witness(self, entry):
        """Lines if the behaviour does not occur, or something else does."""
        variant = entry.witness[0]
        if self.reference(variant.component)[1] not in entry.versions:
            return []
        ours, theirs, _ = self.inventories(variant)
        both = common(ours, theirs)
        lines = []
        for inputs, cycles in self.stimuli_of(entry, both):
            found, seen = self.run(variant, both, inputs, cycles)
            lines += found
            if id(entry) in seen or CRASHED in seen:
                return lines
        return [
            *lines,
            f"{entry.component} | {entry.pins} | {entry.condition}: no difference; remove the entry",
        ]


def check_facts(options):
    """Our inventory beside the committed one of LinuxCNC, which need not be installed."""
    native, lines = SimRunner(options.hal, "native"), []
    checker = Comparison(options)
    for text, theirs in inventory.load_facts(FACTS).items():
        component = text.split()[0]
        if options.only and component not in options.only:
            continue
        variant = next((one for one in variants(component) if str(one) == text), None)
        if variant is None:
            continue
        lines += checker.inventory_lines(
            variant, native.inventory(variant), theirs, expected.NEWER_FACTS.get(component, "2.9")
        )
    return lines


def write_facts(names):
    runner, found = halrun.HalrunRunner(), {}
    for name in names:
        for variant in variants(name):
            found[str(variant)] = runner.inventory(variant)
    inventory.save_facts(FACTS, found)
    print(
        f"{FACTS.name}: {len(found)} variants, {sum(len(one.items) for one in found.values())} pins and parameters"
    )


def compare_components(options, names):
    checker = Comparison(options)
    work = [variant for name in names for variant in variants(name)]
    print(f"seed {options.seed}: {len(names)} components, {len(work)} variants", flush=True)
    lines = []
    with ThreadPoolExecutor(1 if options.halrun else options.jobs) as pool:
        for found in pool.map(checker.variant, work):
            lines += found
            for line in found:
                print(line, flush=True)
        if not options.halrun and not options.no_witnesses:
            wanted = [entry for entry in expected.BEHAVIOURS if entry.component in names]
            for found in pool.map(checker.witness, wanted):
                lines += found
                for line in found:
                    print(line, flush=True)
    return lines


def compare_netlists(options):
    linuxcnc, lines, accepted = halrun.HalrunRunner(), [], set()
    for number in range(options.netlists):
        found = netlists.compare(options.hal, linuxcnc, f"{options.seed}.{number}", accepted)
        lines += found
        for line in found:
            print(line, flush=True)
    print(f"{options.netlists} netlists; accepted: {'; '.join(sorted(accepted)) or 'none'}")
    return lines


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("hal", type=lambda path: Path(path).resolve())
    parser.add_argument("--seed", default=str(int(time.time())))
    parser.add_argument("--cycles", type=int, default=2000)
    parser.add_argument(
        "--rounds", type=int, default=2, help="stimuli of each class for each variant"
    )
    parser.add_argument(
        "--classes", type=lambda text: text.split(","), default=list(stimulus.CLASSES)
    )
    parser.add_argument("--only", type=lambda text: text.split(","), default=None)
    parser.add_argument("--newer", type=lambda path: Path(path).resolve())
    parser.add_argument(
        "--all-newer",
        action="store_true",
        help="compare all with 2.10, not only those that differ from 2.9",
    )
    parser.add_argument(
        "--halrun", action="store_true", help="LinuxCNC's side under its own halrun"
    )
    parser.add_argument("--netlists", type=int, default=0, metavar="N")
    parser.add_argument("--no-witnesses", action="store_true")
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--write-inventory", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()

    if options.write_docs:
        documentation.write(ROOT / "docs" / "linuxcnc-same-names.md")
        return 0
    lines = documentation.check(ROOT / "docs" / "linuxcnc-same-names.md")
    lines += check_facts(options) if FACTS.exists() and not options.write_inventory else []
    for line in lines:
        print(line)
    installed = MODULES.is_dir()
    names = options.only or sorted(our_components() & {path.stem for path in MODULES.glob("*.so")})
    if options.write_inventory:
        write_facts(names)
        return 0
    if installed and options.netlists:
        lines += compare_netlists(options)
    elif installed:
        lines += compare_components(options, names)
    print(f"{len(lines)} unexplained")
    if not installed:
        print("LinuxCNC is not installed: type: sudo apt-get install linuxcnc-uspace")
    return 1 if lines else 0 if installed else 77


if __name__ == "__main__":
    sys.exit(main())
