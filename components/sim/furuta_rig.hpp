// SPDX-License-Identifier: MIT
// The Furuta rig as a thing: amplifier, motor, arm, pendulum, encoders, radio, and the base it
// stands on. The component furuta and the CANopen device at the end of a wire are two ways to it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "furuta_dynamics.hpp"
#include "motor.hpp"
#include "quadrature.hpp"

namespace sim {

/// Parameters of the rig in SI units; furuta.cpp documents their sources.
struct FurutaConstants {
    double supply = 24.0;
    double current_limit = 4.0;
    double torque_constant = 0.0677;
    double resistance = 0.68;

    double inductance = 0.001;
    double rotor_inertia = 7.5e-5;
    double arm_length = 0.2;
    double arm_mass = 0.2;
    double arm_centre = 0.1;
    double arm_inertia = 6.667e-4;

    double arm_viscous = 5e-4;
    double arm_coulomb = 0.008;
    double pendulum_mass = 0.1;
    double pendulum_centre = 0.15;
    double pendulum_inertia = 7.5e-4;

    double pendulum_viscous = 2e-4;
    double pendulum_coulomb = 5e-5;
    double base_mass = 2.5;
    double base_radius = 0.08;
    double base_height = 0.4;
    double lift_hold = 0.1;
    double gravity = 9.80665;
    double radio_delay = 0.003;
    std::int64_t encoder_counts = 2000;

    FurutaDynamics dynamics() const noexcept {
        return {.gravity = gravity,
                .arm_length = arm_length,
                .arm_mass = arm_mass,
                .arm_centre = arm_centre,
                .arm_inertia = rotor_inertia + arm_inertia + arm_mass * arm_centre * arm_centre,
                .arm_viscous = arm_viscous,
                .arm_coulomb = arm_coulomb,
                .pendulum_mass = pendulum_mass,
                .pendulum_centre = pendulum_centre,
                .pendulum_inertia = pendulum_inertia,
                .pendulum_viscous = pendulum_viscous,
                .pendulum_coulomb = pendulum_coulomb,
                .base_mass = base_mass,
                .base_radius = base_radius,
                .base_height = base_height};
    }
};

/// An encoder read over a radio: each count comes out a fixed time after it went in.
class DelayedCount {
public:
    /// Puts in the count of now and gives the one of `delay` ago. [realtime]
    std::int64_t pass(std::int64_t count, std::int64_t now_ns, std::int64_t delay_ns) noexcept {
        if (count != last_in_) {
            // full: the oldest comes early
            if (in_ - out_ == edges_.size()) {
                last_out_ = edges_[out_++ % edges_.size()].count;
            }
            edges_[in_++ % edges_.size()] = {count, now_ns};
            last_in_ = count;
        }
        while (out_ != in_ && now_ns - edges_[out_ % edges_.size()].at_ns >= delay_ns) {
            last_out_ = edges_[out_++ % edges_.size()].count;
        }
        return last_out_;
    }
    void clear(std::int64_t count) noexcept {
        in_ = out_ = 0;
        last_in_ = last_out_ = count;
    }

private:
    struct Edge {
        std::int64_t count, at_ns;
    };
    std::array<Edge, 4096> edges_{};
    std::size_t in_ = 0;
    std::size_t out_ = 0;
    std::int64_t last_in_ = 0;
    std::int64_t last_out_ = 0;
};

/// The state and what moves it on. All functions are [realtime].
class FurutaRig {
public:
    /// At rest with these angles.
    void rest(const FurutaConstants& of, double arm, double pendulum) noexcept {
        state_ = {arm, pendulum, 0.0, 0.0};
        current_ = 0.0;
        lifted_ns_ = 0;
        delayed_.clear(counts_at(state_.pendulum, of.encoder_counts));
    }
    /// A tap that gives the pendulum's centre of mass this speed.
    void tap(const FurutaConstants& of, double speed) noexcept {
        if (of.pendulum_centre > 0.0 && std::isfinite(speed)) {
            state_ = of.dynamics().pushed(state_, speed / of.pendulum_centre);
        }
    }
    /// Simulates one period with that voltage. `enable` false: the motor current is 0. Returns
    /// false if the state became NaN or infinite.
    bool step(const FurutaConstants& of, double voltage, bool enable,
              std::int64_t period_ns) noexcept {
        const FurutaDynamics rig = of.dynamics();
        const Winding winding{of.resistance, of.inductance, of.torque_constant, of.current_limit};
        const double applied = std::clamp(voltage, -std::abs(of.supply), std::abs(of.supply));
        const std::int64_t steps =
            std::max<std::int64_t>(1, (period_ns + max_step_ns - 1) / max_step_ns);
        const double dt = static_cast<double>(period_ns) * 1e-9 / static_cast<double>(steps);
        torque_ = 0.0;
        for (std::int64_t i = 0; i < steps; ++i) {
            const double before = current_;
            current_ = enable ? winding.step(current_, applied, state_.arm_speed, dt) : 0.0;
            torque_ = of.torque_constant * 0.5 * (before + current_);
            state_ = rig.step(state_, torque_, dt);
        }
        return std::isfinite(state_.arm + state_.pendulum + state_.arm_speed +
                             state_.pendulum_speed + current_);
    }
    /// After step(), or after rest() took its place: what encoders and base show.
    void show(const FurutaConstants& of, std::int64_t period_ns) noexcept {
        now_ns_ += period_ns;
        arm_count_ = counts_at(state_.arm, of.encoder_counts);
        pendulum_count_ = delayed_.pass(counts_at(state_.pendulum, of.encoder_counts), now_ns_,
                                        nanoseconds(of.radio_delay));
        const FurutaDynamics rig = of.dynamics();
        tip_ratio_ = rig.tip_ratio(state_, rig.acceleration(state_, torque_));
        lifted_ns_ = std::max<std::int64_t>(0, lifted_ns_ - period_ns);
        if (tip_ratio_ > 1.0) {
            lifted_ns_ = nanoseconds(of.lift_hold) + 1;
        }
    }

    const FurutaState& state() const noexcept { return state_; }
    double current() const noexcept { return current_; }
    double torque() const noexcept { return torque_; }
    std::int64_t arm_count() const noexcept { return arm_count_; }
    std::int64_t pendulum_count() const noexcept { return pendulum_count_; }  ///< behind the radio
    double tip_ratio() const noexcept { return tip_ratio_; }
    bool tipped() const noexcept { return lifted_ns_ > 0; }

private:
    // the fastest mode is some 100 rad/s: an error far below 1e-9
    static constexpr std::int64_t max_step_ns = 100'000;

    /// Limits to ten seconds; NaN counts as 0.
    static std::int64_t nanoseconds(double seconds) noexcept {
        return seconds > 0.0 ? static_cast<std::int64_t>(std::min(seconds, 10.0) * 1e9) : 0;
    }

    FurutaState state_;
    double current_ = 0.0;
    double torque_ = 0.0;
    double tip_ratio_ = 0.0;
    // lifted_ns_: until the base is down again
    std::int64_t arm_count_ = 0;
    std::int64_t pendulum_count_ = 0;
    std::int64_t now_ns_ = 0;
    std::int64_t lifted_ns_ = 0;
    DelayedCount delayed_;
};

}  // namespace sim
