# SPDX-License-Identifier: MIT
"""Compares two recordings of the same component and stimulus."""
import math
from dataclasses import dataclass, replace

RELATIVE = 1e-9
ABSOLUTE = 1e-12


@dataclass
class Difference:
    """An output or parameter that differs. A parameter is read at the last cycle of each segment."""

    name: str
    cycles: list
    ours: dict  # of each of the cycles
    theirs: dict
    absolute: float = ABSOLUTE  # what both recordings may differ by, because of their digits

    @property
    def first(self):
        return self.cycles[0]

    def without(self, explained):
        """The same in the cycles for which `explained(cycle)` is false; None if there are none."""
        left = [cycle for cycle in self.cycles if not explained(cycle)]
        return replace(self, cycles=left) if left else None


def equal(a, b, absolute=ABSOLUTE):
    if math.isnan(a) or math.isnan(b):
        return math.isnan(a) and math.isnan(b)
    if a == b:
        return True
    if math.isinf(a) or math.isinf(b):
        return False
    return abs(a - b) <= absolute + RELATIVE * max(abs(a), abs(b))


def as_number(text):
    if text in ("TRUE", "FALSE"):
        return float(text == "TRUE")
    try:
        return float(int(text, 0))
    except ValueError:
        return float(text)


def differences(ours, theirs, absolute=ABSOLUTE):
    """`ours` and `theirs` are recordings of the same outputs and parameters."""
    found = []
    for name, column in ours.columns.items():
        other = theirs.columns[name]
        cycles = [i for i, (a, b) in enumerate(zip(column, other)) if not equal(a, b, absolute)]
        if cycles:
            found.append(Difference(name, cycles, column, other, absolute))
    for name, texts in ours.parameters.items():
        if name not in theirs.parameters:
            continue  # LinuxCNC's halrun
        a, b = [as_number(text) for text in texts], [
            as_number(text) for text in theirs.parameters[name]
        ]
        ends = [ours.cycles * (i + 1) // len(texts) - 1 for i in range(len(texts))]
        # getp prints seven digits
        cycles = [
            end
            for end, x, y in zip(ends, a, b)
            if not equal(x, y) and not abs(x - y) <= 1e-6 * max(abs(x), abs(y))
        ]
        if cycles:
            found.append(Difference(name, cycles, dict(zip(ends, a)), dict(zip(ends, b))))
    return found
