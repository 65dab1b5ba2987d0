// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct Spindle : hal::Component {
    using Component::Component;
    hal::Argument gears{*this, "numgears", 1, "number of gears", {.min = 1, .max = 16}};

    hal::In<std::uint32_t> select_gear{*this, "select-gear", "number of the gear while select.1 and higher are FALSE"};
    hal::In<double>  commanded_speed{*this, "commanded-speed", "commanded speed; negative: reverse", {.unit = "rpm"}};
    hal::In<double>  actual_speed{*this, "actual-speed", "speed measured by an encoder", {.unit = "turn/s"}};
    hal::In<bool>    simulate_encoder{*this, "simulate-encoder", "TRUE simulates the speed of a spindle without encoder"};
    hal::In<bool>    enable{*this, "enable", "FALSE decelerates the spindle to 0"};
    hal::In<double>  lpf{*this, "spindle-lpf", "cycles over which spindle-rpm-abs is smoothed while at speed; 0: no smoothing"};
    hal::Out<double> rpm{*this, "spindle-rpm", "speed, measured or simulated", {.unit = "rpm"}};
    hal::Out<double> rpm_abs{*this, "spindle-rpm-abs", "magnitude of spindle-rpm, for a display", {.unit = "rpm"}};
    hal::Out<double> output{*this, "output", "command for the drive: (speed + offset) * scale"};
    hal::Out<std::uint32_t> current_gear{*this, "current-gear", "number of the gear in use"};
    hal::Out<bool>   at_speed{*this, "at-speed", "TRUE while the speed is within speed-tolerance of commanded-speed"};
    hal::Out<bool>   forward{*this, "forward", "TRUE: the drive turns forward", {.safe = false}};
    hal::Out<bool>   reverse{*this, "reverse", "TRUE: the drive turns backward", {.safe = false}};
    hal::Out<bool>   brake{*this, "brake", "TRUE while the spindle must decelerate"};
    hal::Out<bool>   zero_speed{*this, "zero-speed", "TRUE while the speed is within zero-tolerance of 0"};
    hal::Out<bool>   limited{*this, "limited", "TRUE while commanded-speed is above max, or not 0 and below min"};

    hal::Ins<double> scale{*this, "scale.#", gears, "scale of output in gear #; a negative scale inverts the output", {.initial = 1.0}};
    hal::Limits      min{*this, "min.#", gears, "lowest speed in gear #", {.unit = "rpm"}};
    hal::OptionalLimits max{*this, "max.#", gears, "highest speed in gear #", {.unit = "rpm"}};
    hal::OptionalLimits accel{*this, "accel.#", gears, "acceleration: rpm per second without encoder; with an encoder, lead of the output over the speed in rpm"};
    hal::OptionalLimits decel{*this, "decel.#", gears, "deceleration, like accel"};
    hal::Ins<double> speed_tolerance{*this, "speed-tolerance.#", gears, "tolerance of at-speed", {.initial = 20.0, .unit = "rpm"}};
    hal::Ins<double> zero_tolerance{*this, "zero-tolerance.#", gears, "tolerance of zero-speed", {.initial = 20.0, .unit = "rpm"}};
    hal::Ins<double> offset{*this, "offset.#", gears, "offset added to the speed for output in gear #", {.unit = "rpm"}};
    hal::In<bool>    select_first{*this, "select.0", "TRUE: gear 0, the default when no other is selected", {.initial = true}};
    hal::Pins<hal::In<bool>, bool> select{*this, "select.#", gears - 1, 1, "TRUE: gear #; the highest selected gear takes precedence"};

    hal::Function run{*this, "", &Spindle::update, "computes the drive's speed and direction"};

    void update(hal::Cycle cycle) noexcept {
        const std::size_t gear = chosen_gear();
        current_gear = static_cast<std::uint32_t>(gear);
        const double command = std::isfinite(commanded_speed) ? commanded_speed.get() : 0.0, magnitude = std::fabs(command);
        const double low = bound(min[gear]), high = bound(max[gear]);
        limited = magnitude > high || (magnitude > 0.0 && magnitude < low);
        const double wanted = enable && magnitude > 0.0 ? std::copysign(std::min(std::max(magnitude, low), high), command) : 0.0;

        const bool simulated = simulate_encoder;
        const double measured = actual_speed * 60.0;
        const double speed = simulated ? drive_ : std::isfinite(measured) ? measured : 0.0;
        const double up = bound(accel[gear]) * (simulated ? cycle.seconds() : 1.0);
        const double down = bound(decel[gear]) * (simulated ? cycle.seconds() : 1.0);
        drive_ = next(simulated || std::fabs(speed) > zero_tolerance[gear] ? speed : 0.0, wanted, up, down);

        const double turning = simulated ? drive_ : speed;
        const bool too_fast = wanted * turning <= 0.0 || std::fabs(turning) > std::fabs(wanted) + speed_tolerance[gear];
        brake = too_fast && !(std::fabs(turning) <= zero_tolerance[gear]);
        output = (std::fabs(drive_) + offset[gear]) * scale[gear];
        forward = enable && drive_ > 0.0;
        reverse = enable && drive_ < 0.0;
        rpm = turning + 0.0;  // never -0
        at_speed = std::fabs(turning - (enable ? command : 0.0)) < speed_tolerance[gear];
        zero_speed = std::fabs(turning) <= zero_tolerance[gear];
        shown_ = at_speed && lpf > 0.0 ? shown_ + (std::fabs(turning) - shown_) / (1.0 + lpf) : std::fabs(turning);
        rpm_abs = shown_;
    }

private:
    static double bound(double value) noexcept { return value > 0.0 ? std::min(value, 1e9) : 0.0; }

    std::size_t chosen_gear() const noexcept {
        for (std::size_t i = select.size(); i > 0; --i)
            if (select[i - 1]) return i;
        return std::min<std::size_t>(select_gear, scale.size() - 1);
    }

    /// One step from `speed` towards `wanted`; a change of direction stops at 0 for a cycle.
    static double next(double speed, double wanted, double up, double down) noexcept {
        const double sign = speed != 0.0 ? speed : wanted;
        const double from = std::fabs(speed), to = sign * wanted > 0.0 ? std::fabs(wanted) : 0.0;
        return std::copysign(from < to ? std::min(from + up, to) : std::max(from - down, to), sign);
    }
    double drive_ = 0.0;  // speed commanded to the drive
    double shown_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Spindle, "spindle", "Spindle with acceleration and deceleration, brake and up to 16 gears", R"(
For a drive with inputs for speed and direction. The target is `commanded-speed` with its magnitude limited to `min` and `max` of the
gear (`min` does not apply at 0), or 0 while `enable` is FALSE. `output` is the magnitude of the speed commanded to the drive, plus
`offset`, times `scale`; `forward` and `reverse` are its direction, both FALSE at 0 and while disabled. To change direction the
spindle first decelerates to 0.

With `simulate-encoder` the commanded speed changes by `accel` and `decel` rpm per second and counts as the speed of the spindle. With an
encoder it is the measured speed plus `accel`, or minus `decel`, up to the target, so a loaded spindle gets more time.

`brake` is TRUE while the spindle turns (above `zero-tolerance`) too fast or in the wrong direction; LinuxCNC's always leaves it FALSE.
`numgears=N` gives N gears with a pin of each kind; the highest `select.N` that is TRUE is the gear, else the number in `select-gear`.
`spindle-rpm-abs` is smoothed by r += (speed - r) / (1 + spindle-lpf) while at speed.

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
