// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Sum2 : hal::Component {
    using Component::Component;
    hal::In<double> in0{*this, "in0", "first summand"};
    hal::In<double> in1{*this, "in1", "second summand"};
    hal::Param<double> gain0{*this, "gain0", "factor of in0", {.initial = 1.0}};
    hal::Param<double> gain1{*this, "gain1", "factor of in1", {.initial = 1.0}};
    hal::Param<double> offset{*this, "offset", "constant added to the sum"};
    hal::Out<double> out{*this, "out", "sum"};
    hal::Function run{*this, "", hal::step<&Sum2::add>, "computes the sum"};

    void add(hal::Cycle) noexcept { out = gain0 * in0 + gain1 * in1 + offset; }
};

}  // namespace

HAL_COMPONENT(Sum2, "sum2", "Weighted sum of two numbers", R"(
`out = in0 * gain0 + in1 * gain1 + offset`. With `gain1` -1 it is the difference.

    loadrt sum2 names=drive-command
    addf drive-command servo
    net pid-effort  => drive-command.in0
    net friction-ff => drive-command.in1
    net drive-value <= drive-command.out
)")
