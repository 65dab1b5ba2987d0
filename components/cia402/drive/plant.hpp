// SPDX-License-Identifier: MIT
// The motor behind an axis, its load, and the switches along its travel.
//
//     dT/dt = (T_demand − T) / τ                    closed current loop, first order; solved exactly
//     J dω/dt = T + T_load − b ω − T_c sgn ω        rigid rotor and load with viscous and Coulomb friction, semi-implicit Euler
//     dφ/dt = ω
//     dθ/dt = ((T / T_rated)² − θ) / τ_thermal      heat of the winding, 1 at continuous rated torque (I²t); solved exactly
//
// T torque in N·m, J inertia in kg·m², ω speed in rad/s, φ angle in rad, b in N·m·s/rad, τ in s. At
// rest the Coulomb torque holds against less than itself; a closed brake adds its torque to it.
// (The usual model of a servo axis, as in textbooks on motion control.)
#pragma once

#include <optional>

#include "cia402/drive/axis_settings.hpp"

namespace hal::cia402 {

/// A range [from, to) of the travel.
struct Range {
    double from = 0;
    double to = 0;
    bool holds(double place) const noexcept { return place >= from && place < to; }
    bool exists() const noexcept { return from < to; }
    /// Returns the first place where a motion enters (`rising`) or leaves it. [realtime]
    std::optional<double> edge(double before, double after, bool rising) const noexcept;
};

class Plant {
public:
    explicit Plant(const MotorSettings&) noexcept;  // [setup]
    /// Advances by `dt` s; `torque` in N·m is the demand of the current loop, 0 when it is off.
    /// Stable for any `dt`. [realtime]
    void step(double dt, double torque, double load, bool brake_closed) noexcept;

    double place() const noexcept { return place_; }  ///< encoder increments
    double before() const noexcept { return before_; }  ///< the same, one step ago
    double speed() const noexcept { return speed_; }  ///< rad/s
    double torque() const noexcept { return torque_; }
    double heat() const noexcept { return heat_; }
    double increments_per_radian() const noexcept { return per_radian_; }

    Range negative_limit() const noexcept;
    Range positive_limit() const noexcept;
    Range home() const noexcept { return {motor_.home_from, motor_.home_to}; }
    Range probe(unsigned n) const noexcept { return {motor_.probe_from[n], motor_.probe_to[n]}; }
    /// Returns the first index pulse beyond `from` that the last step passed in `direction`.
    /// [realtime]
    std::optional<double> index_pulse(double from, int direction) const noexcept;
    std::optional<double> index_pulse() const noexcept {
        return index_pulse(before_, place_ < before_ ? -1 : 1);
    }
    const MotorSettings& motor() const noexcept { return motor_; }

private:
    /// What a substep of `length` s leaves of the differences of torque and heat from their goals.
    struct Decay {
        double length = 0;
        double torque = 0;
        double heat = 0;
    };
    /// Returns true when a step changes nothing.
    bool rests(double torque, double load) const noexcept {
        return speed_ == 0 && torque_ == 0 && heat_ == 0 && torque == 0 && load == 0;
    }
    bool within_stops() const noexcept {
        return place_ > motor_.negative_stop && place_ < motor_.positive_stop;
    }

    const MotorSettings motor_;
    const double per_radian_;
    Decay decay_;
    double place_, before_, speed_ = 0, torque_ = 0, heat_ = 0;
};

}  // namespace hal::cia402
