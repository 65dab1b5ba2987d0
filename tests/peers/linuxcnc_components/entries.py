# SPDX-License-Identifier: MIT
"""The intended differences; see expected.py."""

import math

from .expected import behaviour, inventory

LINKABLE = "as a read-only parameter it could not be linked; `getp` reads both"

for component, names in {
    "axistest": "elapsed",
    "steptest": "elapsed",
    "carousel": "homing|motor-dir|state|timer",
    "edge": "last-in|time-left-ns",
    "mux16": "elapsed|selected",
    "mux_generic": "elapsed|selected",
    "stepgen": "frequency|rawcounts",
}.items():
    inventory(component, names, "output pin", "read-only parameter", LINKABLE)
inventory(
    "lowpass",
    "gain",
    "input pin",
    "writable parameter",
    "as a parameter it could not be linked; `setp` sets both",
)
inventory(
    "watchdog", "tripped-by", "the number of the input that timed out", "missing", "an addition"
)
inventory("estop_latch", "reason", "what tripped the latch", "missing", "an addition")

behaviour(
    "wcomp",
    "out",
    lambda v: v.invalid("in", "min", "max"),
    "an input is NaN",
    "FALSE",
    "TRUE",
    "a value that is not a number is not inside a window",
    ("wcomp", {"wcomp.0.in": [float("nan")], "wcomp.0.min": [-1.0], "wcomp.0.max": [1.0]}, {}),
)
behaviour(
    "watchdog",
    "ok-out",
    lambda v: not v["enable-in"]
    or v.cycle == 0
    or min(v.all("timeout-0", "timeout-1")) <= 0
    or v.invalid("timeout-0", "timeout-1"),
    "`enable-in` is FALSE; a timeout is 0 or less; the first cycle, before `set-timeouts`",
    "FALSE",
    "continues after `enable-in`; TRUE for a cycle",
    "a watchdog that is off or not configured must not report OK",
    lasts=True,
    witness=(
        "watchdog num_inputs=2",
        {
            "watchdog.enable-in": [True] * 20 + [False],
            "watchdog.input-0": [False, True] * 200,
            "watchdog.input-1": [False, True] * 200,
        },
        {"watchdog.timeout-0": 0.01, "watchdog.timeout-1": 0.01},
    ),
)
LAST_COUNTS = {2147483647, -2147483648}


def reaches_the_last_count(v):
    """True if the limits let `count` be the largest or the smallest number of an s32."""
    if v["wrap"]:
        return bool({v["max"], v["min"]} & LAST_COUNTS)
    return v["clamp"] and (v["min"] == 2147483647 or v["max"] == -2147483648)


behaviour(
    "updown",
    "count",
    reaches_the_last_count,
    "counting beyond 2147483647 or -2147483648 with `wrap` or `clamp`",
    "continues at `min` or `max`, or stays",
    "overflows",
    "an overflow that the limits should prevent",
    lasts=True,
    witness=(
        "updown",
        {"updown.0.countdown": [False, True], "updown.0.countup": [False, False, False, True]},
        {"updown.0.wrap": True},
    ),
)
behaviour(
    "threadtest",
    "count",
    lambda v: True,
    "`reset` runs after `increment`",
    "the reset takes effect in the next run of `increment`",
    "in the same cycle",
    "each function writes its own memory, so that both may be in different threads",
    ("threadtest", {}, {}),
)
for component in ("steptest", "axistest"):
    behaviour(
        component,
        "run-target",
        lambda v: True,
        "always",
        "the commanded position",
        "0",
        "the pin is documented in LinuxCNC, and never written",
        (component, {f"{component}.0.run": [True], f"{component}.0.amplitude": [1.0]}, {}),
    )
