// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Limit2 : hal::Component {
    using Component::Component;
    hal::In<double>  in{*this, "in", "the value to follow"};
    hal::Out<double> out{*this, "out", "follows in within the limits"};
    hal::In<bool>    load{*this, "load", "while TRUE out is in at once, whatever maxv is"};
    hal::In<double>  min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::In<double>  max{*this, "max", "highest output", {.initial = 1e20}};
    hal::In<double>  maxv{*this, "maxv", "largest change of out per second", {.initial = 1e20}};
    hal::Function    run{*this, "", hal::step<&Limit2::update>, "follows in"};

    void update(hal::Cycle cycle) noexcept {
        const double goal = limited(in);
        if (std::isfinite(goal)) {
            const double way = goal - state_, step = maxv * cycle.seconds();
            if (load || std::abs(way) <= step) state_ = goal;
            else if (step > 0.0) state_ += std::copysign(step, way);
        }
        out = state_;
    }

private:
    // `value` between the limits, max last. NaN when one of the three is, or the value is infinite.
    double limited(double value) const noexcept {
        const double low = min, high = max;
        if (!std::isfinite(value) || std::isnan(low) || std::isnan(high)) return NAN;
        return std::min(std::max(value, low), high);
    }
    double state_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Limit2, "limit2", "Follows a value within limits of position and speed", R"(
`out` starts at 0 and goes to `in`, limited to `min` and `max`, by at most `maxv` per second. `load` puts it there at once. In a cycle
whose input or goal is not a number or infinite `out` stays; it stays, too, while `maxv` is not above 0. When `min` is above `max`,
`max` wins.

    loadrt limit2 names=spindle-ramp
    addf spindle-ramp servo
    setp spindle-ramp.max 3000
    setp spindle-ramp.maxv 500
    net spindle-command => spindle-ramp.in
    net spindle-speed   <= spindle-ramp.out
)")
