// SPDX-License-Identifier: MIT
#include <cmath>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "linear.hpp"

namespace {

struct SpringDamper : hal::Component {
    using Component::Component;

    hal::In<double> force{*this, "force", "force on the mass", {.unit = "N"}};
    hal::In<double> base{*this,
                         "base-position",
                         "position of the base of spring and damper; linear within a period",
                         {.unit = "m"}};
    hal::In<bool> reset{*this, "reset", "TRUE holds the mass at base-position"};

    hal::Param<double> mass{
        *this, "mass", "mass; 0: spring and damper only", {.initial = 1.0, .unit = "kg"}};
    hal::Param<double> stiffness{
        *this, "stiffness", "spring stiffness", {.initial = 100.0, .unit = "N/m"}};
    hal::Param<double> damping{
        *this, "damping", "damping coefficient", {.initial = 2.0, .unit = "N*s/m"}};

    hal::Out<double> position{
        *this, "position", "position of the mass", {.unit = "m", .finite = true}};
    hal::Out<double> velocity{
        *this, "velocity", "velocity of the mass", {.unit = "m/s", .finite = true}};
    hal::Out<double> reaction{
        *this, "reaction", "force of spring and damper on the mass", {.unit = "N", .finite = true}};
    hal::Out<double> energy{
        *this, "energy", "energy of mass and spring", {.unit = "J", .finite = true}};

    hal::Function run{*this, "update", &SpringDamper::update, "simulates one period"};

    void update(hal::Cycle cycle) noexcept {
        const double h = cycle.seconds();
        const double foot = sim::force(base);
        const double pull = sim::force(force);
        const double c = sim::sane(stiffness, 0.0);
        const double d = sim::sane(damping, 0.0);

        const double m = sim::sane(mass, 0.0);
        const double foot_velocity = started_ ? (foot - foot_) / h : 0.0;
        // the elongation is relative to the base
        if (reset || !started_) {
            heavy_.state = {reset ? 0.0 : -foot, 0.0};
        }
        if (!reset) {
            if (m > 0.0) {
                move(m, c, d, pull, foot_velocity, h);
            } else {
                creep(c, d, pull, foot_velocity, h);
            }
        }
        started_ = true;
        foot_ = foot;
        const auto& [stretch, v] = heavy_.state;
        const double relative = v - (reset ? 0.0 : foot_velocity);
        position = foot + stretch;
        velocity = v;
        reaction = -c * stretch - d * relative;
        energy = m * v * v / 2 + c * stretch * stretch / 2;
    }

private:
    using Plant = sim::Linear<2, 2>;

    void move(double m, double c, double d, double pull, double foot_velocity, double h) noexcept {
        Plant::Equations equations;
        equations.a = {{{0, 1}, {-c / m, -d / m}}};
        equations.b = {{{0, -1}, {1 / m, d / m}}};
        heavy_.step(equations, {pull, foot_velocity}, h);
    }
    /// Without mass: d (x' - foot') = force - c elongation.
    void creep(double c, double d, double pull, double foot_velocity, double h) noexcept {
        double& stretch = heavy_.state[0];
        double slope = 0.0;
        if (d > 0.0) {
            const double rate = c / d;
            const double gone = rate * h;
            // integral of exp(-rate t)
            const double grown = gone > 1e-9 ? -std::expm1(-gone) / rate : h;
            const double change = (pull / d - rate * stretch) * grown;
            stretch += change;
            slope = (pull - c * stretch) / d;
        } else if (c > 0.0) {
            const double before = stretch;
            stretch = pull / c;
            slope = (stretch - before) / h;
        }
        if (!(std::fabs(stretch) + std::fabs(slope) < 1e100)) {
            stretch = slope = 0.0;
        }
        heavy_.state[1] = foot_velocity + slope;
    }

    Plant heavy_;
    double foot_ = 0.0;
    bool started_ = false;
    hal::Retained retained_{*this, {{"heavy", heavy_}, {"foot", foot_}, {"started", started_}}};
};

}  // namespace

HAL_COMPONENT(SpringDamper, "spring_damper", "Simulated mass on a spring and a damper", R"(
    mass x'' = force - stiffness (x - base) - damping (x' - base')

(G. Franklin, J. D. Powell, A. Emami-Naeini, *Feedback Control of Dynamic Systems*, 2.1.) The mass
oscillates at sqrt(stiffness / mass) rad/s with a damping ratio of damping / (2 sqrt(stiffness
mass)); its equilibrium is base + force / stiffness. `reaction` is the force of spring and damper on
the mass.

The equations are solved exactly for a constant force and a base with constant velocity within a
period, so any period is stable. Parameters may change at any time; such a cycle takes a few
microseconds longer. Negative values count as 0. With `mass` 0 spring and damper follow the force
with the time constant damping / stiffness; if all three are 0, nothing moves. The mass starts at 0;
`reset` sets it to the base.

    loadrt spring_damper names=contact
    addf contact.update servo
    setp contact.stiffness 5000
    setp contact.damping 20
    net push    => contact.force
    net surface <= contact.position
)")