behaviour(
    "simple_tp",
    "active|current-pos|current-vel",
    lambda v: not (v["maxvel"] >= 0 and v["maxaccel"] >= 0) or v.beyond(1e12),
    "`maxvel` or `maxaccel` is negative or NaN",
    "counts as 0",
    "NaN in `current-pos`, or motion away from the target",
    "a position must not become NaN",
    lasts=True,
    witness=(
        "simple_tp",
        {
            "simple-tp.0.enable": [True],
            "simple-tp.0.target-pos": [1.0],
            "simple-tp.0.maxvel": [1.0],
            "simple-tp.0.maxaccel": [-1.0],
        },
        {},
    ),
)
behaviour(
    "sim_spindle",
    "position-fb|index-enable",
    lambda v: v.invalid() or v.beyond(1e18),
    "the speed is NaN or infinite",
    "the position is held",
    "the position becomes NaN",
    "a position must not become NaN",
    ("sim_spindle", {"sim-spindle.0.velocity-cmd": [1.0, float("nan"), 1.0]}, {}),
    lasts=True,
)
behaviour(
    "spindle_monitor",
    "spindle-underspeed",
    lambda v: v["spindle-command"] < 0 or v.invalid(),
    "a negative command; a NaN",
    "compared in the direction of the command; a NaN is an underspeed",
    "-110 is an underspeed of -100, and -80 is not",
    "LinuxCNC's does not detect an underspeed in reverse",
    lasts=True,
    witness=(
        "spindle_monitor",
        {
            "spindle-monitor.0.spindle-is-on": [True],
            "spindle-monitor.0.spindle-command": [-100.0],
            "spindle-monitor.0.spindle-feedback": [-100.0] * 5 + [-80.0],
        },
        {"spindle-monitor.0.threshold": 5.0},
    ),
)
behaviour(
    "sim_axis_hardware",
    "A(maxsw|minsw|bothsw)-homesw-out",
    lambda v: True,
    "always",
    "work",
    "FALSE",
    "LinuxCNC's does not write them",
    ("sim_axis_hardware", {"sim-axis-hardware.0.Acurrent-pos": [1.0]}, {}),
)
behaviour(
    "sphereprobe",
    "probe-out",
    lambda v: v.beyond(1e9),
    "coordinates beyond ±1e9 counts",
    "exact",
    "differences overflow",
    "a contact must not depend on an overflow",
    (
        "sphereprobe",
        {
            "sphereprobe.0.px": [2147483647],
            "sphereprobe.0.cx": [-2147483648],
            "sphereprobe.0.r": [5],
        },
        {},
    ),
)
behaviour(
    "ohmic",
    "ohmic-on|ohmic-volts|thcad-volts|arc-on",
    lambda v: v["thcad-max-volt-freq"] == v["thcad-0-volt-freq"]
    or v["thcad-divide"] == 0
    or v["thcad-fullscale"] == 0
    or v.beyond(1e12),
    "the two frequencies are equal, as before they are set; a divisor is 0; a NaN",
    "voltages are 0",
    "infinite or NaN",
    "a voltage must not become NaN",
    lasts=True,
    witness=("ohmic", {"ohmic.0.velocity-in": [100.0]}, {}),
)
behaviour(
    "ohmic",
    "ohmic-on",
    lambda v: v["is-probing"],
    "probing",
    "compares with `ohmic-threshold`",
    "compares with 1",
    "2.10's; its documentation is the same",
    lasts=True,
    versions=("2.9",),
    witness=(
        "ohmic",
        {
            "ohmic.0.is-probing": [True],
            "ohmic.0.velocity-in": [300.0],
            "ohmic.0.thcad-max-volt-freq": [900.0],
            "ohmic.0.thcad-divide": [1.0],
        },
        {},
    ),
)
behaviour(
    "multiclick",
    ".*-click|.*-click-only",
    lambda v: v["output-hold-ns"] == 0,
    "`output-hold-ns` is 0",
    "a pulse of one cycle",
    "the output remains TRUE",
    "a pulse has an end",
    lasts=True,
    witness=(
        "multiclick",
        {"multiclick.0.in": [False, True, True, False]},
        {"multiclick.0.output-hold-ns": 0},
    ),
)
behaviour(
    "limit1",
    "out",
    lambda v: v.invalid("min", "max"),
    "`min` or `max` is NaN",
    "its last valid value applies, and a fault is raised",
    "the limit is gone",
    "a limit must hold",
    witness=("limit1", {"limit1.0.in": [1.0], "limit1.0.max": [0.5, float("nan")]}, {}),
)
behaviour(
    "limit2",
    "out",
    lambda v: not v["maxv"] >= 0 or v.beyond(1e18, "in", "max", "min", "maxv"),
    "`maxv` is negative; an input is NaN or infinite",
    "the output is held",
    "moves away from the input; NaN",
    "a limit must hold",
    lasts=True,
    witness=("limit2", {"limit2.0.in": [1.0], "limit2.0.maxv": [-10.0]}, {}),
)
behaviour(
    "lincurve",
    "out|out-io",
    lambda v: v.invalid()
    or any(
        b < a
        for a, b in zip(
            v.all("x-val-00", "x-val-01", "x-val-02"), v.all("x-val-01", "x-val-02", "x-val-03")
        )
    ),
    "`in` is NaN; the points are not in ascending order",
    "the output is held; each pair of points is a segment",
    "NaN; depends on earlier inputs, and reads beyond the points",
    "an output must not become NaN; no access outside of the points",
    lasts=True,
    witness=(
        "lincurve personality=4",
        {"lincurve.0.in": [float("nan")]},
        {"lincurve.0.x-val-03": 1.0, "lincurve.0.y-val-00": 2.0},
    ),
)
behaviour(
    "lincurve",
    "out|out-io",
    lambda v: any(
        v["in"] == a == b
        for a, b in zip(
            v.all("x-val-00", "x-val-01", "x-val-02"), v.all("x-val-01", "x-val-02", "x-val-03")
        )
    ),
    "`in` is exactly at two points of the same x",
    "the second point's value",
    "the value of the point that it was next to before",
    "the same input gives the same output",
    witness=(
        "lincurve personality=4",
        {"lincurve.0.in": [0.0, 1.0]},
        {
            "lincurve.0.x-val-00": -1.0,
            "lincurve.0.x-val-03": 3.0,
            "lincurve.0.y-val-02": 3.0,
        },
    ),
)
behaviour(
    "modmath",
    "up|down|on-target",
    lambda v: v.beyond(1e9) or v["max-num"] < v["min-num"],
    "positions beyond ±1e9; `max-num` is below `min-num`",
    "computed in 64 bits",
    "overflows; divides by 0",
    "a division by 0 ends the process",
    lasts=True,
    witness=(
        "modmath mod_dir=1",
        {"mod-dir.0.actual": [1], "mod-dir.0.desired": [-1]},
        {"mod-dir.0.max-num": 2147483647, "mod-dir.0.min-num": -100},
    ),
)
behaviour(
    "histobins",
    "mean|variance",
    lambda v: True,
    "always",
    "include the first value",
    "divide by its number, and leave it out of the sum",
    "a wrong mean",
    ("histobins", {"histobins.0.input": [2.0]}, {}),
)
behaviour(
    "histobins",
    ".*",
    lambda v: not v["binsize"] > 0 or v.invalid(),
    "`binsize` is not above 0; a value is NaN or infinite",
    "`input-error`, and the outputs are held",
    "writes outside of its memory",
    "a setting must not damage memory",
    lasts=True,
    witness=("histobins", {"histobins.0.binsize": [-1.0], "histobins.0.input": [2.0]}, {}),
)
behaviour(
    "histobins",
    ".*",
    lambda v: v["pintype"] not in (1, 2, 3) and v.beyond(1e150, "input"),
    "`input` is beyond ±1e150",
    "`input-error`, and the outputs are held",
    "the value is counted, and `variance` is infinite or NaN until a reset",
    "its square is beyond the range of float",
    lasts=True,
    witness=("histobins", {"histobins.0.input": [1.0, 1e200, 2.0]}, {}),
)


