// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"

namespace {

// The curve is f(x) = a x^p + b x for deadband <= x <= 1, with f(deadband) = 0 and f(1) = 1:
//     a = d / (d - d^p) = 1 / (1 - d^(p - 1)),  b = 1 - a
// For p = 1 the two terms are equal: f is the straight line between these points, the limit for p
// -> 1 when d = 0, and the only solution otherwise.
struct Joyhandle : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "position of the joystick, -1..1"};
    hal::Out<double> out{*this, "out", "shaped value"};
    hal::CorrectedParam<double> power{
        *this, "power", "exponent of the curve, at least 1", {.initial = 2.0}};
    hal::CorrectedParam<double> deadband{*this, "deadband",
                                         "positions within ±deadband give 0; 0..0.99"};
    hal::Param<double> scale{
        *this, "scale", "value of the curve at full deflection", {.initial = 1.0}};
    hal::Param<double> offset{*this, "offset",
                              "added to the absolute value of the curve outside the deadband"};
    hal::Param<bool> inverse{*this, "inverse",
                             "TRUE: steep at the centre and flat at full deflection"};
    hal::Function run{*this, "", hal::step<&Joyhandle::update>, "shapes the value"};

    void update(hal::Cycle) noexcept {
        if (power < 1.0) {
            power.correct(1.0);
        }
        if (deadband > 0.99) {
            deadband.correct(0.99);
        }
        if (deadband < 0.0) {
            deadband.correct(0.0);
        }
        const double x = std::fmin(std::fabs(in), 1.0);

        const double d = std::fmin(std::fmax(deadband, 0.0), 0.99);
        if (!(std::fabs(in) > d)) {
            out = 0.0;
            return;
        }
        const double shape = inverse ? 1.0 - curve(1.0 + d - x, d) : curve(x, d);
        out = std::copysign(1.0, in) * (scale * shape + offset);
    }

private:
    double curve(double x, double d) const {
        const double p = std::fmin(std::fmax(power, 1.0), 1e3);
        const double bend = 1.0 - std::pow(d, p - 1.0);
        if (bend < 1e-9) return (x - d) / (1.0 - d);
        const double a = 1.0 / bend;
        return a * std::pow(x, p) + (1.0 - a) * x;
    }
};

}  // namespace

HAL_COMPONENT(Joyhandle, "joyhandle", "Shapes the movement of a joystick", R"(
    out = ±(scale * (a |in|^power + b |in|) + offset)      for deadband <= |in| <= 1
    out = 0                                                for |in| < deadband

`a` and `b` are such that the curve starts at `deadband` with `offset` and ends at 1 with
`scale + offset`; above 1 it is constant. `inverse` rotates the curve by half a turn, in contrast to
LinuxCNC for both directions of the stick. A `power` below 1 is set to 1, a `deadband` below 0 to 0
and above 0.99 to 0.99. A NaN input gives 0.

    loadrt joyhandle names=stick-x
    addf stick-x servo
    setp stick-x.deadband 0.1
    setp stick-x.power 3
    setp stick-x.scale 50
    net stick-x-raw => stick-x.in
    net x-jog-speed <= stick-x.out
)")
