# SPDX-License-Identifier: MIT
"""The intended differences; see expected.py."""
from .expected import behaviour, inventory

LINKABLE = "as a read-only parameter it could not be linked; `getp` reads both"

for component, names in {"axistest": "elapsed", "steptest": "elapsed", "carousel": "homing|motor-dir|state|timer", "edge": "last-in|time-left-ns", "mux16": "elapsed|selected",
                         "mux_generic": "elapsed|selected", "stepgen": "frequency|rawcounts"}.items():
    inventory(component, names, "output pin", "read-only parameter", LINKABLE)
inventory("lowpass", "gain", "input pin", "writable parameter", "as a parameter it could not be linked; `setp` sets both")
inventory("watchdog", "tripped-by", "the number of the input that timed out", "missing", "an addition")

behaviour("wcomp", "out", lambda v: v.invalid("in", "min", "max"), "an input is NaN", "FALSE", "TRUE", "a value that is not a number is not inside a window",
          ("wcomp", {"wcomp.0.in": [float("nan")], "wcomp.0.min": [-1.0], "wcomp.0.max": [1.0]}, {}))
behaviour("watchdog", "ok-out", lambda v: not v["enable-in"] or v.cycle == 0 or min(v.all("timeout-0", "timeout-1")) <= 0 or v.invalid("timeout-0", "timeout-1"),
          "`enable-in` is FALSE; a timeout is 0 or less; the first cycle, before `set-timeouts`", "FALSE",
          "continues after `enable-in`; TRUE for a cycle", "a watchdog that is off or not configured must not report OK", lasts=True,
          witness=("watchdog num_inputs=2", {"watchdog.enable-in": [True] * 20 + [False], "watchdog.input-0": [False, True] * 200, "watchdog.input-1": [False, True] * 200},
                   {"watchdog.timeout-0": 0.01, "watchdog.timeout-1": 0.01}))
behaviour("updown", "count", lambda v: (v["clamp"] or v["wrap"]) and v["max"] == 2147483647, "counting up at a `max` of 2147483647", "continues at `min`, or stays", "overflows",
          "an overflow that the limits should prevent", lasts=True,
          witness=("updown", {"updown.0.countdown": [False, True], "updown.0.countup": [False, False, False, True]}, {"updown.0.wrap": True}))
behaviour("threadtest", "count", lambda v: True, "`reset` runs after `increment`", "the reset takes effect in the next run of `increment`", "in the same cycle",
          "each function writes its own memory, so that both may be in different threads", ("threadtest", {}, {}))
for component in ("steptest", "axistest"):
    behaviour(component, "run-target", lambda v: True, "always", "the commanded position", "0", "the pin is documented in LinuxCNC, and never written",
              (component, {f"{component}.0.run": [True], f"{component}.0.amplitude": [1.0]}, {}))
behaviour("simple_tp", "active|current-pos|current-vel", lambda v: not (v["maxvel"] >= 0 and v["maxaccel"] >= 0) or v.beyond(1e12), "`maxvel` or `maxaccel` is negative or NaN",
          "counts as 0", "NaN in `current-pos`, or motion away from the target", "a position must not become NaN", lasts=True,
          witness=("simple_tp", {"simple-tp.0.enable": [True], "simple-tp.0.target-pos": [1.0], "simple-tp.0.maxvel": [1.0], "simple-tp.0.maxaccel": [-1.0]}, {}))
behaviour("sim_spindle", "position-fb|index-enable", lambda v: v.invalid() or v.beyond(1e18), "the speed is NaN or infinite", "the position is held", "the position becomes NaN", "",
          ("sim_spindle", {"sim-spindle.0.velocity-cmd": [1.0, float("nan"), 1.0]}, {}), lasts=True)
behaviour("spindle_monitor", "spindle-underspeed", lambda v: v["spindle-command"] < 0 or v.invalid(), "a negative command; a NaN", "compared in the direction of the command; a NaN is an underspeed",
          "-110 is an underspeed of -100, and -80 is not", "LinuxCNC's does not detect an underspeed in reverse", lasts=True,
          witness=("spindle_monitor", {"spindle-monitor.0.spindle-is-on": [True], "spindle-monitor.0.spindle-command": [-100.0], "spindle-monitor.0.spindle-feedback": [-100.0] * 5 + [-80.0]},
                   {"spindle-monitor.0.threshold": 5.0}))