def beyond_last_of_200_bins(v):
    """True for a value that is not above the upper edge, and whose bin would be the next after the last one."""
    if v["nbins"] != 200 or not v["binsize"] > 0:
        return False
    names = {1: "input-s32", 2: "input-u32", 3: "input-bit"}
    value = float(v[names.get(v["pintype"], "input")])
    upper = v["minvalue"] + 200 * v["binsize"]
    return value <= upper and (value - v["minvalue"]) / v["binsize"] >= 200


behaviour(
    "histobins",
    ".*",
    beyond_last_of_200_bins,
    "`nbins` is 200, and the value is the upper edge of the last bin",
    "in no bin",
    "writes outside of its memory: counting starts again",
    "a value must not damage memory",
    lasts=True,
    witness=(
        "histobins",
        {
            "histobins.0.nbins": [200],
            "histobins.0.binsize": [0.1],
            "histobins.0.minvalue": [-10.0],
            "histobins.0.input": [1.0, 2.0, 10.0, 3.0],
        },
        {},
    ),
)
behaviour(
    "lowpass",
    "out",
    lambda v: v.invalid(),
    "an input is NaN or infinite",
    "the cycle is skipped",
    "the output is NaN for ever",
    "the filter recovers",
    lasts=True,
    witness=("lowpass", {"lowpass.0.in": [1.0, float("nan"), 1.0]}, {"lowpass.0.gain": 0.5}),
)
behaviour(
    "ilowpass",
    "out",
    lambda v: v.invalid() or v.beyond(1e100),
    "`gain` or `scale` is NaN or infinite",
    "the cycle is skipped",
    "0 for ever",
    "the filter recovers",
    lasts=True,
    witness=("ilowpass", {"ilowpass.0.in": [5]}, [{}, {"ilowpass.0.gain": float("nan")}]),
)


def has_reached_infinity(v):
    """True if gains outside of 0 to 2 have multiplied the filter's state beyond the range of float."""
    now, exponent, reached = v.cycle, 0.0, False
    for cycle in range(now + 1):
        factor = abs(1 - v.at(cycle)["gain"])
        exponent = max(0.0, exponent + math.log10(factor)) if factor > 0 else 0.0
        reached = reached or exponent > 290
    v.at(now)
    return reached


behaviour(
    "ilowpass",
    "out",
    has_reached_infinity,
    "a `gain` outside of 0 to 2 lets the state become infinite",
    "the cycle is skipped",
    "0 for ever",
    "the filter recovers",
    lasts=True,
    witness=(
        "ilowpass",
        {"ilowpass.0.in": [5]},
        [{"ilowpass.0.gain": 100.0}, {}, {}, {}, {"ilowpass.0.gain": 1.0}, {}, {}, {}],
    ),
)

SATURATED = "a conversion keeps the sign of the value and its order"
WRAPPED = "the result is the same on every processor"
HELD = "an output must not become NaN"

behaviour(
    "siggen",
    "sine|cosine",
    lambda v: True,
    "always",
    "double precision",
    "2 pi has eight digits",
    "constants have all digits",
    ("siggen num_chan=1", "plain"),
    within=1e-7,
    reference=lambda v: abs(v["amplitude"]),
)


