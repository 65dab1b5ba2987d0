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
    hal::Function    run{*this, "", &Limit2::follow, "follows in"};

    void follow(hal::Cycle cycle) noexcept {
        const double goal = std::fmin(std::fmax(in, min), max);
        if (std::isfinite(goal) && !std::isnan(in.get())) {
            const double way = goal - position_;
            const double reach = load ? HUGE_VAL : std::fmax(maxv, 0.0) * cycle.seconds();
            position_ = std::fabs(way) <= reach ? goal : position_ + std::copysign(reach, way);
        }
        out = position_;
    }

private:
    double position_ = 0.0;
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
