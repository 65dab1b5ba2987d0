// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "linear.hpp"

namespace {

struct TwoMass : hal::Component {
    using Component::Component;

    hal::In<double> torque{*this, "torque", "motor torque", {.unit = "N*m"}};
    hal::In<double> load_torque{
        *this, "load-torque", "load torque, positive against positive rotation", {.unit = "N*m"}};
    hal::In<bool> reset{*this, "reset", "TRUE holds both masses at 0"};

    hal::Param<double> motor_inertia{
        *this, "motor-inertia", "inertia of the motor", {.initial = 2e-4, .unit = "kg*m^2"}};
    hal::Param<double> load_inertia{
        *this, "load-inertia", "inertia of the load", {.initial = 1e-3, .unit = "kg*m^2"}};
    hal::Param<double> stiffness{*this,
                                 "stiffness",
                                 "stiffness of the shaft between them",
                                 {.initial = 20.0, .unit = "N*m/rad"}};
    hal::Param<double> damping{*this,
                               "damping",
                               "damping of the shaft between them",
                               {.initial = 2e-3, .unit = "N*m*s/rad"}};
    hal::Param<double> motor_viscous{*this,
                                     "motor-viscous",
                                     "viscous friction of the motor",
                                     {.initial = 1e-4, .unit = "N*m*s/rad"}};
    hal::Param<double> load_viscous{*this,
                                    "load-viscous",
                                    "viscous friction of the load",
                                    {.initial = 1e-3, .unit = "N*m*s/rad"}};
    hal::Param<double> pitch{
        *this, "pitch", "position units per revolution (a screw's pitch in mm)", {.initial = 1.0}};

    hal::Out<double> motor_angle{
        *this, "motor-angle", "angle of the motor", {.unit = "rad", .finite = true}};
    hal::Out<double> motor_velocity{
        *this, "motor-velocity", "speed of the motor", {.unit = "rad/s", .finite = true}};
    hal::Out<double> load_angle{
        *this, "load-angle", "angle of the load", {.unit = "rad", .finite = true}};
    hal::Out<double> load_velocity{
        *this, "load-velocity", "speed of the load", {.unit = "rad/s", .finite = true}};
    hal::Out<double> twist{*this,
                           "twist",
                           "twist of the shaft: motor angle - load angle",
                           {.unit = "rad", .finite = true}};
    hal::Out<double> shaft_torque{*this,
                                  "shaft-torque",
                                  "torque from the motor to the load",
                                  {.unit = "N*m", .finite = true}};
    hal::Out<double> motor_position{
        *this, "motor-position", "revolutions of the motor * pitch", {.finite = true}};
    hal::Out<double> load_position{
        *this, "load-position", "revolutions of the load * pitch", {.finite = true}};

    hal::Function run{*this, "update", &TwoMass::update, "simulates one period"};

    void update(hal::Cycle cycle) noexcept {
        const double j1 = sim::sane(motor_inertia, 1e-12);
        const double j2 = sim::sane(load_inertia, 1e-12);
        const double c = sim::sane(stiffness, 0.0);
        const double d = sim::sane(damping, 0.0);
        const double b1 = sim::sane(motor_viscous, 0.0);
        const double b2 = sim::sane(load_viscous, 0.0);
        Plant::Equations equations;
        equations.a = {{{0, 1, 0, -1},  // twist, motor-velocity, load-angle, load-velocity
                        {-c / j1, -(d + b1) / j1, 0, d / j1},
                        {0, 0, 0, 1},
                        {c / j2, d / j2, 0, -(d + b2) / j2}}};
        equations.b = {{{0, 0}, {1 / j1, 0}, {0, 0}, {0, -1 / j2}}};
        if (reset) {
            plant_.state = {};
        } else {
            plant_.step(equations, {sim::force(torque), sim::force(load_torque)}, cycle.seconds());
        }

        const auto& [angle, w1, load, w2] = plant_.state;
        const double scale = std::fabs(pitch) < 1e15 ? pitch / (2 * std::numbers::pi) : 0.0;
        twist = angle;
        motor_velocity = w1;
        load_angle = load;
        load_velocity = w2;
        motor_angle = load + angle;
        shaft_torque = c * angle + d * (w1 - w2);
        motor_position = (load + angle) * scale;
        load_position = load * scale;
    }

private:
    using Plant = sim::Linear<4, 2>;
    Plant plant_;
    hal::Retained retained_{*this, {{"plant", plant_}}};
};

}  // namespace

HAL_COMPONENT(TwoMass, "two_mass", "Simulated motor and load on an elastic shaft", R"(
    motor-inertia w1' = torque - shaft - motor-viscous w1
    load-inertia w2'  = shaft - load-torque - load-viscous w2
    shaft             = stiffness (angle1 - angle2) + damping (w1 - w2)

The usual model of a drive with an elastic coupling, belt or screw (G. Franklin, J. D. Powell, A.
Emami-Naeini, *Feedback Control of Dynamic Systems*, 2.1; D. Schroeder, *Elektrische Antriebe -
Regelung von Antriebssystemen*, "Zweimassensystem"). Without damping the load alone oscillates at
sqrt(stiffness / load-inertia), both against each other at sqrt(stiffness (1 / motor-inertia + 1 /
load-inertia)) rad/s. For a linear axis use kg, N and m (and ignore `pitch`).

The equations are solved exactly for constant torques within a period, so any period is stable and
the result does not depend on it. Parameters may change at any time; such a cycle takes a few
microseconds longer. Negative values count as 0; an inertia is at least 1e-12.

    loadrt two_mass names=x-drive
    addf x-drive.update servo
    setp x-drive.stiffness 50
    net x-torque   => x-drive.torque
    net x-angle    <= x-drive.motor-angle
    net x-carriage <= x-drive.load-position
)")
