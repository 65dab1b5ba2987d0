// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Deadzone : hal::Component {
    using Component::Component;
    hal::In<double>    in{*this, "in", "the input"};
    hal::Out<double>   out{*this, "out", "center inside the zone, in outside"};
    hal::Param<double> center{*this, "center", "centre of the zone"};
    hal::Param<double> threshold{*this, "threshold", "width of the zone", {.initial = 1.0}};
    hal::Function      run{*this, "", hal::step<&Deadzone::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const double value = in, middle = center;
        out = std::fabs(value - middle) <= 0.5 * threshold ? middle : value;
    }
};

}  // namespace

HAL_COMPONENT(Deadzone, "deadzone", "Ignores small deviations from a centre", R"(
`out = center` while `in` is within `center ± threshold/2`, else `out = in`.

    # a joystick that does not quite return to the middle
    loadrt deadzone names=stick
    addf stick servo
    setp stick.threshold 0.1
    net stick-raw => stick.in
    net stick     <= stick.out
)")
