// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Invert : hal::Component {
    using Component::Component;
    hal::In<double>    in{*this, "in", "the input"};
    hal::Out<double>   out{*this, "out", "1 / in, or 0 close to 0"};
    hal::Param<double> deadband{*this, "deadband", "out is 0 while in is between -deadband and deadband"};
    hal::Function      run{*this, "", hal::step<&Invert::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        out = std::fabs(value) <= std::fabs(deadband) ? 0.0 : 1.0 / value;
    }
};

}  // namespace

HAL_COMPONENT(Invert, "invert", "Reciprocal", R"(
`out = 1 / in`, and 0 while `|in| <= deadband`, so an input of 0 gives 0 and not infinity.

    loadrt invert names=period
    addf period servo
    setp period.deadband 0.001
    net frequency => period.in
    net period    <= period.out
)")
