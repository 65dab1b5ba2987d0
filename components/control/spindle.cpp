// SPDX-License-Identifier: MIT
#include <limits>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Spindle : hal::Component {
    using Component::Component;
    hal::Argument gears{*this, "numgears", 1, "number of gears", {.min = 1, .max = 16}};

    hal::In<std::uint32_t> select_gear{*this, "select-gear",
                                       "number of the gear; 0: as selected by select.0 and higher"};
    hal::In<double> commanded_speed{
        *this, "commanded-speed", "commanded speed; negative: reverse", {.unit = "rpm"}};
    hal::In<double> actual_speed{
        *this, "actual-speed", "speed measured by an encoder", {.unit = "turn/s"}};
    hal::In<bool> simulate_encoder{*this, "simulate-encoder",
                                   "TRUE simulates the speed of a spindle without encoder"};
    hal::In<bool> enable{*this, "enable", "FALSE decelerates the spindle to 0"};
    hal::In<double> lpf{
        *this, "spindle-lpf",
        "gain per second of the filter of spindle-rpm-abs while at speed; 0: no filter"};
    hal::Out<double> rpm{*this, "spindle-rpm", "speed, measured or simulated", {.unit = "rpm"}};
    hal::Out<double> rpm_abs{
        *this, "spindle-rpm-abs", "magnitude of spindle-rpm, for a display", {.unit = "rpm"}};
    hal::Out<double> output{
        *this, "output", "command for the drive: (speed + offset) * scale", {.safe = 0.0}};
    hal::Out<std::uint32_t> current_gear{*this, "current-gear", "number of the gear in use"};
    hal::Out<bool> at_speed{*this,
                            "at-speed",
                            "TRUE while the speed is within speed-tolerance of commanded-speed",
                            {.safe = false}};
    hal::Out<bool> forward{*this, "forward", "TRUE: the drive turns forward", {.safe = false}};
    hal::Out<bool> reverse{*this, "reverse", "TRUE: the drive turns backward", {.safe = false}};
    hal::Out<bool> brake{*this, "brake", "TRUE while the spindle must decelerate"};
    hal::Out<bool> zero_speed{*this, "zero-speed",
                              "TRUE while the speed is within zero-tolerance of 0"};
    hal::Out<bool> limited{
        *this, "limited",
        "TRUE while commanded-speed is above max, or not 0 and below min, and enabled"};

    hal::Ins<double> scale{*this,
                           "scale.#",
                           gears,
                           "scale of output in gear #; a negative scale inverts the output",
                           {.initial = 1.0}};
    hal::Limits min{*this, "min.#", gears, "lowest speed in gear #", {.unit = "rpm"}};
    hal::OptionalLimits max{
        *this, "max.#", gears, "highest speed in gear #; 0: no limit", {.unit = "rpm"}};
    hal::OptionalLimits accel{*this, "accel.#", gears,
                              "acceleration: rpm per second without encoder; with an encoder, lead "
                              "of the output over the speed in rpm; 0: no limit"};
    hal::OptionalLimits decel{*this, "decel.#", gears, "deceleration, like accel"};
    hal::Ins<double> speed_tolerance{*this,
                                     "speed-tolerance.#",
                                     gears,
                                     "tolerance of at-speed",
                                     {.initial = 20.0, .unit = "rpm"}};
    hal::Ins<double> zero_tolerance{*this,
                                    "zero-tolerance.#",
                                    gears,
                                    "tolerance of zero-speed",
                                    {.initial = 20.0, .unit = "rpm"}};
    hal::Ins<double> offset{*this,
                            "offset.#",
                            gears,
                            "offset added to the speed for output in gear #",
                            {.unit = "rpm"}};
    hal::In<bool> select_first{*this,
                               "select.0",
                               "TRUE: gear 0, the default when no other is selected",
                               {.initial = gears == 1}};
    hal::Pins<hal::In<bool>, bool> select{
        *this, "select.#", gears - 1, 1,
        "TRUE: gear #; the highest selected gear takes precedence"};

    hal::Function run{*this, "", &Spindle::update, "computes the drive's speed and direction"};

    void update(hal::Cycle cycle) noexcept {
        if (interruption_.accept()) {
            start_from_rest();
        }
        const std::size_t gear = chosen_gear();
        current_gear = static_cast<std::uint32_t>(gear);
        const bool simulated = simulate_encoder;
        const double command =
            enable && std::isfinite(commanded_speed) ? commanded_speed.get() : 0.0;
        const double wanted = within_range(command, gear);
        limited = wanted != command;

        const double speed = simulated ? rpm.get() : measured_speed();
        const double magnitude = std::fabs(speed);
        show(magnitude, cycle.seconds());
        zero_speed = magnitude <= zero_tolerance[gear];
        at_speed = speed_tolerance[gear] > 0.0 &&
                   std::fabs(command - speed) <= speed_tolerance[gear] && command * speed >= 0.0;

        const double period_s = simulated ? cycle.seconds() : 1.0;
        const double up = limit_or_none(accel[gear]) * period_s;
        const double down = limit_or_none(decel[gear]) * period_s;
        const bool there = at_speed && std::fabs(wanted - speed) <= speed_tolerance[gear];
        const double drive = there ? wanted : next(speed, wanted, up, down);
        const double turning = simulated ? drive : speed;
        rpm = turning + 0.0;  // never -0
        const bool too_fast = wanted * turning <= 0.0 ||
                              std::fabs(turning) > std::fabs(wanted) + speed_tolerance[gear];
        brake = too_fast && !(std::fabs(turning) <= zero_tolerance[gear]);
        // a spindle turned by hand does not switch the drive on
        forward = drive > 0.0 && (wanted != 0.0 || forward);
        reverse = drive < 0.0 && (wanted != 0.0 || reverse);
        const double highest = std::min(ceiling(gear, down), std::fabs(drive));
        commanded_ = command_within(highest, wanted != 0.0);
        const double scaled = (commanded_ + offset[gear]) * scale[gear];
        output = std::isfinite(scaled) ? scaled : 0.0;
    }

