// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Near : hal::Component {
    using Component::Component;
    hal::In<double> in1{*this, "in1", "first value"};
    hal::In<double> in2{*this, "in2", "second value"};
    hal::Out<bool> out{*this, "out", "TRUE while the values are nearly equal"};
    hal::Param<double> scale{
        *this, "scale", "maximum ratio of the two; not above 1: not compared", {.initial = 1.0}};
    hal::Param<double> difference{*this, "difference", "maximum difference of the two"};
    hal::Function run{*this, "", hal::step<&Near::update>, "compares"};

    void update(hal::Cycle) noexcept {
        const double first = std::fabs(in1);
        const double second = in1 < 0.0 ? -in2 : in2.get();  // on the side of the first one
        const bool ratio = scale > 1.0 && first / scale <= second && second <= first * scale;
        out = ratio || std::fabs(in1 - in2) <= difference;
    }
};

}  // namespace

HAL_COMPONENT(Near, "near", "Detects whether two values are nearly equal", R"(
`out` is TRUE while the larger of two values of the same sign is at most `scale` times the smaller
one, or while they differ by at most `difference`, which is 0 or more. With a NaN input `out` is
FALSE.

    loadrt near names=at-speed
    addf at-speed servo
    setp at-speed.scale 1.02
    setp at-speed.difference 5
    net spindle-command  => at-speed.in1
    net spindle-speed    => at-speed.in2
    net spindle-at-speed <= at-speed.out
)")