behaviour("sim_axis_hardware", "A(maxsw|minsw|bothsw)-homesw-out", lambda v: True, "always", "work", "FALSE", "LinuxCNC's does not write them",
          ("sim_axis_hardware", {"sim-axis-hardware.0.Acurrent-pos": [1.0]}, {}))
behaviour("sphereprobe", "probe-out", lambda v: v.beyond(1e9), "coordinates beyond ±1e9 counts", "exact", "differences overflow", "",
          ("sphereprobe", {"sphereprobe.0.px": [2147483647], "sphereprobe.0.cx": [-2147483648], "sphereprobe.0.r": [5]}, {}))
behaviour("ohmic", "ohmic-on|ohmic-volts|thcad-volts|arc-on", lambda v: v["thcad-max-volt-freq"] == v["thcad-0-volt-freq"] or v["thcad-divide"] == 0 or v["thcad-fullscale"] == 0 or v.beyond(1e12),
          "the two frequencies are equal, as before they are set; a divisor is 0; a NaN", "voltages are 0", "infinite or NaN", "a voltage must not become NaN", lasts=True,
          witness=("ohmic", {"ohmic.0.velocity-in": [100.0]}, {}))
behaviour("ohmic", "ohmic-on", lambda v: v["is-probing"], "probing", "compares with `ohmic-threshold`", "compares with 1", "2.10's; its documentation is the same", lasts=True, versions=("2.9",),
          witness=("ohmic", {"ohmic.0.is-probing": [True], "ohmic.0.velocity-in": [300.0], "ohmic.0.thcad-max-volt-freq": [900.0], "ohmic.0.thcad-divide": [1.0]}, {}))
behaviour("multiclick", ".*-click|.*-click-only", lambda v: v["output-hold-ns"] == 0, "`output-hold-ns` is 0", "a pulse of one cycle", "the output remains TRUE", "a pulse has an end", lasts=True,
          witness=("multiclick", {"multiclick.0.in": [False, True, True, False]}, {"multiclick.0.output-hold-ns": 0}))
behaviour("limit2", "out", lambda v: not v["maxv"] >= 0 or v.beyond(1e18, "in", "max", "min", "maxv"), "`maxv` is negative; an input is NaN or infinite", "the output is held",
          "moves away from the input; NaN", "a limit must hold", lasts=True, witness=("limit2", {"limit2.0.in": [1.0], "limit2.0.maxv": [-10.0]}, {}))
behaviour("lincurve", "out|out-io", lambda v: v.invalid() or any(b < a for a, b in zip(v.all("x-val-00", "x-val-01", "x-val-02"), v.all("x-val-01", "x-val-02", "x-val-03"))),
          "`in` is NaN; the points are not in ascending order", "the output is held; each pair of points is a segment", "NaN; depends on earlier inputs, and reads beyond the points", "", lasts=True,
          witness=("lincurve personality=4", {"lincurve.0.in": [float("nan")]}, {"lincurve.0.x-val-03": 1.0, "lincurve.0.y-val-00": 2.0}))
behaviour("modmath", "up|down|on-target", lambda v: v.beyond(1e9) or v["max-num"] < v["min-num"], "positions beyond ±1e9; `max-num` is below `min-num`", "computed in 64 bits", "overflows; divides by 0", "", lasts=True,
          witness=("modmath mod_dir=1", {"mod-dir.0.actual": [1], "mod-dir.0.desired": [-1]}, {"mod-dir.0.max-num": 2147483647, "mod-dir.0.min-num": -100}))
behaviour("histobins", "mean|variance", lambda v: True, "always", "include the first value", "divide by its number, and leave it out of the sum", "a wrong mean",
          ("histobins", {"histobins.0.input": [2.0]}, {}))
behaviour("histobins", ".*", lambda v: not v["binsize"] > 0 or v.invalid(), "`binsize` is not above 0; a value is NaN or infinite", "`input-error`, and the outputs are held", "writes outside of its memory", "",
          lasts=True, witness=("histobins", {"histobins.0.binsize": [-1.0], "histobins.0.input": [2.0]}, {}))
behaviour("lowpass", "out", lambda v: v.invalid(), "an input is NaN or infinite", "the cycle is skipped", "the output is NaN for ever", "", lasts=True,
          witness=("lowpass", {"lowpass.0.in": [1.0, float("nan"), 1.0]}, {"lowpass.0.gain": 0.5}))
