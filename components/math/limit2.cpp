// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Limit2 : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "target value"};
    hal::Out<double> out{*this, "out", "follows in, within the limits"};
    hal::In<bool> load{*this, "load", "TRUE sets out to in immediately, regardless of maxv"};
    hal::Limit min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::Limit max{*this, "max", "highest output", {.initial = 1e20}};
    hal::Limit maxv{*this, "maxv", "largest change of out per second", {.initial = 1e20}};
    hal::Function run{*this, "", hal::step<&Limit2::update>, "follows in"};

    void update(hal::Cycle cycle) noexcept {
        const double goal = limited(in);
        if (std::isfinite(goal)) {
            const double way = goal - state_;
            const double step = maxv * cycle.seconds();
            if (load || std::abs(way) <= step) {
                state_ = goal;
            } else if (step > 0.0) {
                state_ += std::copysign(step, way);
            }
        }
        out = state_;
    }

private:
    // Limits `value`, to min first. NaN if it is NaN or infinite.
    double limited(double value) const noexcept {
        const double low = min;
        const double high = max;
        if (!std::isfinite(value)) return NAN;
        if (value < low) return low;
        return std::min(value, high);
    }
    double state_ = 0.0;
    hal::Retained retained_{*this, {{"state", state_}}};
};

}  // namespace

HAL_COMPONENT(Limit2, "limit2", "Follows a value within limits of position and speed", R"(
`out` starts at 0 and moves to `in`, limited to `min` and `max`, by at most `maxv` per second.
`load` sets it to `in` immediately. While the input is NaN or infinite, `out` keeps its value; it
also does while `maxv` is not above 0. While a limit is NaN, its last valid value applies, and a
fault is raised. If `min` is above `max`, a value below `min` gives `min` and any other one `max`.

    loadrt limit2 names=spindle-ramp
    addf spindle-ramp servo
    setp spindle-ramp.max 3000
    setp spindle-ramp.maxv 500
    net spindle-command => spindle-ramp.in
    net spindle-speed   <= spindle-ramp.out
)")
