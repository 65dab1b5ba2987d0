// SPDX-License-Identifier: MIT
#include <numbers>

#include "hal/component.hpp"

namespace {

struct Clarke2 : hal::Component {
    using Component::Component;
    hal::In<double> a{*this, "a", "first phase"};
    hal::In<double> b{*this, "b", "second phase; the third is -(a + b)"};
    hal::Out<double> x{*this, "x", "component in the direction of phase a"};
    hal::Out<double> y{*this, "y", "component a quarter turn ahead of x"};
    hal::Function run{*this, "", &Clarke2::update, "computes x and y"};

    void update(hal::Cycle) noexcept {
        x = a;
        y = (a + 2.0 * b) * std::numbers::inv_sqrt3;
    }
};

}  // namespace

HAL_COMPONENT(Clarke2, "clarke2", "Clarke transform of two phases whose sum with the third is zero",
              R"(
    x = a
    y = (a + 2 b) / sqrt(3)

In a three-wire system the third phase is -(a + b), so two phases are sufficient. The transform
preserves amplitudes: three sines of amplitude 1 give a vector of length 1. See `clarke3` for phases
whose sum is not zero, `clarkeinv` for the inverse.

    loadrt clarke2 names=currents
    addf currents servo
    net phase-u => currents.a
    net phase-v => currents.b
    net i-alpha <= currents.x
    net i-beta  <= currents.y
)")