behaviour("ilowpass", "out", lambda v: v.invalid() or v.beyond(1e100), "`gain` or `scale` is NaN or infinite", "the cycle is skipped", "0 for ever", "", lasts=True,
          witness=("ilowpass", {"ilowpass.0.in": [5]}, [{}, {"ilowpass.0.gain": float("nan")}]))

ROUNDED = "the constants of the formula have eight digits"
SATURATED = "a conversion keeps the sign of the value and its order"
HELD = "an output must not become NaN"

for component, pins in {"clarkeinv": "a|b|c", "clarke2": "y", "clarke3": "y", "siggen": "sine|cosine", "spindle": "output"}.items():
    behaviour(component, pins, lambda v: True, "always", "double precision", "differs from the eighth digit on", "", (component + (" num_chan=1" if component == "siggen" else ""), "wild"),
              within=1e-4 if component == "siggen" else 2e-6 if component.startswith("clarke") else 1e-7, lasts=True)
behaviour("comp", "equal|out", lambda v: v.invalid(), "an input is NaN", "FALSE", "`equal` is TRUE", "a NaN is not equal to a number", ("comp", "wild"), lasts=True)
for component, pins in {"scaled_s32_sums": "out-s", "mux16": "out-s"}.items():
    behaviour(component, pins, lambda v: v.beyond(1e6), "the value is beyond the range of s32, or NaN", "limited to the range; 0 for NaN", "-2147483648", SATURATED, (component, "wild"))
behaviour("hypot", "out", lambda v: v.beyond(1e150), "an input is beyond 1e150", "exact", "infinite", "", ("hypot", "wild"))
behaviour("minmax", "max|min", lambda v: v.invalid(), "`in` is NaN during `reset`", "the cycle is skipped", "NaN until the next reset", HELD, ("minmax", "wild"), lasts=True)
behaviour("orient", "command|poserr|is-oriented", lambda v: v.invalid() or v.beyond(1e9), "an input is NaN or infinite", "`command` is held", "`command` is NaN or infinite", HELD, ("orient", "wild"), lasts=True)
behaviour("ddt", "out", lambda v: v.invalid(), "`in` is NaN or infinite", "0", "NaN", HELD, ("ddt", "wild"), lasts=True)
behaviour("lcd", "out", lambda v: True, "always", "the same text", "control characters in another order", "the display shows the same", ("lcd fmt_strings=%d", "plain"))
behaviour("toggle2nist", "on|off", lambda v: True, "a request that `is-on` does not follow at once", "lasts `max-pulse-length` cycles", "ends at any time: its time runs while there is no request",
          "a request of one cycle may be missed", ("toggle2nist", "plain"), lasts=True)
inventory("toggle2nist", "debounce|max-pulse-length", "input pins of 2.10", "missing", "newer", versions=("2.9",))
behaviour("thcud", "vel-status", lambda v: not v["enable"], "`enable` is FALSE", "FALSE", "keeps its value", "the pin reports a state of the control, which is off", ("thcud", "plain"), lasts=True)
behaviour("thc", "vel-status", lambda v: not v["enable"], "`enable` is FALSE", "FALSE", "keeps its value", "the pin reports a state of the control, which is off", ("thc", "plain"), lasts=True)

behaviour("biquad", ".*", lambda v: not v["f0"] > 0 or not v["Q"] > 0 or v.invalid() or v.beyond(1e12), "`f0` is 0 or below; a NaN", "`valid` is FALSE, `out` recovers", "the filter diverges",
          HELD, ("biquad", "edges"), lasts=True)
behaviour("siggen", "clock|square|sawtooth|triangle|sine|cosine", lambda v: v["frequency"] < 0 or v.invalid() or v.beyond(1e12), "a negative frequency; a NaN", "the waves run backwards; the phase is held",
          "`sawtooth` and `triangle` leave their range; NaN for ever", "", ("siggen num_chan=1", "plain"), lasts=True)
behaviour("spindle", ".*", lambda v: True, "always", "`brake` is set, `reverse` lasts until the spindle stops", "`brake` is always FALSE, `reverse` ends at once", "as documented", ("spindle", "plain"), lasts=True)
behaviour("thc", "offset-value|z-pos-out|z-fb-out", lambda v: True, "`enable` or `torch-on` becomes FALSE; one cycle", "the correction is removed as documented", "removed in one cycle, or returned at once; `offset-value` is a cycle late",
          "the torch must not jump", ("thc", "edges"), lasts=True)
