// SPDX-License-Identifier: MIT
// The equations of motion of a Furuta pendulum on a base that stands free on a table.
#pragma once

#include <cmath>

#include "motor.hpp"

namespace sim {

/// Angles in rad, speeds in rad/s. The arm turns about the vertical; the pendulum swings in the
/// vertical plane tangent to the arm's circle, 0 hanging straight down.
struct FurutaState {
    double arm = 0.0;
    double pendulum = 0.0;
    double arm_speed = 0.0;
    double pendulum_speed = 0.0;
};

/// Physical constants and what follows from them. SI units. All functions are [any] and free of
/// side effects.
///
/// With q the arm, a the pendulum, L the arm's length, l and m the pendulum's centre of mass and
/// mass,
///   J = arm inertia + m L^2,  K = pendulum inertia about its pivot,  c = m L l:
///   (J + K sin^2 a) q" + c cos a a" + K sin 2a q' a' - c sin a a'^2            = torque - friction(q')
///   c cos a q"         + K a"       - 1/2 K sin 2a q'^2     + m g l sin a      =        - friction(a')
struct FurutaDynamics {
    double gravity;
    // inertia about the vertical axis, the motor's rotor included
    double arm_length, arm_mass, arm_centre, arm_inertia;
    double arm_viscous, arm_coulomb;
    // inertia about its centre of mass, across the rod
    double pendulum_mass, pendulum_centre, pendulum_inertia;
    double pendulum_viscous, pendulum_coulomb;
    // radius of the foot; height of the arm above the table
    double base_mass, base_radius, base_height;

    double fixed_inertia() const noexcept {
        return arm_inertia + pendulum_mass * arm_length * arm_length;
    }
    double swing_inertia() const noexcept {
        return pendulum_inertia + pendulum_mass * pendulum_centre * pendulum_centre;
    }
    double coupling() const noexcept { return pendulum_mass * arm_length * pendulum_centre; }

    struct Acceleration {
        double arm, pendulum;
    };

    /// Accelerations in `s` under a torque on the arm; zeros when the constants make no physical
    /// sense (no inertia).
    Acceleration acceleration(const FurutaState& s, double torque) const noexcept {
        const double sin = std::sin(s.pendulum);
        const double cos = std::cos(s.pendulum);
        const double K = swing_inertia();

        const double c = coupling() * cos;
        const double J = fixed_inertia() + K * sin * sin;
        const double determinant = J * K - c * c;
        if (!(determinant > 0.0)) {
            return {0.0, 0.0};
        }
        const double on_arm = torque - arm_viscous * s.arm_speed -
                              coulomb(arm_coulomb, s.arm_speed) -
                              2.0 * K * sin * cos * s.arm_speed * s.pendulum_speed +
                              coupling() * sin * s.pendulum_speed * s.pendulum_speed;
        const double on_pendulum = -pendulum_viscous * s.pendulum_speed -
                                   coulomb(pendulum_coulomb, s.pendulum_speed) +
                                   K * sin * cos * s.arm_speed * s.arm_speed -
                                   pendulum_mass * gravity * pendulum_centre * sin;
        return {(K * on_arm - c * on_pendulum) / determinant,
                (J * on_pendulum - c * on_arm) / determinant};
    }

    /// The state `dt` seconds later under constant torque: one classical fourth-order Runge-Kutta
    /// step.
    FurutaState step(const FurutaState& s, double torque, double dt) const noexcept {
        const auto slope = [&](const FurutaState& at) {
            const Acceleration a = acceleration(at, torque);
            return FurutaState{at.arm_speed, at.pendulum_speed, a.arm, a.pendulum};
        };
        const auto along = [](const FurutaState& from, const FurutaState& d, double by) {
            return FurutaState{from.arm + by * d.arm, from.pendulum + by * d.pendulum,
                               from.arm_speed + by * d.arm_speed,
                               from.pendulum_speed + by * d.pendulum_speed};
        };
        const FurutaState k1 = slope(s);
        const FurutaState k2 = slope(along(s, k1, dt / 2));

        const FurutaState k3 = slope(along(s, k2, dt / 2));
        const FurutaState k4 = slope(along(s, k3, dt));
        return along(along(along(along(s, k1, dt / 6), k2, dt / 3), k3, dt / 3), k4, dt / 6);
    }

    /// A tap on the pendulum that changes its speed by `change` rad/s: an impulse between nothing
    /// and the pendulum, so the arm recoils by conservation of its own momentum.
    FurutaState pushed(FurutaState s, double change) const noexcept {
        const double sin = std::sin(s.pendulum);
        const double J = fixed_inertia() + swing_inertia() * sin * sin;
        s.pendulum_speed += change;
        if (J > 0.0) {
            s.arm_speed -= coupling() * std::cos(s.pendulum) / J * change;
        }
        return s;
    }

    /// Kinetic and potential energy, J; 0 at rest, hanging.
    double energy(const FurutaState& s) const noexcept {
        const double sin = std::sin(s.pendulum);
        const double cos = std::cos(s.pendulum);
        const double kinetic =
            0.5 * (fixed_inertia() + swing_inertia() * sin * sin) * s.arm_speed * s.arm_speed +
            coupling() * cos * s.arm_speed * s.pendulum_speed +
            0.5 * swing_inertia() * s.pendulum_speed * s.pendulum_speed;
        return kinetic + pendulum_mass * gravity * pendulum_centre * (1.0 - cos);
    }

    /// Where the table's reaction acts, as a part of the foot's radius: at 1 the base begins to
    /// lift. Newton and Euler for arm, rod and base about the middle of the foot, in the frame
    /// (along the arm, across it, up) that turns with it.
    double tip_ratio(const FurutaState& s, const Acceleration& a) const noexcept {
        const double sin = std::sin(s.pendulum);
        const double cos = std::cos(s.pendulum);
        const double w = s.arm_speed;

        const double v = s.pendulum_speed;
        // u = (0, sin, -cos) points along the rod; second derivative of it:
        const double u1 = -2.0 * cos * v * w - sin * a.arm;
        const double u2 = cos * a.pendulum - sin * v * v - sin * w * w;
        const double u3 = sin * a.pendulum + cos * v * v;
        const double l = pendulum_centre;
        const double m = pendulum_mass;
        // Inertia forces of the rod at its centre, of the arm at its centre, with weight: what the
        // base has to carry.
        const double p1 = m * (-arm_length * w * w + l * u1);

        const double p2 = m * (arm_length * a.arm + l * u2);
        const double p3 = m * (gravity + l * u3);
        const double q1 = arm_mass * -arm_centre * w * w;
        const double q2 = arm_mass * arm_centre * a.arm;

        const double q3 = arm_mass * gravity;
        // Moments r x F about the two horizontal axes; the rod's own spin adds I u x u".
        const double y = l * sin;
        const double z = base_height - l * cos;
        const double x = arm_length;
        const double along =
            y * p3 - z * p2 - base_height * q2 + pendulum_inertia * (sin * u3 + cos * u2);
        const double across =
            z * p1 - x * p3 + base_height * q1 - arm_centre * q3 - pendulum_inertia * cos * u1;
        const double holding = (base_mass * gravity + p3 + q3) * base_radius;
        return holding > 0.0 ? std::hypot(along, across) / holding : 1e9;
    }
};

}  // namespace sim
