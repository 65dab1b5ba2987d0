// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Sum2 : hal::Component {
    using Component::Component;
    hal::In<double>    in0{*this, "in0", "first summand"};
    hal::In<double>    in1{*this, "in1", "second summand"};
    hal::Out<double>   out{*this, "out", "in0 * gain0 + in1 * gain1 + offset"};
    hal::Param<double> gain0{*this, "gain0", "factor of in0", {.initial = 1.0}};
    hal::Param<double> gain1{*this, "gain1", "factor of in1", {.initial = 1.0}};
    hal::Param<double> offset{*this, "offset", "added to the sum"};
    hal::Function      run{*this, "", &Sum2::update, "computes out"};

    void update(hal::Cycle) noexcept { out = in0 * gain0 + in1 * gain1 + offset; }
};

}  // namespace

HAL_COMPONENT(Sum2, "sum2", "Sum of two values, each with a gain, and an offset", R"(
`out = in0 * gain0 + in1 * gain1 + offset`

    # deviation = command - feedback
    loadrt sum2 names=deviation
    addf deviation servo
    setp deviation.gain1 -1
    net command   => deviation.in0
    net feedback  => deviation.in1
    net deviation <= deviation.out
)")
