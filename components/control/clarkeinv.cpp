// SPDX-License-Identifier: MIT
#include <numbers>

#include "hal/component.hpp"

namespace {

struct ClarkeInv : hal::Component {
    using Component::Component;
    hal::In<double> x{*this, "x", "component in the direction of phase a"};
    hal::In<double> y{*this, "y", "component a quarter turn ahead of x"};
    hal::In<double> h{*this, "h", "homopolar component, as computed by clarke3; usually 0"};
    hal::In<double> theta{*this,
                          "theta",
                          "angle by which the vector is rotated before the transform",
                          {.unit = "turn"}};
    hal::Out<double> a{*this, "a", "first phase"};
    hal::Out<double> b{*this, "b", "second phase"};
    hal::Out<double> c{*this, "c", "third phase"};
    hal::Function run{*this, "", &ClarkeInv::update, "computes a, b and c"};

    void update(hal::Cycle) noexcept {
        // Remove whole turns first: the sine of a large number of radians is inaccurate.
        const double angle = 2.0 * std::numbers::pi * (theta - std::floor(theta));
        const double sine = std::sin(angle);
        const double cosine = std::cos(angle);
        const double turned_x = x * cosine - y * sine;
        const double turned_y = x * sine + y * cosine;
        const double common = h / std::numbers::sqrt2;

        const double across = turned_y * (std::numbers::sqrt3 / 2.0);
        a = turned_x + common;
        b = -0.5 * turned_x + across + common;
        c = -0.5 * turned_x - across + common;
    }
};

}  // namespace

HAL_COMPONENT(ClarkeInv, "clarkeinv", "Inverse Clarke transform, with rotation", R"(
Rotates the vector (x, y) by `theta` turns (1.0 is 360 degrees) to (x', y') and computes the three
phases:

    a = x' + h / sqrt(2)
    b = -x' / 2 + y' sqrt(3) / 2 + h / sqrt(2)
    c = -x' / 2 - y' sqrt(3) / 2 + h / sqrt(2)

With `theta` 0 it is the inverse of `clarke3`, and of `clarke2` with h = 0. With `theta` as the
rotor angle, x and y are in the rotor's frame.

**Differences from LinuxCNC:** whole turns of `theta` are removed first, and the constants are exact
(LinuxCNC: 2 pi with ten digits, so that the angle is off by 1e-8 of a turn after 100 turns).

    loadrt clarkeinv names=drive
    addf drive servo
    net rotor-angle => drive.theta
    net torque      => drive.y
    net phase-u <= drive.a
    net phase-v <= drive.b
    net phase-w <= drive.c
)")