# The difference from the command is 0.125 + 1e-9, which in single precision is the tolerance.
AT_TOLERANCE = (
    "spindle",
    {
        "spindle.0.actual-speed": [(1.125 + 1e-9) / 60, 1 / 60],
        "spindle.0.commanded-speed": [1.0],
        "spindle.0.enable": [True],
        "spindle.0.decel.0": [0.01],
        "spindle.0.speed-tolerance.0": [0.125, 0.0],
        "spindle.0.spindle-lpf": [10.0],
    },
    {},
)


def spindle_speed(v):
    return max(v.largest("commanded-speed", "min.0"), 60 * v.largest("actual-speed"))


for pins, scale in (
    ("spindle-rpm|spindle-rpm-abs", lambda v: 1.0),
    ("output", lambda v: abs(v["scale.0"])),
):
    behaviour(
        "spindle",
        pins,
        lambda v: True,
        "always",
        "double precision",
        "single precision: differs from the eighth digit on, more after a ramp of many cycles",
        "speeds have all digits",
        ("spindle", "edges"),
        within=1.2e-7,
        reference=lambda v, scale=scale: spindle_speed(v) * scale(v) * (v.cycle + 1),
    )
    behaviour(
        "spindle",
        pins,
        lambda v: True,
        "a speed within the last digits of a tolerance",
        "double precision",
        "single precision: some cycles earlier or later",
        "speeds have all digits",
        AT_TOLERANCE,
        most_cycles=60,
        within=1.001,
        reference=lambda v, scale=scale: v.largest("speed-tolerance.0") * scale(v),
    )
behaviour(
    "spindle",
    ".*",
    lambda v: any(
        0 < abs(limit) < 1e-37 for limit in v.all("min.0", "max.0", "accel.0", "decel.0")
    ),
    "a limit below 1e-37",
    "applies",
    "0 in single precision: does not apply",
    "a limit must hold",
    (
        "spindle",
        {
            "spindle.0.commanded-speed": [0.005],
            "spindle.0.enable": [True],
            "spindle.0.accel.0": [1e-300],
            "spindle.0.speed-tolerance.0": [0.0],
        },
        {},
    ),
    lasts=True,
)


def spindle_target(v):
    return v["commanded-speed"] if v["enable"] else 0.0


def spindle_is_limited(v):
    magnitude = abs(spindle_target(v))
    return magnitude > 0 and (magnitude < v["min.0"] or magnitude > v["max.0"] > 0)


behaviour(
    "spindle",
    "output",
    lambda v: spindle_target(v) == 0 or 60 * abs(v["actual-speed"]) > v["max.0"] > 0,
    "the spindle is off or stops; the measured speed is above `max`",
    "0 while it is off, does not rise on the way to 0, is at most `max`",
    "the measured speed minus `decel`",
    "an encoder must not drive a spindle",
    (
        "spindle",
        {"spindle.0.actual-speed": [200.0], "spindle.0.decel.0": [100.0]},
        {},
    ),
)
behaviour(
    "spindle",
    ".*",
    spindle_is_limited,
    "`min`, `max` or the gear changes at speed; `commanded-speed` is beyond them",
    "follows `accel` and `decel`",
    "jumps while `at-speed`",
    "a spindle must not jump",
    (
        "spindle",
        {
            "spindle.0.simulate-encoder": [True],
            "spindle.0.commanded-speed": [1000.0],
            "spindle.0.enable": [True],
            "spindle.0.decel.0": [100.0],
            "spindle.0.max.0": [0.0] * 10 + [500.0],
        },
        {},
    ),
    lasts=True,
)
behaviour(
    "comp",
    "equal|out",
    lambda v: v.invalid(),
    "an input is NaN",
    "FALSE",
    "`equal` is TRUE",
    "a NaN is not equal to a number",
    ("comp", "wild"),
    lasts=True,
)
for component, held in (("scaled_s32_sums", False), ("mux16", True)):
    behaviour(
        component,
        "out-s",
        lambda v: v.beyond(1e6),
        "the value is beyond the range of s32, or NaN",
        "limited to the range; 0 for NaN",
        "-2147483648",
        SATURATED,
        (component, "wild"),
        lasts=held,
    )
behaviour(
    "hypot",
    "out",
    lambda v: v.beyond(1e150),
    "an input is beyond 1e150",
    "exact",
    "infinite",
    "no overflow within",
    ("hypot", "wild"),
)
for component, divisor, streams in (
    ("invert", "in", {"invert.0.in": [0.0]}),
    ("div2", "in1", {"div2.0.in0": [1.0], "div2.0.in1": [0.0]}),
):
    behaviour(
        component,
        "out|deadband",
        lambda v: math.isnan(v["deadband"]),
        "`deadband` is NaN",
        "1e-12",
        f"NaN: an `{divisor}` of 0 gives infinity",
        "an output must not become infinite",
        (component, streams, {f"{component}.0.deadband": float("nan")}),
    )