private:
    /// The drive had no command meanwhile: its ramp begins at 0. An encoder measures what remains.
    /// [realtime]
    void start_from_rest() noexcept {
        rpm = 0.0;
        commanded_ = 0.0;
    }

    /// Returns the speed that the encoder measures, in rpm; 0 while it is not a finite number.
    /// [realtime]
    double measured_speed() const noexcept {
        const double measured = actual_speed * 60.0;
        return std::isfinite(measured) ? measured : 0.0;
    }

    /// Returns a limit that must be above 0 to have an effect. [realtime]
    static double limit_or_none(double limit) noexcept {
        return limit > 0.0 ? limit : std::numeric_limits<double>::infinity();
    }

    std::size_t chosen_gear() const noexcept {
        const std::size_t last = scale.size() - 1;
        if (select_gear != 0) return std::min<std::size_t>(select_gear, last);
        for (std::size_t i = select.size(); i > 0; --i) {
            if (select[i - 1]) return i;
        }
        return 0;
    }

    /// Returns `command` with its magnitude limited to the range of the gear; 0 stays 0.
    double within_range(double command, std::size_t gear) const noexcept {
        if (command == 0.0) return 0.0;
        const double low = min[gear] > 0.0 ? min[gear].get() : 0.0;
        return std::copysign(std::min(std::max(std::fabs(command), low), limit_or_none(max[gear])),
                             command);
    }

    /// Returns the highest magnitude of the command: `max` of the gear, or what falls to it by
    /// `down` per cycle from a command above a lowered one. [realtime]
    double ceiling(std::size_t gear, double down) const noexcept {
        return std::max(limit_or_none(max[gear]), commanded_ - down);
    }

    /// Returns the magnitude of the command to the drive: `highest`, which on the way to 0 does not
    /// rise with what the encoder measures, and 0 while the drive is off. [realtime]
    double command_within(double highest, bool runs) const noexcept {
        if (!forward && !reverse) return 0.0;
        return runs ? highest : std::min(highest, commanded_);
    }

    /// One step from `speed` towards `wanted`; a change of direction stops at 0 for a cycle.
    static double next(double speed, double wanted, double up, double down) noexcept {
        const double sign = speed != 0.0 ? speed : wanted;
        const double from = std::fabs(speed), to = sign * wanted > 0.0 ? std::fabs(wanted) : 0.0;
        return std::copysign(from < to ? std::min(from + up, to) : std::max(from - down, to), sign);
    }

    void show(double magnitude, double period_s) noexcept {
        const bool smooth = lpf > 0.0 && at_speed;
        rpm_abs =
            smooth ? rpm_abs + (magnitude - rpm_abs) * std::min(lpf * period_s, 1.0) : magnitude;
    }

    double commanded_ = 0.0;  // magnitude of the last command to the drive, in rpm
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this, {{"commanded", commanded_}, {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(Spindle, "spindle",
              "Spindle with acceleration and deceleration, brake and up to 16 gears", R"(
For a drive with inputs for speed and direction. The target is `commanded-speed` with its magnitude
limited to `min` and `max` of the gear (`min` does not apply at 0), or 0 while `enable` is FALSE.
`output` is the magnitude of the speed commanded to the drive, plus `offset`, times `scale`;
`forward` and `reverse` are its direction, both FALSE at 0. To change direction the spindle first
decelerates to 0. `max`, `accel` and `decel` have no effect while they are 0, the default.

With `simulate-encoder` the commanded speed changes by `accel` and `decel` rpm per second and counts
as the speed of the spindle; so it does after a change of `min`, `max` or the gear. With an encoder
it is the measured speed plus `accel`, or minus `decel`, up to the target, so a loaded spindle gets
more time. While `at-speed` is TRUE and the target is within `speed-tolerance`, it is the target.
`at-speed` compares the speed at the beginning of the cycle with `commanded-speed` before `min` and
`max`.

Whatever the encoder measures, the commanded speed is at most `max`; above a lowered `max` it falls
by `decel` per second, with an encoder by at least `decel` per cycle. On the way to 0 it does not
rise, and while `forward` and `reverse` are FALSE it is 0. After a stop of the thread a simulated
speed begins at 0. An `output` that is not a finite number,
because of `scale` or `offset`, is 0.

`brake` is TRUE while the spindle turns (above `zero-tolerance`) too fast or in the wrong direction. `numgears=N` gives N gears with a pin of
each kind; `select-gear` is the gear, or, while it is 0, the highest `select.N` that is TRUE. `spindle-rpm-abs` is filtered by
r += (speed - r) * spindle-lpf * period while at speed.

**Differences from LinuxCNC:** `brake` is set as documented (LinuxCNC: always FALSE). `reverse`
remains TRUE while a spindle that turns backwards decelerates to a stop, like `forward` (LinuxCNC:
it becomes FALSE at once, and the spindle coasts). A `select-gear` beyond the last gear is the last
one (LinuxCNC reads pins that do not exist). A NaN or infinite speed counts as 0 (LinuxCNC: the
outputs remain NaN), and an `output` that would be NaN or infinite is 0. Only a spindle that the
drive turns has an `output` on the way to 0, it does not rise with the measured speed, and nothing
measured raises it above `max` (LinuxCNC: the measured speed minus `decel` is sent). A change of
`min`, `max` or the gear at speed follows `accel` and `decel` (LinuxCNC: it jumps). While the
machine is stopped, `output` is 0, and `forward`, `reverse` and `at-speed` are FALSE (LinuxCNC: they
keep their values).

    loadrt spindle names=router
    addf router servo
    setp router.simulate-encoder TRUE
    setp router.max.0 18000
    setp router.accel.0 6000
    setp router.decel.0 4000
    net spindle-cmd  => router.commanded-speed
    net spindle-on   => router.enable
    net spindle-fast <= router.at-speed
    net spindle-volt <= router.output
)")
