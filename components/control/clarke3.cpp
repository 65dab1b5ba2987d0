// SPDX-License-Identifier: MIT
#include <numbers>

#include "hal/component.hpp"

namespace {

struct Clarke3 : hal::Component {
    using Component::Component;
    hal::In<double> a{*this, "a", "first phase"};
    hal::In<double> b{*this, "b", "second phase"};
    hal::In<double> c{*this, "c", "third phase"};
    hal::Out<double> x{*this, "x", "component in the direction of phase a"};
    hal::Out<double> y{*this, "y", "component a quarter turn ahead of x"};
    hal::Out<double> h{*this, "h", "homopolar component: the part common to all phases"};
    hal::Function run{*this, "", &Clarke3::update, "computes x, y and h"};

    void update(hal::Cycle) noexcept {
        x = (2.0 * a - b - c) / 3.0;
        y = (b - c) * std::numbers::inv_sqrt3;
        h = (a + b + c) * (std::numbers::sqrt2 / 3.0);
    }
};

}  // namespace

HAL_COMPONENT(Clarke3, "clarke3", "Clarke transform of three phases", R"(
    x = (2 a - b - c) / 3
    y = (b - c) / sqrt(3)
    h = (a + b + c) sqrt(2) / 3

The transform preserves amplitudes: three sines of amplitude 1, a third of a turn apart, give a
vector of length 1. The part common to all phases is h / sqrt(2) in each. The constants are exact
(LinuxCNC: 15 digits). See `clarke2` for phases whose sum is zero, `clarkeinv` for the inverse.

    loadrt clarke3 names=currents
    addf currents servo
    net phase-u => currents.a
    net phase-v => currents.b
    net phase-w => currents.c
    net i-alpha <= currents.x
    net i-beta  <= currents.y
)")