behaviour(
    "minmax",
    "max|min",
    lambda v: v.invalid(),
    "`in` is NaN during `reset`",
    "the cycle is skipped",
    "NaN until the next reset",
    HELD,
    ("minmax", "wild"),
    lasts=True,
)
behaviour(
    "orient",
    "command|poserr|is-oriented",
    lambda v: v.invalid() or v.beyond(1e9),
    "an input is NaN or infinite",
    "`command` is held",
    "`command` is NaN or infinite",
    HELD,
    ("orient", "wild"),
    lasts=True,
)
behaviour(
    "ddt",
    "out",
    lambda v: v.invalid(),
    "`in` is NaN or infinite",
    "0",
    "NaN",
    HELD,
    ("ddt", "wild"),
    lasts=True,
)
behaviour(
    "lcd",
    "out",
    lambda v: True,
    "always",
    "the same text",
    "control characters in another order",
    "the display shows the same",
    ("lcd fmt_strings=%d", "plain"),
)
inventory(
    "toggle2nist",
    "debounce|max-pulse-length",
    "input pins of 2.10",
    "missing",
    "newer",
    versions=("2.9",),
)


def at_minimum_velocity(v):
    """True if single precision may decide whether the torch moves at the requested velocity."""
    requested = v["requested-vel"]
    minimum = requested * (1 - v["velocity-tol"] * 0.01)
    near = abs(v["current-vel"] - minimum) <= 1.2e-7 * abs(requested) + 1e-37
    return near or abs(minimum) > 3e38


for component in ("thc", "thcud"):
    behaviour(
        component,
        "vel-status",
        lambda v: not v["enable"],
        "`enable` is FALSE",
        "FALSE",
        "keeps its value",
        "the pin reports a state of the control, which is off",
        (component, "plain"),
    )
    behaviour(
        component,
        "vel-status",
        at_minimum_velocity,
        "`current-vel` is within the last digits of the lowest velocity, or that is beyond 3e38",
        "double precision, as in 2.10",
        "single precision",
        "2.10's",
        (
            component,
            {
                f"{component}.enable": [True],
                f"{component}.current-vel": [0.1],
                f"{component}.requested-vel": [0.1],
            },
            {},
        ),
        versions=("2.9",),
    )

behaviour(
    "biquad",
    ".*",
    lambda v: not v["f0"] > 0 or not v["Q"] > 0 or v.invalid() or v.beyond(1e12),
    "`f0` is 0 or below; a NaN",
    "`valid` is FALSE, `out` recovers",
    "the filter diverges",
    HELD,
    ("biquad", "edges"),
    lasts=True,
)
behaviour(
    "siggen",
    "clock|square|sawtooth|triangle|sine|cosine",
    lambda v: v["frequency"] < 0 or v.invalid() or v.beyond(1e12),
    "a negative frequency; a NaN",
    "the waves run backwards; the phase is held",
    "`sawtooth` and `triangle` leave their range; NaN for ever",
    "the waves stay within `amplitude`",
    ("siggen num_chan=1", "plain"),
    lasts=True,
)
inventory("sim_encoder", "rawcounts", "output pin", "input pin", "the component writes it")
behaviour(
    "feedcomp",
    "out",
    lambda v: v["feed"] == 0 or v.invalid() or v.beyond(1e100),
    "`feed` is 0",
    "`in`",
    "infinite or NaN",
    HELD,
    ("feedcomp", "plain"),
)
behaviour(
    "integ",
    "out",
    lambda v: v.invalid() or v.beyond(1e18, "in", "gain"),
    "an input is NaN or infinite",
    "the cycle is skipped",
    "NaN for ever",
    HELD,
    ("integ", "wild"),
    lasts=True,
)
behaviour(
    "demux",
    "out-31",
    lambda v: v["bargraph"] or v.beyond(2147480000, "sel-u32"),
    "a bar of all outputs",
    "all TRUE",
    "the last output is FALSE",
    "a bar could not be full",
    ("demux", "edges"),
)
behaviour(
    "demux",
    "out-.*",
    lambda v: v.beyond(2147480000, "sel-u32"),
    "`sel-u32` beyond 2147483647",
    "the last output",
    "none, the sum is negative",
    "as for every selection above the last output",
    ("demux", "wild"),
)
behaviour(
    "filter_kalman",
    "xk-out",
    lambda v: v["Rk"] < 0
    or v["Qk"] < 0
    or (v["Rk"] == 0 and v["Qk"] == 0)
    or v.invalid()
    or v.beyond(1e12),
    "`Rk` or `Qk` is negative, or both are 0; a NaN",
    "counts as 0; is ignored",
    "the estimate diverges",
    "a variance is not negative",
    ("filter_kalman", "edges"),
    lasts=True,
)
behaviour(
    "timedelay",
    "out|elapsed",
    lambda v: v.invalid(),
    "a delay is NaN",
    "counts as 0",
    "`out` never changes",
    "a relay must not stick",
    ("timedelay", "wild"),
    lasts=True,
)
behaviour(
    "knob2float",
    "out",
    lambda v: v.beyond(1e9) or v.invalid(),
    "counts that wrap around; a NaN",
    "the difference in 32 bits",
    "overflows",
    "counts wrap around",
    ("knob2float", "wild"),
    lasts=True,
)
inventory("carousel", "debounce", "writable", "read-only", "a time that is set by the user")
behaviour(
    "sim_encoder",
    "scale",
    lambda v: v["scale"] == 0,
    "`scale` is 0",
    "1",
    "-0 remains",
    "a division by 0",
    ("sim_encoder num_chan=1", {}, {"sim-encoder.0.scale": -0.0}),
)
behaviour(
    "clarkeinv",
    "a|b|c",
    lambda v: True,
    "always",
    "whole turns of `theta` are removed first, and the constants are exact",
    "2 pi has ten digits, constants have fifteen",
    "an angle keeps its digits over many turns",
    ("clarkeinv", "plain"),
    within=1e-9,
    reference=lambda v: (abs(v["x"]) + abs(v["y"])) * abs(v["theta"])
    + 1e-5 * (abs(v["x"]) + abs(v["y"]) + abs(v["h"])),
)
behaviour(
    "clarkeinv",
    "a|b|c",
    lambda v: v.invalid("x", "y"),
    "`x` or `y` is infinite",
    "NaN at whole turns of `theta`: infinity times 0",
    "infinite: its sine is not 0 there",
    "an angle keeps its digits over many turns",
    ("clarkeinv", {"clarkeinv.0.x": [float("inf")], "clarkeinv.0.theta": [1.0]}, {}),
)
for component, third in (("clarke2", {}), ("clarke3", {"clarke3.0.c": [-2147483648.0]})):
    behaviour(
        component,
        "x|y|h",
        lambda v: v.beyond(1e6),
        "inputs beyond 1e6 that cancel each other; a NaN",
        "exact to the last digit",
        "another order of the sum",
        "the order of a sum is not specified",
        (
            component,
            {
                f"{component}.0.a": [4294967296.0 if component == "clarke2" else 0.00863335458],
                f"{component}.0.b": [-2147483648.0 if component == "clarke2" else 2147483648.0],
                **third,
            },
            {},
        ),
    )
