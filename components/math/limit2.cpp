// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Limit2 : hal::Component {
    using Component::Component;
    hal::In<double>  in{*this, "in", "the value to follow"};
    hal::Out<double> out{*this, "out", "follows in within the limits"};
    hal::In<bool>    load{*this, "load", "while TRUE out goes to in at once, whatever maxv is"};
    hal::In<double>  min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::In<double>  max{*this, "max", "highest output", {.initial = 1e20}};
    hal::In<double>  max_velocity{*this, "maxv", "largest change of out per second", {.initial = 1e20}};
    hal::Function    run{*this, "", &Limit2::update, "follows in"};

    void update(hal::Cycle cycle) noexcept {
        const double goal = std::min(std::max(in.get(), min.get()), max.get());
        const double stride = max_velocity * cycle.seconds(), distance = goal - position_;
        if (std::isfinite(goal)) {
            if (load || std::fabs(distance) <= stride) position_ = goal;
            else if (stride > 0.0) position_ += std::copysign(stride, distance);
        }
        out = position_;
    }

private:
    double position_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Limit2, "limit2", "Keeps a value between two limits and limits its slope", R"(
`out` moves towards `in`, by at most `maxv * period` per cycle, and stays between `min` and `max` (when `min` is above
`max`, `max` wins). It starts at 0; `load` puts it on the input. While the input is not a number, or `maxv` is not
positive, it stands still. `limit3` also limits the acceleration.

    loadrt limit2 names=spindle-ramp
    addf spindle-ramp servo
    setp spindle-ramp.maxv 500
    net spindle-wanted  => spindle-ramp.in
    net spindle-command <= spindle-ramp.out
)")
