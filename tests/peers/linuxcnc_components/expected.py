# SPDX-License-Identifier: MIT
"""The differences from LinuxCNC that are intended, each with its reason. docs/linuxcnc-same-names.md has them as tables, written by
`linuxcnc_components.py HAL --write-docs`; a test compares both.

A difference of values is a Behaviour: a condition for the cycles in which it occurs. With `lasts` it remains after the first such cycle, because
the component keeps something of it. `witness` is a stimulus that shows it: (variant, streams, settings). A stream is a list of values, the last of
which continues. Or (variant, class): random stimuli of that class, of which one of the first ten must show it. A Behaviour whose witness shows no difference is out of date, and fails.
"""
import math
import re
from dataclasses import dataclass
from typing import Callable

from .variants import Variant


@dataclass(frozen=True)
class Behaviour:
    component: str
    pins: str  # a regular expression for the end of the name
    when: Callable  # of a View
    condition: str  # the same in words
    ours: str
    linuxcnc: str
    why: str
    witness: tuple
    lasts: bool = False
    within: float = math.inf  # the largest difference, relative to `reference`
    reference: Callable = None  # of a View; otherwise the larger of 1 and both values
    most_cycles: int = 10**9  # of a run in which it occurs
    versions: tuple = ("2.9", "2.10")

    def concerns(self, component, name):
        return (
            component == self.component
            and re.search(rf"(?:^|\.)(?:{self.pins})$", name) is not None
        )

    def remaining(self, view, difference):
        """What of the difference this behaviour does not explain, or None."""
        if len(difference.cycles) > self.most_cycles:
            return difference

        def small(cycle):
            if self.within == math.inf:
                return True
            a, b = difference.ours[cycle], difference.theirs[cycle]
            if self.reference is None:
                reference = max(1.0, abs(a), abs(b))
            else:
                reference = self.reference(view.at(cycle))
            return abs(a - b) <= self.within * reference + difference.absolute

        if not self.lasts:
            return difference.without(
                lambda cycle: small(cycle) and bool(self.when(view.at(cycle)))
            )
        begin = next(
            (cycle for cycle in range(difference.cycles[-1] + 1) if self.when(view.at(cycle))), None
        )
        return (
            difference
            if begin is None
            else difference.without(lambda cycle: cycle >= begin and small(cycle))
        )


@dataclass(frozen=True)
class InInventory:
    component: str
    names: str  # a regular expression for the end of the name
    ours: str
    linuxcnc: str
    why: str
    versions: tuple = ("2.9", "2.10")

    def concerns(self, component, name):
        return (
            component == self.component
            and re.search(rf"(?:^|\.)(?:{self.names})$", name) is not None
        )


# Components that follow another law on purpose, so that a comparison cycle by cycle has no meaning. "by feature": tests/peers/compare_components.py compares
# them feature by feature; docs/linuxcnc-same-names.md has the results. The manual page of each lists what differs; netlists test it.
FEATURES = "compared [by feature](#our-components-compared-with-linuxcncs)"
UNLIKE = {
    "encoder": FEATURES,
    "limit3": FEATURES,
    "pid": FEATURES,
    "pwmgen": FEATURES,
    "stepgen": FEATURES,
    "anglejog": "acceleration fractions are positive in all directions; a motion that was interrupted goes on braking",
    "bldc": "trapezoids follow `lead-angle`, the angle is extrapolated by fractions of a count, codes outside of the Hall pattern set the outputs to 0",
    "carousel": "`enable` FALSE stops at once; the states have other numbers",
    "moveoff": "brakes as late as whole periods allow and ends exactly at the offset",
}

# Components whose outputs depend on the time of day, or on records of other programs: only their inventory is compared.
INVENTORY_ONLY = {
    "latencybins": "measures the computer's clock, which is simulated here",
    "timedelta": "measures the computer's clock, which is simulated here",
    "sampler": "its records are tested by tests/netlists",
    "streamer": "its records are tested by tests/netlists",
    "message": "prints",
}

# Components of which 2.10's behaviour is ours: what is newer.
NEWER = {
    "encoder": "a reset while latching",
    "eoffset_per_angle": "double precision",
    "filter_kalman": "double precision",
    "gantry": "double precision",
    "thc": "double precision",
    "thcud": "`correction-vel` is a pin, `cur-offset` works",
    "toggle2nist": "debounced, on and off have their edges",
}
# The version whose inventory inventory.json has for a component, if it is not 2.9.
NEWER_FACTS = {}

INVENTORY = []
BEHAVIOURS = []


def behaviour(component, pins, when, condition, ours, linuxcnc, why, witness, **more):
    variant, *rest = witness
    BEHAVIOURS.append(
        Behaviour(
            component,
            pins,
            when,
            condition,
            ours,
            linuxcnc,
            why,
            (Variant(*variant.split(" ", 1)), *rest),
            **more,
        )
    )


def inventory(component, names, ours, linuxcnc, why, **more):
    INVENTORY.append(InInventory(component, names, ours, linuxcnc, why, **more))
