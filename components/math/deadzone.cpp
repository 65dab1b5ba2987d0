// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Deadzone : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out",
                         "center inside the zone; outside, in reduced by half of threshold"};
    hal::Param<double> center{*this, "center", "centre of the zone"};
    hal::Param<double> threshold{*this, "threshold", "width of the zone", {.initial = 1.0}};
    hal::Function run{*this, "", hal::step<&Deadzone::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        const double half = 0.5 * threshold;
        if (value < center - half) {
            out = value + half;
        } else if (value > center + half) {
            out = value - half;
        } else {
            out = center;
        }
    }
};

}  // namespace

HAL_COMPONENT(Deadzone, "deadzone", "Ignores small deviations from a centre", R"(
`out = center` while `in` is within `center ± threshold/2`. Outside of the zone `out` is `in`, moved
by `threshold/2` towards `center`, so that it begins at `center` without a jump. While `in` is NaN,
`out` is `center`.

    # a joystick that does not quite return to the middle
    loadrt deadzone names=stick
    addf stick servo
    setp stick.threshold 0.1
    net stick-raw => stick.in
    net stick     <= stick.out
)")
