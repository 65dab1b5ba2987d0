// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Div2 : hal::Component {
    using Component::Component;
    hal::In<double>    in0{*this, "in0", "dividend"};
    hal::In<double>    in1{*this, "in1", "divisor"};
    hal::Out<double>   out{*this, "out", "in0 / in1"};
    hal::Param<double> deadband{*this, "deadband", "smallest absolute value of the divisor; a smaller one counts as this"};
    hal::Function      run{*this, "", hal::step<&Div2::update>, "divides"};

    void update(hal::Cycle) noexcept {
        const double smallest = std::fabs(deadband);
        const double divisor = std::fabs(in1) < smallest ? (in1 < 0.0 ? -smallest : smallest) : in1.get();
        out = divisor == 0.0 ? 0.0 : in0 / divisor;
    }
};

}  // namespace

HAL_COMPONENT(Div2, "div2", "Quotient of two numbers", R"(
A divisor between -`deadband` and +`deadband` counts as -`deadband` below 0 and as +`deadband` from 0 on, which limits `out`.
(LinuxCNC's manual page documents an `out` of 0 there; its component behaves as described here.) With a `deadband` of 0 a divisor of 0 gives 0.

    loadrt div2 names=power-factor
    addf power-factor servo
    setp power-factor.deadband 0.1
    net active-power   => power-factor.in0
    net apparent-power => power-factor.in1
    net cos-phi        <= power-factor.out
)")
