// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Comp : hal::Component {
    using Component::Component;
    hal::In<double>    in0{*this, "in0", "inverting input"};
    hal::In<double>    in1{*this, "in1", "non-inverting input"};
    hal::Out<bool>     out{*this, "out", "TRUE while in1 is above in0, with hysteresis"};
    hal::Out<bool>     equal{*this, "equal", "TRUE while the inputs differ by at most hyst / 2"};
    hal::Param<double> hyst{*this, "hyst", "width of the hysteresis"};
    hal::Function      run{*this, "", hal::step<&Comp::update>, "compares"};

    void update(hal::Cycle) noexcept {
        const double difference = in1 - in0, half = 0.5 * std::fabs(hyst);
        if (difference > half) above_ = true;
        else if (difference <= -half) above_ = false;
        out = above_;
        equal = std::fabs(difference) <= half;
    }

private:
    bool above_ = false;
};

}  // namespace

HAL_COMPONENT(Comp, "comp", "Compares two values, with hysteresis", R"(
`out` becomes TRUE when `in1` rises above `in0 + hyst/2` and FALSE when it falls to `in0 - hyst/2`. With `hyst` 0 `out` is
`in1 > in0`. Set `hyst` to use `equal`: measured values are hardly ever exactly equal. While an input is NaN,
`out` keeps its value and `equal` is FALSE.

    loadrt comp names=too-hot
    addf too-hot servo
    setp too-hot.in0 80
    setp too-hot.hyst 4
    net temperature => too-hot.in1
    net too-hot     <= too-hot.out
)")
