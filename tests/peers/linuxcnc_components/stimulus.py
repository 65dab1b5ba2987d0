# SPDX-License-Identifier: MIT
"""Seeded inputs. A stimulus has a stream per input pin, a value for each cycle, and settings that change between segments of cycles.

Three classes: `plain` has ordinary values and parameters at their defaults; `edges` has values from a small pool, so that inputs meet each
other and limits exactly, and parameters in and outside of their ranges; `wild` has NaN, infinities and extreme integers as well.
"""
import math
import random
from dataclasses import dataclass, field

CLASSES = ("plain", "edges", "wild")
SEGMENTS = 8
FLOAT_POOL = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.0,
    -2.0,
    10.0,
    -10.0,
    0.001,
    0.002,
    0.005,
    0.01,
    0.1,
    100.0,
    -100.0,
    1e-9,
    3.0,
    0.25,
]
FLOAT_WILD = [
    math.nan,
    math.inf,
    -math.inf,
    1e300,
    -1e300,
    1e-300,
    5e-324,
    2147483647.0,
    2147483648.0,
    -2147483648.0,
    -2147483649.0,
    4294967295.0,
    4294967296.0,
    1e18,
    -1e18,
    9.3e18,
    1e12,
    -1e12,
]
INTEGER_POOL = {
    "s32": [0, 1, -1, 2, 3, 4, 5, 7, 8, -2, 10, 100, -100],
    "u32": [0, 1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 31, 32, 100],
}
INTEGER_WILD = {
    "s32": [2147483647, -2147483648, 2147483646, -2147483647, 65536, 1 << 30],
    "u32": [4294967295, 2147483648, 2147483647, 4294967294, 65536],
}
INTEGER_POOL |= {"s64": INTEGER_POOL["s32"], "u64": INTEGER_POOL["u32"]}
INTEGER_WILD |= {
    "s64": INTEGER_WILD["s32"] + [(1 << 63) - 1, -(1 << 63), 1 << 53],
    "u64": INTEGER_WILD["u32"] + [(1 << 64) - 1, 1 << 63, 1 << 53],
}
HOLD = {"plain": [1, 2, 5, 20, 100, 300], "edges": [1, 2, 3, 7, 40, 200], "wild": [1, 3, 20, 200]}


# Values with which a component does what it is for: (component, end of the name): values, in every class.
USEFUL = {
    ("histobins", "binsize"): [0.1, 1.0, 5.0],
    ("histobins", "nbins"): [4, 20, 200],
    ("histobins", "pintype"): [0, 1, 2, 3],
    ("lcd", "page_num"): [0],
    ("limit2", "maxv"): [1.0, 50.0, 0.1],
    ("limit3", "maxv"): [1.0, 50.0],
    ("limit3", "maxa"): [10.0, 500.0],
    ("ohmic", "thcad-0-volt-freq"): [121.0, 140000.0],
    ("ohmic", "thcad-max-volt-freq"): [925.0, 920000.0],
    ("ohmic", "thcad-fullscale"): [5.0, 10.0, 300.0],
    ("ohmic", "thcad-divide"): [1.0, 32.0],
    ("ohmic", "velocity-in"): [121.0, 500.0, 10000.0, 925.0, 100.0],
    ("spindle", "select-gear"): [0],
    ("spindle", "max.0"): [0.0, 3000.0],
    ("spindle", "accel.0"): [0.0, 500.0],
    ("spindle", "decel.0"): [0.0, 800.0],
    ("spindle", "commanded-speed"): [0.0, 100.0, 1200.0, -500.0],
    ("spindle", "min.0"): [0.0, 60.0],
    ("simple_tp", "maxvel"): [0.5, 2.0, 30.0, 1e-3],
    ("simple_tp", "maxaccel"): [1.0, 20.0, 400.0],
    ("steptest", "maxvel"): [1.0, 20.0],
    ("watchdog", "timeout-0"): [0.002, 0.01, 0.0035],
    ("watchdog", "timeout-1"): [0.3, 0.05],
}


def useful_values(component, name):
    for (wanted, ending), values in USEFUL.items():
        if wanted == component and name.endswith(ending):
            return values
    return None


@dataclass
class Stimulus:
    kind: str
    seed: str
    streams: dict = field(default_factory=dict)  # pin: [value of each cycle]
    settings: list = field(default_factory=list)  # of each segment: {name: value}

    def setting(self, name, cycle, cycles):
        """The value of a setting in a cycle; None: its default."""
        segment = cycle * len(self.settings) // cycles
        value = None
        for changes in self.settings[: segment + 1]:
            value = changes.get(name, value)
        return value


