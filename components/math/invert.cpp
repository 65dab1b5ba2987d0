// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"

namespace {

struct Invert : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "1 / in, limited close to 0"};
    hal::CorrectedParam<double> deadband{
        *this, "deadband",
        "smallest absolute value of the divisor, at least 1e-12; a smaller one counts as this"};
    hal::Function run{*this, "", hal::step<&Invert::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        constexpr double min_deadband = 1e-12;
        if (!(deadband >= min_deadband)) {  // also for NaN
            deadband.correct(min_deadband);
        }
        const double value = in;
        const double smallest = value < 0.0 ? -deadband : deadband;
        out = 1.0 / (std::fabs(value) < deadband ? smallest : value);
    }
};

}  // namespace

HAL_COMPONENT(Invert, "invert", "Reciprocal", R"(
`out = 1 / in`. An input between -`deadband` and +`deadband` counts as -`deadband` below 0 and as
+`deadband` from 0 on, which limits `out`: an input of 0 gives 1e12 with the default. A `deadband`
below 1e-12, or NaN, is set to 1e-12 (LinuxCNC: NaN remains, and an input of 0 gives infinity).
(LinuxCNC's manual page documents an `out` of 0 within the deadband; its component behaves as
described here.)

    loadrt invert names=period
    addf period servo
    setp period.deadband 0.001
    net frequency => period.in
    net period    <= period.out
)")
