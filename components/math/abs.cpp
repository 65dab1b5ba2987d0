// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Abs : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "absolute value of the input"};
    hal::Out<bool> sign{*this, "sign", "TRUE while in is below 0"};
    hal::Out<bool> is_positive{*this, "is-positive", "TRUE while in is above 1e-6"};
    hal::Out<bool> is_negative{*this, "is-negative", "TRUE while in is below -1e-6"};
    hal::Function run{*this, "", hal::step<&Abs::update>, "computes out and the sign"};

    static constexpr double min = 1e-6;  // a smaller magnitude is neither positive nor negative

    void update(hal::Cycle) noexcept {
        const double value = in;
        out = std::fabs(value);
        sign = value < 0.0;
        is_positive = value > min;
        is_negative = value < -min;
    }
};

}  // namespace

HAL_COMPONENT(Abs, "abs", "Absolute value and sign", R"(
`out = |in|`. At 0 all three flags are FALSE.

    loadrt abs names=spindle-speed
    addf spindle-speed servo
    net spindle-velocity => spindle-speed.in
    net spindle-speed    <= spindle-speed.out
    net spindle-reverse  <= spindle-speed.is-negative
)")