def bit_stream(rng, cycles, kind):
    hold = rng.choice(HOLD[kind] + [10**9])
    level, values = rng.random() < 0.5, []
    while len(values) < cycles:
        length = (
            hold
            if hold >= 10**9 or rng.random() < 0.2
            else max(1, round(rng.expovariate(1 / hold)))
        )
        values += [level] * min(length, cycles - len(values))
        level = not level
    return values


def smooth_stream(rng, cycles):
    """A sine, or a ramp, or a random walk."""
    amplitude, shape = rng.choice([0.5, 1.0, 3.0, 10.0, 200.0]), rng.randrange(3)
    if shape == 0:
        period, phase = rng.uniform(20, 1500), rng.uniform(0, 6.28)
        return [amplitude * math.sin(2 * math.pi * i / period + phase) for i in range(cycles)]
    if shape == 1:
        start, slope = rng.uniform(-amplitude, amplitude), rng.uniform(-amplitude, amplitude) / 500
        return [start + slope * i for i in range(cycles)]
    value, values = rng.uniform(-amplitude, amplitude), []
    for _ in range(cycles):
        value += rng.uniform(-amplitude, amplitude) / 50
        values.append(value)
    return values


def held_stream(rng, cycles, kind, draw):
    hold, values = rng.choice(HOLD[kind] + [10**9]), []
    while len(values) < cycles:
        length = hold if hold >= 10**9 else max(1, round(rng.expovariate(1 / hold)))
        values += [draw()] * min(length, cycles - len(values))
    return values


def float_value(rng, kind, pool):
    chance = rng.random()
    if kind == "wild" and chance < 0.15:
        return rng.choice(FLOAT_WILD)
    if kind != "plain" and chance < 0.75:
        return rng.choice(pool)
    return rng.uniform(-1, 1) * rng.choice([0.01, 1.0, 10.0, 500.0])


def integer_value(rng, type_, kind):
    if kind == "wild" and rng.random() < 0.2:
        return rng.choice(INTEGER_WILD[type_])
    if rng.random() < 0.1:
        return rng.randrange(0, 1 << 16)
    return rng.choice(INTEGER_POOL[type_])


def stream(rng, type_, cycles, kind, pool):
    if type_ == "bit":
        return bit_stream(rng, cycles, kind)
    if type_ == "float":
        if rng.random() < (0.5 if kind == "plain" else 0.15):
            return smooth_stream(rng, cycles)
        return held_stream(rng, cycles, kind, lambda: float_value(rng, kind, pool))
    return held_stream(rng, cycles, kind, lambda: integer_value(rng, type_, kind))


def setting_value(rng, item, kind, pool):
    if item.type == "bit":
        return rng.random() < 0.5
    if item.type == "float":
        return float_value(rng, kind, pool)
    return integer_value(rng, item.type, kind)


def random_stimulus(inventory, variant, kind, seed, cycles, segments=SEGMENTS):
    """Streams for the inputs of `inventory` and settings for the rest."""
    seed_text = f"{seed}:{variant}:{kind}"
    rng = random.Random(seed_text)
    pool = rng.sample(FLOAT_POOL, 6)
    result = Stimulus(kind, seed_text)
    for item in inventory.pins("IN"):
        useful = useful_values(variant.component, item.name)
        if useful and rng.random() < (1.0 if kind == "plain" else 0.7):
            result.streams[item.name] = held_stream(
                rng, cycles, kind, lambda values=useful: rng.choice(values)
            )
            continue
        if item.type in ("bit", "float", "s32", "u32", "s64", "u64") and rng.random() < 0.85:
            result.streams[item.name] = stream(rng, item.type, cycles, kind, pool)
    result.settings = [{} for _ in range(segments)]
    for item in inventory.settings():
        if item.type == "port":
            continue
        useful = useful_values(variant.component, item.name)
        if useful:
            result.settings[0][item.name] = rng.choice(useful)
        for segment in range(segments):
            chance = {
                "plain": 0.15 if item.kind == "pin" else 0.0,
                "edges": 0.5 if segment == 0 else 0.12,
                "wild": 0.5 if segment == 0 else 0.2,
            }[kind]
            if rng.random() < chance and not (useful and (segment == 0 or rng.random() < 0.7)):
                result.settings[segment][item.name] = setting_value(rng, item, kind, pool)
    return result
