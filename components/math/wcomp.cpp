// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Wcomp : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "value to compare"};
    hal::In<double> min{*this, "min", "lower end of the window"};
    hal::In<double> max{*this, "max", "upper end of the window"};
    hal::Out<bool> out{*this, "out", "TRUE while in is strictly between min and max"};
    hal::Out<bool> under{*this, "under", "TRUE while in is at or below min"};
    hal::Out<bool> over{*this, "over", "TRUE while in is at or above max"};
    hal::Function run{*this, "", hal::step<&Wcomp::update>, "compares"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        const double low = min;
        const double high = max;
        out = value > low && value < high;
        under = value <= low;
        over = value >= high;
    }
};

}  // namespace

HAL_COMPONENT(Wcomp, "wcomp", "Window comparator", R"(
Exactly one of `under`, `out` and `over` is TRUE while `min` is below `max`. A window with `max` at
or below `min` is empty: `out` is never TRUE, and `under` and `over` may be TRUE together. With a
NaN input all are FALSE.

    loadrt wcomp names=in-position
    addf in-position servo
    setp in-position.min -0.01
    setp in-position.max 0.01
    net following-error => in-position.in
    net in-position     <= in-position.out
)")
