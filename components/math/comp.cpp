// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Comp : hal::Component {
    using Component::Component;
    hal::In<double> in0{*this, "in0", "inverting input"};
    hal::In<double> in1{*this, "in1", "non-inverting input"};
    hal::Out<bool> out{*this, "out", "TRUE while in1 is above in0, with hysteresis"};
    hal::Out<bool> equal{*this, "equal", "TRUE while the inputs differ by at most hyst / 2"};
    hal::Param<double> hyst{*this, "hyst", "width of the hysteresis"};
    hal::Function run{*this, "", hal::step<&Comp::update>, "compares"};

    void update(hal::Cycle) noexcept {
        const double difference = in1 - in0;
        const double half = 0.5 * hyst;
        const bool below = difference < -half;
        const bool above = difference > half && !below;
        if (below || above) {
            out = above;
        }
        equal = !below && !above && !std::isnan(difference);
    }
};

}  // namespace

HAL_COMPONENT(Comp, "comp", "Compares two values, with hysteresis", R"(
`out` becomes TRUE when `in1` rises above `in0 + hyst/2` and FALSE when it falls below
`in0 - hyst/2`; between the two, and at equal inputs with `hyst` 0, it keeps its value. Set `hyst`
to use `equal`: measured values are hardly ever exactly equal. While an input is NaN, `out` keeps
its value and `equal` is FALSE (LinuxCNC: TRUE).

    loadrt comp names=too-hot
    addf too-hot servo
    setp too-hot.in0 80
    setp too-hot.hyst 4
    net temperature => too-hot.in1
    net too-hot     <= too-hot.out
)")