behaviour(
    "abs",
    "sign",
    lambda v: v.invalid(),
    "`in` is NaN",
    "FALSE",
    "TRUE",
    "a NaN has no sign",
    ("abs", "wild"),
)
behaviour(
    "abs_s32",
    "out",
    lambda v: v["in"] == -2147483648,
    "-2147483648",
    "2147483647",
    "-2147483648",
    "an absolute value is not negative",
    ("abs_s32", "wild"),
)
behaviour(
    "conv_float_s32",
    "out",
    lambda v: v.beyond(2147483647),
    "beyond the range of s32; a NaN",
    "wraps around, as documented; 0 for NaN",
    "-2147483648",
    WRAPPED,
    ("conv_float_s32", "wild"),
)
behaviour(
    "conv_float_s32",
    "out-of-range",
    lambda v: v.beyond(2147483647),
    "beyond the range of s32; a NaN",
    "wraps around, as documented; 0 for NaN",
    "-2147483648",
    WRAPPED,
    ("conv_float_s32", "wild"),
    lasts=True,
)
behaviour(
    "conv_float_u32",
    "out",
    lambda v: v.beyond(2147483647) or v["in"] < 0,
    "beyond 2147483647; a NaN; negative",
    "wraps around, or with `clamp` is limited to the range",
    "0, or 2147483647 with `clamp`",
    WRAPPED,
    ("conv_float_u32", "wild"),
)
behaviour(
    "conv_float_u32",
    "out-of-range",
    lambda v: v.beyond(2147483647) or v["in"] < 0,
    "beyond 2147483647; a NaN; negative",
    "wraps around, or with `clamp` is limited to the range",
    "0, or 2147483647 with `clamp`",
    WRAPPED,
    ("conv_float_u32", "wild"),
    lasts=True,
)
behaviour(
    "conv_s32_u32",
    "out-of-range",
    lambda v: v["in"] < 0,
    "a negative value",
    "TRUE",
    "FALSE",
    "a value that wraps around is out of range",
    ("conv_s32_u32", "edges"),
    lasts=True,
)
behaviour(
    "conv_u32_s32",
    "out-of-range",
    lambda v: v["in"] > 2147483647,
    "beyond 2147483647",
    "TRUE",
    "FALSE",
    "a value that wraps around is out of range",
    ("conv_u32_s32", "wild"),
    lasts=True,
)
behaviour(
    "joyhandle",
    "out",
    lambda v: v["inverse"] and v["in"] < 0 or v.invalid() or v.beyond(1e6),
    "`inverse`, and `in` is negative; a NaN; `power` beyond 1e3",
    "the curve has the same shape on both sides",
    "another shape: minus three times `offset`",
    "a handle is symmetrical",
    ("joyhandle", "wild"),
)
behaviour(
    "multiswitch",
    "bit-.*|position",
    lambda v: v["top-position"] >= 2147483647 or v["position"] == -2147483648,
    "`top-position` 2147483647 or beyond, `position` -2147483648",
    "0 is the first position, and follows the last one",
    "-1 is a position; the last one overflows",
    "a position is not negative",
    ("multiswitch personality=3", "wild"),
    lasts=True,
)
behaviour(
    "mux_generic",
    "out-.*",
    lambda v: v.beyond(2147483647),
    "`sel-int` beyond the number of inputs; a value beyond the range",
    "the last input; limited",
    "undefined",
    "a selection must not read other memory",
    (
        "mux_generic config=su4",
        {"mux-gen.00.sel-int": [4294967295], "mux-gen.00.in-s32-03": [5]},
        {},
    ),
    lasts=True,
)
for names in ("in-type|out-type|offset-measured",):
    inventory("bldc", names, "output pin", "read-only parameter", LINKABLE)
