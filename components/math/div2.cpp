// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"

namespace {

struct Div2 : hal::Component {
    using Component::Component;
    hal::In<double> in0{*this, "in0", "dividend"};
    hal::In<double> in1{*this, "in1", "divisor"};
    hal::Out<double> out{*this, "out", "in0 / in1"};
    hal::CorrectedParam<double> deadband{
        *this, "deadband",
        "smallest absolute value of the divisor, at least 1e-12; a smaller one counts as this"};
    hal::Function run{*this, "", hal::step<&Div2::update>, "divides"};

    void update(hal::Cycle) noexcept {
        constexpr double min_deadband = 1e-12;
        if (!(deadband >= min_deadband)) {  // also for NaN
            deadband.correct(min_deadband);
        }
        const double smallest = in1 < 0.0 ? -deadband : deadband;
        out = in0 / (std::fabs(in1) < deadband ? smallest : in1);
    }
};

}  // namespace

HAL_COMPONENT(Div2, "div2", "Quotient of two numbers", R"(
A divisor between -`deadband` and +`deadband` counts as -`deadband` below 0 and as +`deadband` from
0 on, which limits `out`. (LinuxCNC's manual page documents an `out` of 0 there; its component
behaves as described here.) A `deadband` below 1e-12, or NaN, is set to 1e-12 (LinuxCNC: NaN
remains, and a divisor of 0 gives infinity). LinuxCNC prints a message at a divisor within the
deadband.

    loadrt div2 names=power-factor
    addf power-factor servo
    setp power-factor.deadband 0.1
    net active-power   => power-factor.in0
    net apparent-power => power-factor.in1
    net cos-phi        <= power-factor.out
)")
