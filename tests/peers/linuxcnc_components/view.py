# SPDX-License-Identifier: MIT
"""The values of inputs and settings at a cycle, by the end of their names; for the conditions of expected.py."""
import math

from .inventory import number


class View:
    def __init__(self, inventory, stimulus, cycles):
        self.stimulus, self.cycles = stimulus, cycles
        self.given = [
            item for item in inventory.items.values() if item.direction in ("IN", "I/O", "RW")
        ]
        self.defaults = {
            item.name: number(item.value) for item in self.given if item.type != "port"
        }
        self.cycle = 0
        self.running_maxima = {}

    def at(self, cycle):
        self.cycle = cycle
        return self

    def of(self, name):
        if name in self.stimulus.streams:
            return self.stimulus.streams[name][self.cycle]
        value = self.stimulus.setting(name, self.cycle, self.cycles)
        return self.defaults[name] if value is None else value

    def __getitem__(self, ending):
        found = [name for name in self.defaults if name == ending or name.endswith("." + ending)]
        if len(found) != 1:
            raise KeyError(f"{ending}: {found}")
        return self.of(found[0])

    def all(self, *endings):
        """The values of all inputs and settings, or of those whose names end with one of `endings`."""
        return [self.of(name) for name in self.defaults if not endings or name.endswith(endings)]

    def has(self, ending):
        return any(name.endswith("." + ending) for name in self.defaults)

    def largest(self, *endings):
        """The largest finite magnitude of those inputs and settings in this cycle and before."""
        if endings not in self.running_maxima:
            self.running_maxima[endings] = self.running_maximum(endings)
        return self.running_maxima[endings][self.cycle]

    def running_maximum(self, endings):
        now, maximum, maxima = self.cycle, 0.0, []
        for cycle in range(self.cycles):
            values = [abs(value) for value in self.at(cycle).all(*endings)]
            maximum = max([maximum, *filter(math.isfinite, values)])
            maxima.append(maximum)
        self.at(now)
        return maxima

    def changed(self, *endings):
        """True if one of them differs from its value in the first cycle."""
        now, cycle = self.all(*endings), self.cycle
        before = self.at(0).all(*endings)
        self.at(cycle)
        return now != before

    def invalid(self, *endings):
        """True if one of them is NaN or infinite."""
        return any(
            isinstance(value, float) and not math.isfinite(value) for value in self.all(*endings)
        )

    def beyond(self, limit, *endings):
        """True if one of them is NaN or beyond ±limit."""
        return any(not abs(value) <= limit for value in self.all(*endings))