inventory("thcud", "correction-vel", "input pin", "parameter", "2.10's", versions=("2.9",))
behaviour(
    "spindle",
    "brake",
    lambda v: True,
    "always",
    "as documented",
    "FALSE",
    "its manual page documents it",
    ("spindle", "plain"),
)
behaviour(
    "spindle",
    "reverse",
    lambda v: not v["enable"] or v.changed("commanded-speed", "enable"),
    "a spindle that turns backwards decelerates",
    "TRUE until it stops",
    "becomes FALSE at once",
    "the spindle must not coast",
    ("spindle", "plain"),
    lasts=True,
)
behaviour(
    "spindle",
    ".*",
    lambda v: v["select-gear"] > 0 or v.invalid() or v.beyond(1e9),
    "`select-gear` beyond the last gear; a NaN",
    "the last gear; counts as 0",
    "reads pins that do not exist; NaN for ever",
    "a selection must not read other memory",
    ("spindle", "wild"),
    lasts=True,
)
behaviour(
    "thc",
    "offset-value|z-pos-out|z-fb-out",
    lambda v: not v["enable"] or not v["torch-on"] or v.invalid(),
    "`enable` or `torch-on` is FALSE",
    "the correction is removed as documented",
    "removed in one cycle, or returned at once",
    "the torch must not jump",
    ("thc", "edges"),
    lasts=True,
)
behaviour(
    "thcud",
    "cur-offset|z-pos-out|z-fb-out|removing-offset",
    lambda v: not v["enable"] or not v["torch-on"] or v.invalid(),
    "`enable` or `torch-on` is FALSE",
    "the correction is removed as documented",
    "removed in one cycle",
    "the torch must not jump",
    ("thcud", "plain"),
    lasts=True,
    versions=("2.10",),
)
behaviour(
    "eoffset_per_angle",
    ".*",
    lambda v: v["angle"] < 0 or not v["is-on"] or v.invalid() or v.beyond(1e9),
    "a negative angle; the machine is switched off; a NaN",
    "the same shape; `clear` becomes FALSE",
    "another shape; `clear` remains",
    "a polygon repeats in both directions",
    ("eoffset_per_angle", "plain"),
    lasts=True,
)
behaviour(
    "gantry",
    "home|position-fb|joint.*",
    lambda v: v.has("joint.02.home"),
    "more than two joints",
    "`home` waits for all joints",
    "not for the last ones",
    "a gantry is at home when all its joints are",
    ("gantry personality=3", "edges"),
    lasts=True,
)
behaviour(
    "gantry",
    ".*",
    lambda v: v.invalid() or v.beyond(1e9),
    "a NaN or infinite input",
    "is ignored",
    "NaN for ever",
    "a position must not become NaN",
    ("gantry personality=2", "wild"),
    lasts=True,
)
behaviour(
    "sim_encoder",
    "phase-.",
    lambda v: v["scale"] == 0
    or not abs(v["speed"] / v["scale"]) * v["ppr"] * 0.004 < 1
    or v.invalid()
    or v.changed("ppr"),
    "a count per cycle or more; `ppr` changes",
    "turns forward",
    "turns backwards",
    "a spindle does not reverse at its highest speed",
    ("sim_encoder num_chan=1", "edges"),
    lasts=True,
)
behaviour(
    "counter",
    "rawcounts|counts|position|velocity",
    lambda v: v.cycle == 0 and v["phase-A"] or v["reset"],
    "`phase-A` is TRUE in the first cycle; `reset`",
    "counting starts there; `rawcounts` is this cycle's",
    "an edge; that of the cycle before",
    "the first state is not an edge",
    ("counter num_chan=1", "plain"),
    lasts=True,
)
behaviour(
    "encoder_ratio",
    "error",
    lambda v: v.changed("ppr", "teeth")
    or 0 in v.all("ppr", "teeth")
    or v.beyond(20000, "ppr", "teeth"),
    "`ppr` or teeth change, are 0 or beyond 20000",
    "apply to all counts since the start; 0 disables that axis",
    "apply to later counts; the error is held",
    "the gear ratio is that of the settings",
    ("encoder_ratio num_chan=1", "plain"),
    lasts=True,
)
behaviour(
    "toggle2nist",
    "on|off",
    lambda v: True,
    "a request that `is-on` does not follow at once",
    "lasts `max-pulse-length` cycles",
    "ends at any time: its time runs while there is no request",
    "a request of one cycle may be missed",
    ("toggle2nist", "plain"),
    versions=("2.10",),
)
behaviour(
    "toggle2nist",
    "on|off",
    lambda v: True,
    "always",
    "those of 2.10",
    "both edges request the other state",
    "2.10's",
    ("toggle2nist", "plain"),
    lasts=True,
    versions=("2.9",),
)
behaviour(
    "gantry",
    ".*",
    lambda v: v.cycle == 0 and v["position-cmd"] != 0,
    "`position-cmd` is not 0 in the first cycle",
    "the first command is not a motion",
    "a motion from 0",
    "a machine must not jump",
    ("gantry personality=2", "plain"),
    lasts=True,
)
behaviour(
    "counter",
    "position-scale|position|velocity",
    lambda v: v.invalid() or v.beyond(1e12) or v["position-scale"] == 0,
    "`position-scale` is NaN, infinite or 0",
    "the last valid value; 1 for 0",
    "is used",
    "a division by 0",
    ("counter num_chan=1", "wild"),
    lasts=True,
)
inventory("encoder", "quad-errors", "counts invalid transitions", "missing", "an addition")
inventory(
    "pid", "feedbackD", "the derivative of the feedback, with `debug=1`", "missing", "an addition"
)
behaviour(
    "spindle",
    "zero-speed|at-speed|limited|forward|reverse|brake",
    lambda v: True,
    "a speed within the last digits of a tolerance",
    "double precision",
    "single precision: some cycles earlier or later",
    "speeds have all digits",
    ("spindle", "edges"),
    most_cycles=60,
)
behaviour(
    "counter",
    "velocity",
    lambda v: v["phase-A"],
    "after the first edge",
    "0: there is no interval yet",
    "a count per cycle",
    "a speed needs an interval",
    ("counter num_chan=1", "plain"),
    lasts=True,
)
behaviour(
    "gearchange",
    "speed-out|scale2",
    lambda v: v.invalid(),
    "an input, a limit or `scale2` is NaN",
    "`min1` or `min2`; the limit's last valid value; 1",
    "NaN",
    HELD,
    (
        "gearchange",
        {"gearchange.0.sel": [True], "gearchange.0.speed-in": [float("nan")]},
        {"gearchange.0.max2": -1.0},
    ),
)
EOFFSET_IN_THIRDS = (
    "eoffset_per_angle",
    {
        "eoffset-per-angle.0.is-on": [True],
        "eoffset-per-angle.0.enable-in": [False, False, True],
        "eoffset-per-angle.0.radius-ref": [20.0],
        "eoffset-per-angle.0.k": [3],
    },
    {},
)
for component, pins, witness, within, reference in (
    ("filter_kalman", "xk-out", ("filter_kalman", "edges"), 1e-4, lambda v: v.largest("zk")),
    ("eoffset_per_angle", "eoffset-dbg", EOFFSET_IN_THIRDS, 1e-7, None),
    (
        "eoffset_per_angle",
        "kreciprocal",
        ("eoffset_per_angle", "edges"),
        1e-7,
        lambda v: 1 / (v["k"] or 10000),
    ),
    (
        "gantry",
        "joint.*|position-fb",
        ("gantry personality=2", "edges"),
        1.2e-7,
        lambda v: v.largest("position-cmd") * (v.cycle + 1),
    ),
):
    behaviour(
        component,
        pins,
        lambda v: True,
        "always",
        "double precision, as in 2.10",
        "single precision",
        "2.10's",
        witness,
        within=within,
        reference=reference,
        versions=("2.9",),
    )
THC_AT_WORK = (
    "thc",
    {
        "thc.enable": [True],
        "thc.torch-on": [True],
        "thc.arc-ok": [True],
        "thc.current-vel": [100.0],
        "thc.requested-vel": [100.0],
        "thc.encoder-vel": [0.0],
        "thc.volts-requested": [100.0],
        "thc.vel-tol": [1.0],
    },
    {"thc.correction-vel": 0.1, "thc.vel-scale": 1.0, "thc.velocity-tol": 10.0},
)
behaviour(
    "thc",
    "offset-value",
    lambda v: True,
    "always",
    "the correction in use",
    "that of the cycle before",
    "2.10's",
    THC_AT_WORK,
    lasts=True,
    versions=("2.9",),
)
behaviour(
    "thc",
    "z-pos-out",
    lambda v: True,
    "always",
    "double precision, as in 2.10",
    "single precision",
    "2.10's",
    THC_AT_WORK,
    lasts=True,
    within=1.2e-7,
    reference=lambda v: v.largest("z-pos-in") + v.largest("correction-vel") * (v.cycle + 1) ** 2,
    versions=("2.9",),
)
