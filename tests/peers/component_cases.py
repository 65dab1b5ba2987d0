# SPDX-License-Identifier: MIT
"""The cases of compare_components.py: settings, inputs, and the expected differences of each. In a reason, "ours" is Halcyon's component."""
import math
import random
from dataclasses import dataclass, field

N = 3000  # cycles


@dataclass
class Row:
    """A comparison. Pin names omit the instance. Outputs carry their type: `f:output`."""

    component: str
    name: str
    settings: dict
    inputs: dict  # pin: N values of the same type
    outputs: list
    reason: str = ""  # the reason of the difference; empty: must be equal
    bounds: dict = field(
        default_factory=dict
    )  # pin that differs: (maximum number of cycles, maximum difference)
    arguments: str = ""
    later: int = 0  # delay of our samples in the comparison, in cycles
    slow: bool = False  # all functions except the fast one run in every tenth cycle
    extra: tuple = ()  # more lines of the netlist
    in_order: bool = False  # compares the sequence of output states, not their times


def sine(amplitude, period, phase=0.0):
    return [amplitude * math.sin(2 * math.pi * i / period + phase) for i in range(N)]


def triangle(amplitude, period):
    return [amplitude * (4 * abs((i / period) % 1 - 0.5) - 1) for i in range(N)]


def steps(amplitude, cycles):
    return [amplitude * float((i // cycles) % 3 - 1) for i in range(N)]


def noise(amplitude, seed):
    numbers = random.Random(seed)
    return [numbers.uniform(-amplitude, amplitude) for _ in range(N)]


def flag(cycles, of, low):
    """TRUE except in the last `low` of every `of` segments of `cycles` cycles."""
    return [(i // cycles) % of < of - low for i in range(N)]


def from_zero(values):
    return [type(values[0])(0)] + values[1:]


# --- pid


def pid_rows():
    command, feedback = from_zero(sine(3, 300, 0.7)), from_zero(triangle(1.5, 360))
    jump = [7.5 * (i >= 46) - 9.0 * (i >= 230) for i in range(N)]
    index, on = flag(23, 2, 1), flag(37, 4, 1)
    outputs = [
        "b:saturated",
        "s:saturated-count",
        "f:saturated-s",
        "f:output",
        "f:error",
        "f:errorI",
        "f:errorD",
        "f:commandD",
        "f:commandDD",
        "f:commandDDD",
    ]
    every = dict(
        Pgain=5,
        Igain=3,
        Dgain=0.1,
        FF0=0.5,
        FF1=0.2,
        FF2=0.01,
        FF3=1e-5,
        bias=0.1,
        deadband=0.05,
        maxerror=2,
        maxerrorI=0.5,
        maxerrorD=20,
        maxcmdD=30,
        maxcmdDD=300,
        maxcmdDDD=3000,
        maxoutput=8,
    )
    features = [
        ("Pgain", dict(Pgain=2), {}),
        ("Igain", dict(Igain=2), {}),
        ("Dgain", dict(Dgain=0.2), {}),
        ("FF0", dict(FF0=0.3), {}),
        ("FF1", dict(FF1=0.3), {}),
        ("FF2", dict(FF2=0.3), {}),
        ("FF3", dict(FF3=0.3), {}),
        ("bias", dict(bias=0.3), {}),
        (
            "negative gains",
            dict(Pgain=-2, Igain=5, FF1=-0.1, maxoutput=1.5, deadband=0.5),
            {"command": from_zero(steps(1, 70))},
        ),
        ("deadband", dict(Pgain=2, Igain=3, Dgain=0.1, deadband=0.3), {}),
        ("maxerror", dict(Pgain=2, Igain=3, Dgain=0.1, maxerror=0.5), {}),
        ("maxerrorI", dict(Igain=2, maxerrorI=0.2), {}),
        ("maxerrorD", dict(Dgain=2, maxerrorD=10), {}),
        ("maxcmdD", dict(FF1=2, Dgain=0.1, maxcmdD=10), {}),
        ("maxcmdDD", dict(FF2=2, maxcmdDD=100), {}),
        ("maxcmdDDD", dict(FF3=2, maxcmdDDD=1000), {}),
        ("maxoutput, P", dict(Pgain=2, maxoutput=1.5), {}),
        ("maxoutput, PI: integral, saturated pins", dict(Pgain=2, Igain=5, maxoutput=1.5), {}),
        ("maxoutput below bias", dict(Pgain=0.2, Igain=5, bias=3, maxoutput=1.5), {}),
        ("enable", dict(Pgain=2, Igain=5, Dgain=0.1, bias=0.4, FF1=0.2, FF2=0.01), {"enable": on}),
        ("enable while saturated", dict(Pgain=2, Igain=5, maxoutput=1.5), {"enable": on}),
        (
            "index-enable",
            dict(Pgain=2, Igain=5, Dgain=0.1, FF1=0.2, FF2=0.01, FF3=0.001),
            {"index-enable": index},
        ),
        (
            "index-enable, with a jump",
            dict(Pgain=2, Igain=5, Dgain=0.1, FF1=0.2, FF2=0.01, FF3=0.001, maxerrorD=50),
            {
                "index-enable": index,
                "command": [a + b for a, b in zip(command, jump)],
                "feedback": [a + b for a, b in zip(feedback, jump)],
            },
        ),
        ("command-deriv", dict(Dgain=0.1, FF1=1), {"command-deriv": from_zero(noise(1, 1))}),
        ("feedback-deriv", dict(Dgain=0.1, FF1=1), {"feedback-deriv": from_zero(noise(1, 2))}),
        (
            "both derivatives",
            dict(Dgain=0.1, FF1=1),
            {"command-deriv": from_zero(noise(1, 1)), "feedback-deriv": from_zero(noise(1, 2))},
        ),
        (
            "command-deriv at the index",
            dict(Dgain=0.1, FF1=1, maxcmdD=0.5),
            {"command-deriv": from_zero(noise(1, 1)), "index-enable": index},
        ),
        (
            "feedback-deriv at the index",
            dict(Dgain=0.1, FF1=1, maxcmdD=10),
            {"feedback-deriv": from_zero(noise(1, 2)), "index-enable": index},
        ),
        ("all gains and limits", every, {}),
        ("all, with enable and index-enable", every, {"enable": on, "index-enable": index}),
        (
            "all, noise and steps",
            every,
            {"command": from_zero(steps(3, 70)), "feedback": from_zero(noise(3, 3))},
        ),
    ]
    for previous in (0, 1):
        for name, settings, inputs in features:
            yield Row(
                "pid",
                f"{name}{', error-previous-target' if previous else ''}",
                {"Pgain": 0, "enable": 1, "error-previous-target": previous, **settings},
                {"command": command, "feedback": feedback, **inputs},
                outputs,
                arguments="num_chan=1 debug=1",
            )

    def odd(name, reason, bounds, settings, inputs=None):
        return Row(
            "pid",
            name,
            {"Pgain": 0, "enable": 1, "error-previous-target": 0, **settings},
            {"command": command, "feedback": feedback, **(inputs or {})},
            outputs,
            reason,
            bounds,
            arguments="num_chan=1 debug=1",
        )

    big = math.inf
    yield odd(
        "first cycle",
        "no previous cycle: ours has slopes of 0, LinuxCNC's the jump from 0",
        {
            "output": (1, 600),
            "errorD": (1, 450),
            "commandD": (1, 2e3),
            "commandDD": (2, 2e6),
            "commandDDD": (3, 4e9),
        },
        dict(FF1=0.3),
        {"command": sine(3, 300, 0.7), "feedback": triangle(1.5, 360)},
    )
    yield odd(
        "first cycle, error-previous-target",
        "the previous target: ours uses the present one, LinuxCNC's 0",
        {
            "output": (1, 4),
            "error": (1, 2),
            "errorI": (N, 0.002),
            "errorD": (1, 450),
            "commandD": (1, 2e3),
            "commandDD": (2, 2e6),
            "commandDDD": (3, 4e9),
        },
        {"Pgain": 2, "error-previous-target": 1},
        {"command": sine(3, 300, 0.7), "feedback": triangle(1.5, 360)},
    )
    yield odd(
        "maxoutput set to 0 while it limits",
        "the saturation ends in ours, but remains in LinuxCNC's and holds the integral",
        {
            "saturated": (N, 1),
            "saturated-count": (N, N),
            "saturated-s": (N, 3),
            "output": (N, 6),
            "errorI": (N, 1),
        },
        dict(Pgain=2, Igain=5),
        {"maxoutput": [(1.5, 0.0, 2.0, 4.0)[(i // 90) % 4] for i in range(N)]},
    )
    for limit, settings, pins in (
        ("maxerror", dict(Pgain=2, maxerror=-0.5), {"output": (N, 2.01), "errorI": (N, 0.31)}),
        ("maxerrorI", dict(Igain=2, maxerrorI=-0.2), {"output": (N, 1), "errorI": (N, 0.4)}),
        ("maxerrorD", dict(Dgain=0.1, maxerrorD=-5), {"output": (N, 1), "errorD": (N, 10)}),
        ("deadband", dict(Pgain=2, deadband=-0.3), {"output": (N, 1.21), "errorI": (N, 0.3)}),
    ):
        yield odd(
            f"negative {limit}",
            "ours takes the magnitude, LinuxCNC's value jumps between the limits",
            pins,
            settings,
        )
    yield odd(
        "a NaN input",
        "ours outputs 0 in that cycle and keeps its slopes, LinuxCNC's outputs NaN",
        {
            "output": (2, big),
            "error": (1, big),
            "errorD": (2, big),
            "commandD": (2, 4),
            "commandDD": (3, 4e3),
            "commandDDD": (4, 4e6),
            "errorI": (N, 0.01),
        },
        dict(Pgain=2, Igain=1, Dgain=0.1),
        {"feedback": [math.nan if i == 500 else value for i, value in enumerate(feedback)]},
    )
    yield Row(
        "pid",
        "auto-tuning of an integrator with dead time",
        {
            "error-previous-target": 1,
            "tune-effort": 1,
            "tune-cycles": 40,
            "tune-mode": 1,
            "tune-start": 1,
            "enable": 1,
        },
        {"command": [0.05] * N},
        ["f:output", "f:ultimate-gain", "f:ultimate-period"],
        "ours excludes the first two half cycles, before the oscillation is steady, from the average",
        {"output": (N, 2), "ultimate-gain": (N, 60), "ultimate-period": (N, 0.2)},
        "num_chan=1 debug=1",
        extra=(
            "loadrt integ names=plant",
            "loadrt delay names=dead",
            "setp dead.cycles 20",
            "net effort pid.0.output => plant.in",
            "net moved plant.out => dead.in",
            "net seen dead.out => pid.0.feedback",
            "addf plant t",
            "addf dead t",
        ),
    )


# --- limit3


def limit3_rows():
    wide, square = dict(min=-100, max=100), [1.5 if (i // 500) % 2 == 0 else -1.5 for i in range(N)]

    def row(name, settings, inputs, reason="", cycles=0, most=0.0):
        return Row(
            "limit3",
            name,
            settings,
            inputs,
            ["f:out"],
            reason,
            {"out": (cycles, most)} if reason else {},
            "count=1",
        )

    brakes = "the last cycles before a stop: ours brakes with maxa and stops on target, LinuxCNC's moves half of the remaining distance in each"
    meets = "meeting a moving input: ours without lag, at the input's speed"
    yield row("a step, no limit", {}, {"in": square})
    yield row("a step, maxv", dict(maxv=12), {"in": square})
    yield row(
        "load from the first cycle on", dict(maxv=12, maxa=200, load=1), {"in": sine(3, 1000)}
    )
    yield row("a step, maxa", dict(maxa=200), {"in": square}, brakes, 100, 3e-4)
    yield row("a step, maxv and maxa", dict(maxv=12, maxa=200, **wide), {"in": square})
    yield row(
        "a step beyond max",
        dict(maxv=12, maxa=200, min=-1, max=1),
        {"in": square},
        brakes,
        200,
        2e-4,
    )
    yield row(
        "a step, smooth-steps 10",
        {"maxv": 12, "maxa": 200, "smooth-steps": 10},
        {"in": square},
        "how acceleration fades out",
        500,
        0.007,
    )
    yield row(
        "a sine within the limits",
        dict(maxv=120, maxa=2000, **wide),
        {"in": sine(3, 1000)},
        meets,
        20,
        0.005,
    )
    yield row(
        "a sine beyond maxv and maxa",
        dict(maxv=12, maxa=200, **wide),
        {"in": sine(3, 1000)},
        meets,
        N,
        0.03,
    )
    yield row(
        "a sine beyond max",
        dict(maxv=120, maxa=2000, min=-2, max=2),
        {"in": sine(3, 1000)},
        "leaving a limit: ours with the input, LinuxCNC's some cycles before it returns",
        240,
        0.03,
    )
    yield row(
        "min and max only",
        dict(min=-1, max=1),
        {"in": sine(3, 1000)},
        "without maxv and maxa LinuxCNC's goes beyond min and max",
        N,
        2.0,
    )
    yield row(
        "enable",
        dict(maxv=12, maxa=200),
        {"in": sine(3, 1000), "enable": flag(200, 2, 1)},
        "an input approaching faster than maxv: ours meets it as early as possible, LinuxCNC's reverses first",
        N,
        1.25,
    )
    yield row(
        "load in motion",
        dict(maxv=12, maxa=200),
        {"in": sine(3, 1000), "load": [not on for on in flag(200, 2, 1)]},
        "leaving load: ours keeps the input's speed up to maxv, LinuxCNC's is within maxv at once",
        N,
        0.18,
    )


# --- encoder


def phases(places):
    """Phases A and B of a shaft; at 0 both are FALSE."""
    return {
        "phase-A": [((math.floor(p) + 1) & 2) != 0 for p in places],
        "phase-B": [(math.floor(p) & 2) != 0 for p in places],
    }


def encoder_rows():
    counted = ["s:counts", "f:position"]
    latched = ["s:counts-latched", "f:position-latched"]
    even, swing = [0.3 + 0.0723 * i for i in range(N)], [0.3 + p for p in sine(60, 1500)]

    def row(name, inputs, outputs, settings=None, reason="", bounds=None, slow=False):
        return Row(
            "encoder",
            name,
            {"position-scale": 40, "min-speed-estimate": 1e-6, **(settings or {})},
            inputs,
            outputs,
            reason,
            bounds or {},
            "num_chan=1",
            slow=slow,
        )

    def moving(places):
        """Starts with three edges in a row: LinuxCNC's first velocity needs them."""
        return phases([min(i, 3) + 0.3 + p for i, p in enumerate(places)])

    second = "the first velocity: ours at the second edge, LinuxCNC's at the third"
    for slow in (False, True):
        rate = ", capture-position in every tenth cycle" if slow else ""
        yield row("counts, position: there and back" + rate, phases(swing), counted, slow=slow)
        yield row(
            "velocity: one way" + rate,
            phases(even),
            ["f:velocity", "f:velocity-rpm"],
            {},
            second,
            {"velocity": (30, 4), "velocity-rpm": (30, 240)},
            slow,
        )
        yield row(
            "velocity: slower to a stop" + rate,
            moving([40 * (1 - math.exp(-i / 200)) for i in range(N)]),
            ["f:velocity"],
            {},
            second,
            {"velocity": (30, 30)},
            slow,
        )
    yield row("rawcounts", phases(swing), ["s:rawcounts"], {})
    yield row(
        "rawcounts, capture-position in every tenth cycle",
        phases(swing),
        ["s:rawcounts"],
        {},
        "ours has this cycle's count, LinuxCNC's the previous cycle's",
        {"rawcounts": (N, 1)},
        True,
    )
    yield row(
        "velocity: there and back",
        phases(swing),
        ["f:velocity"],
        {},
        "the first edge after the reversal: ours is at the same position, hence 0",
        {"velocity": (200, 7)},
    )
    yield row(
        "velocity below min-speed-estimate",
        phases(swing),
        ["f:velocity"],
        {"min-speed-estimate": 3},
        "ours is always 0 below it, LinuxCNC's only between edges; and as above",
        {"velocity": (N, 7)},
    )
    yield row(
        "position-interpolated",
        phases(even),
        ["f:position-interpolated"],
        {},
        "LinuxCNC's is one fast period ahead",
        {"position-interpolated": (N, 0.025)},
    )
    yield row(
        "position-interpolated, backwards",
        phases([1.2 - p for p in even]),
        ["f:position-interpolated"],
        {},
        "ours has the same value in both directions, LinuxCNC's is one count lower backwards",
        {"position-interpolated": (N, 0.0501)},
    )
    yield row("x4-mode FALSE", phases(even), counted, {"x4-mode": 0})
    yield row("x4-mode FALSE, there and back", phases(swing), counted, {"x4-mode": 0})
    yield row("counter-mode", phases(swing), counted, {"counter-mode": 1})
    yield row("index", {**phases(even), "phase-Z": flag(137, 5, 4)}, counted, {"index-enable": 1})
    yield row("reset", {**phases(even), "reset": flag(137, 5, 4)}, counted)
    for edge, settings in (
        ("both edges", {}),
        ("rising", {"latch-falling": 0}),
        ("falling", {"latch-rising": 0}),
    ):
        yield row(
            f"latch-input, {edge}",
            {**phases(even), "latch-input": [not on for on in flag(137, 2, 1)]},
            counted + latched,
            settings,
        )
    gap = "the first six teeth: ours counts each as one, LinuxCNC's as a gap (12 more in all later counts) or as the index"
    tooth = [i % 10 >= 5 and (i // 10) % 60 < 58 for i in range(N)]
    yield row(
        "missing-teeth",
        {"phase-A": tooth},
        counted,
        {"counter-mode": 1, "missing-teeth": 2, "position-scale": 60},
        gap,
        {"counts": (N, 12), "position": (N, 0.2001)},
    )
    yield row(
        "missing-teeth with index",
        {"phase-A": tooth},
        counted,
        {"counter-mode": 1, "missing-teeth": 2, "position-scale": 60, "index-enable": 1},
        gap,
        {"counts": (N, 72), "position": (N, 1.2001)},
    )
    yield row(
        "a phase that is TRUE in the first cycle",
        phases([p + 1 for p in even]),
        counted,
        {},
        "ours starts counting there, LinuxCNC's counts an edge",
        {"counts": (N, 1), "position": (N, 0.02501)},
    )


# --- stepgen


def stepgen_rows():
    outputs = ["b:step", "b:dir", "s:counts", "f:position-fb"]

    def row(name, inputs, settings, reason, bounds, arguments=""):
        return Row(
            "stepgen",
            name,
            {"position-scale": 100, "enable": 1, **settings},
            inputs,
            outputs,
            reason,
            bounds,
            "step_type=0" + arguments,
            slow=True,
        )

    fine = "our position-fb is exact, LinuxCNC's has fixed-point steps"
    even = "our speed changes within a fast period, LinuxCNC's at its end; "
    yield row("disabled", {"position-cmd": [1.0] * N}, {"enable": 0}, "", {})
    yield row(
        "velocity, maxaccel",
        {"velocity-cmd": [1.0] * N},
        dict(maxvel=4, maxaccel=60),
        even + fine,
        {"step": (10, 1), "counts": (10, 1), "position-fb": (N, 6e-4)},
        " ctrl_type=v",
    )
    yield row(
        "velocity, no maxaccel",
        {"velocity-cmd": [1.0] * N},
        dict(maxvel=4),
        "ours at once, LinuxCNC's within an update, 0.08 of a step later; " + fine,
        {"step": (600, 1), "counts": (600, 1), "position-fb": (N, 9e-4)},
        " ctrl_type=v",
    )
    yield row(
        "velocity, there and back",
        {"velocity-cmd": sine(3, 2000)},
        dict(maxvel=4, maxaccel=60),
        "our dir changes with the first step back, LinuxCNC's with the speed; " + even + fine,
        {"step": (600, 1), "dir": (60, 1), "counts": (500, 1), "position-fb": (N, 2e-3)},
        " ctrl_type=v",
    )
    yield row(
        "position, a move",
        {"position-cmd": [0.5] * N},
        dict(maxvel=4, maxaccel=60),
        "the speed law distributes braking differently; dir as above",
        {"step": (100, 1), "dir": (N, 1), "counts": (100, 1), "position-fb": (N, 0.012)},
    )
    yield row(
        "position, following",
        {"position-cmd": sine(0.3, 2000)},
        dict(maxvel=20, maxaccel=500),
        "the speed law: ours lags the command by one update, LinuxCNC's by two and a half",
        {"step": (400, 1), "dir": (200, 1), "counts": (N, 2), "position-fb": (N, 0.015)},
    )

    there_and_back = [1.0 if i < 900 else -1.5 for i in range(N)]
    for kind in range(1, 15):
        phases_of = 2 if kind == 2 else 3 if kind < 5 else 4 if kind < 11 else 5
        pins = ["up", "down"] if kind == 1 else [f"phase-{name}" for name in "ABCDE"[:phases_of]]
        yield Row(
            "stepgen",
            f"step type {kind}: sequence of output states",
            {"position-scale": 100, "enable": 1, "maxvel": 4, "maxaccel": 60},
            {"velocity-cmd": there_and_back},
            [f"b:{pin}" for pin in pins],
            arguments=f"step_type={kind} ctrl_type=v",
            slow=True,
            in_order=True,
        )


# --- pwmgen


def pwmgen_rows():
    wave, still = sine(1.5, 1430), [0.7] * N

    def row(name, type_, inputs, settings, reason="", bounds=None, later=0):
        pins = [["b:pwm"], ["b:pwm", "b:dir"], ["b:up", "b:down"]][type_]
        return Row(
            "pwmgen",
            name,
            {"scale": 2.5, "enable": 1, **settings},
            inputs,
            pins + ["f:curr-dc"],
            reason,
            bounds or {},
            f"output_type={type_}",
            later=later,
        )

    start = "LinuxCNC's first period is blank"
    taken = "ours takes a value one cycle later; " + start
    for rate in (50, 60, 333):
        for value in (0.7, 0.0, 2.5):
            yield row(
                f"PWM {rate} Hz, value {value:g}, one cycle later",
                0,
                {"value": [value] * N},
                {"pwm-freq": rate},
                start if value else "",
                {"pwm": (20, 1)} if value else {},
                later=1,
            )
    yield row(
        "PWM, a moving value",
        0,
        {"value": wave},
        {"pwm-freq": 50},
        "our periods begin one cycle later; " + start,
        {"pwm": (160, 1)},
    )
    yield row(
        "PWM, a moving value, one cycle later",
        0,
        {"value": wave},
        {"pwm-freq": 50},
        taken,
        {"pwm": (20, 1), "curr-dc": (N, 0.1)},
        later=1,
    )
    yield row(
        "PWM and direction",
        1,
        {"value": wave},
        {"pwm-freq": 50},
        "our dir changes with a period; our periods begin one cycle later",
        {"pwm": (300, 1), "dir": (40, 1)},
    )
    yield row(
        "PWM up and down",
        2,
        {"value": wave},
        {"pwm-freq": 50},
        "as above",
        {"up": (160, 1), "down": (160, 1)},
    )
    yield row(
        "PWM dithered",
        0,
        {"value": still},
        {"pwm-freq": 60, "dither-pwm": 1},
        "the positions of the longer periods and pulses; " + start,
        {"pwm": (300, 1)},
    )
    yield row(
        "PDM",
        0,
        {"value": wave},
        {},
        "the first pulse: ours when the duty cycles add up to one",
        {"pwm": (1, 1)},
    )
    yield row(
        "PDM, a constant value",
        0,
        {"value": still},
        {},
        "rounding: which of two cycles has the pulse when the duty cycles add up to exactly one",
        {"pwm": (240, 1)},
    )
    yield row(
        "PDM and direction",
        1,
        {"value": wave},
        {},
        "our dir changes with its pulse, LinuxCNC's one cycle earlier",
        {"pwm": (1, 1), "dir": (4, 1)},
    )
    yield row(
        "offset, min-dc, max-dc",
        1,
        {"value": wave},
        {"offset": 0.1, "min-dc": 0.1, "max-dc": 0.5},
        "dir and the first pulse, as above",
        {"pwm": (1, 1), "dir": (4, 1)},
    )
    yield row(
        "enable",
        1,
        {"value": wave, "enable": flag(130, 3, 1)},
        {},
        "our dir is FALSE and curr-dc 0 while disabled",
        {"pwm": (20, 1), "dir": (N, 1), "curr-dc": (N, 0.6)},
    )
    yield row(
        "scale 2 before the first cycle",
        0,
        {"value": still},
        {"scale": 2},
        "LinuxCNC's treats it as unchanged and outputs 0",
        {"pwm": (N, 1), "curr-dc": (N, 0.35)},
    )


CASES = {
    "pid": pid_rows,
    "limit3": limit3_rows,
    "encoder": encoder_rows,
    "stepgen": stepgen_rows,
    "pwmgen": pwmgen_rows,
}