behaviour("thcud", "cur-offset|z-pos-out|z-fb-out|removing-offset", lambda v: True, "`enable` or `torch-on` becomes FALSE", "the correction is removed as documented", "removed in one cycle; `cur-offset` is 0 (2.9)",
          "the torch must not jump", ("thcud", "plain"), lasts=True)
behaviour("carousel", ".*", lambda v: True, "always", "states with other numbers; `enable` FALSE stops at once", "with `rev-pulse`, `decel-time` and `align-dc`, as at the pocket", "a stop is a stop",
          ("carousel", "plain"), lasts=True)
behaviour("anglejog", ".*", lambda v: True, "braking, angles in other quadrants", "acceleration fractions are positive; goes on braking", "with the sign of cosine and sine; the speed is held until the wheel turns",
          "the motion controller takes a negative fraction as 1", ("anglejog", "plain"), lasts=True)
behaviour("eoffset_per_angle", ".*", lambda v: True, "negative angles; the machine is switched off", "the same shape; `clear` becomes FALSE", "another shape; `clear` remains", "", ("eoffset_per_angle", "plain"), lasts=True)
behaviour("gantry", "home|position-fb|joint.*", lambda v: True, "more than two joints; the first command", "`home` waits for all joints; the first command is not a motion", "not for the last ones; from 0", "",
          ("gantry personality=3", "edges"), lasts=True)
behaviour("sim_encoder", "phase-.", lambda v: True, "more than a quarter of a turn per cycle", "turns forward", "turns backwards", "", ("sim_encoder num_chan=1", "edges"), lasts=True)
inventory("sim_encoder", "rawcounts", "output pin", "input pin", "the component writes it")
behaviour("counter", "rawcounts|counts|position|velocity", lambda v: True, "`phase-A` is TRUE in the first cycle", "counting starts there", "an edge", "", ("counter num_chan=1", "plain"), lasts=True)
behaviour("feedcomp", "out", lambda v: v["feed"] == 0 or v.invalid() or v.beyond(1e100), "`feed` is 0", "`in`", "infinite or NaN", HELD, ("feedcomp", "plain"))
behaviour("integ", "out", lambda v: v.invalid() or v.beyond(1e18, "in", "gain"), "an input is NaN or infinite", "the cycle is skipped", "NaN for ever", HELD, ("integ", "wild"), lasts=True)
behaviour("demux", "out-31", lambda v: v["bargraph"] or v.beyond(2147480000, "sel-u32"), "a bar of all outputs", "all TRUE", "the last output is FALSE", "a bar could not be full", ("demux", "edges"))
behaviour("demux", "out-.*", lambda v: v.beyond(2147480000, "sel-u32"), "`sel-u32` beyond 2147483647", "the last output", "none, the sum is negative", "", ("demux", "wild"))
behaviour("encoder_ratio", "error", lambda v: True, "`ppr` or teeth change, or are 0", "apply to all counts since the start; 0 disables that axis", "apply to later counts; the error is held", "",
          ("encoder_ratio num_chan=1", "plain"), lasts=True)
behaviour("filter_kalman", "xk-out", lambda v: v["Rk"] < 0 or v["Qk"] < 0 or v.invalid() or v.beyond(1e12), "`Rk` or `Qk` is negative; a NaN", "counts as 0; is ignored", "the estimate diverges", "", ("filter_kalman", "edges"),
          lasts=True)
behaviour("timedelay", "out|elapsed", lambda v: v.invalid(), "a delay is NaN", "counts as 0", "`out` never changes", "", ("timedelay", "wild"), lasts=True)
behaviour("knob2float", "out", lambda v: v.beyond(1e9) or v.invalid(), "counts that wrap around; a NaN", "the difference in 32 bits", "overflows", "", ("knob2float", "wild"), lasts=True)
inventory("carousel", "debounce", "writable", "read-only", "a time that is set by the user")
behaviour("sim_encoder", "scale", lambda v: v["scale"] == 0, "`scale` is 0", "1", "-0 remains", "", ("sim_encoder num_chan=1", {}, {"sim-encoder.0.scale": -0.0}))
