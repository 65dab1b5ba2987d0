// SPDX-License-Identifier: MIT
// The motor of an axis with its encoder, and the loops that make it follow a reference:
//     v* = v_ref + k_p (x_ref − x)                              position, P with feed-forward
//     a  = k_v (v* − v) + ∫ k_i k_v (v* − v) dt                 velocity, PI
//     T  = J (a + a_ref) + b v_ref + T_c sgn v* + offset        within the torque limits; the integral is frozen while they act
// x_ref is the demand at the beginning of the step, v_ref and a_ref those of the step. Around 0 sgn
// is a slope, to avoid chatter.
#pragma once

#include "cia402/drive/axis_scale.hpp"

namespace hal::cia402 {

/// The innermost closed loop that follows the reference.
enum class Control : std::uint8_t { off, position, velocity, torque };

/// The reference of one step.
struct Reference {
    Control control = Control::off;
    Motion motion;  ///< at the end of the step, encoder
    double start = 0;  ///< position at its beginning
    double torque = 0;  ///< N·m
    bool limited = false;  ///< a limit changed it in this step
};

/// What acts on the motor in one step besides the reference.
struct Disturbance {
    double load = 0;  ///< N·m on the shaft
    double torque_offset = 0;  ///< N·m, fed forward in position and velocity control
    bool brake_closed = false;
    bool encoder_broken = false;
};

/// The drivetrain. Positions are encoder increments counted from power-on, not rounded: the loops
/// see the encoder as one that interpolates. [realtime]
class Drivetrain {
public:
    /// Both must outlive it. [setup]
    Drivetrain(const AxisSettings&, const AxisValues&);

    /// The encoder counts from 0 unless it is absolute, and the user's position is that of the
    /// encoder.
    void power_up() noexcept;
    /// Switches the loops off; the reference follows the motor.
    void follow() noexcept;
    /// Changes the closed loop without a jump of the torque.
    void close(Control) noexcept;
    /// Takes the torque of the motor as the integral, for a loop that continues with it.
    void keep_torque() noexcept { integral_ = plant_.torque() / settings_.motor.inertia; }
    /// Keeps the shaft where it is: the reference is the measured position.
    void hold() noexcept { reference.motion = {measured_, 0, 0}; }
    /// Returns a position within the software limits.
    double within_limits(double target) noexcept;
    /// Advances the motor by `dt` s.
    void step(double dt, const Disturbance&) noexcept;

    double position() const noexcept { return measured_; }
    /// Returns the position along the travel at which the encoder counts 0.
    double encoder_zero() const noexcept { return encoder_zero_; }
    /// Returns the speed of the motor, increments/s.
    double speed() const noexcept { return plant_.speed() * plant_.increments_per_radian(); }
    bool standing() const noexcept;
    /// Returns true when the limit switch in a direction is active.
    bool blocked(int direction) const noexcept;
    double velocity_demand() const noexcept { return velocity_demand_; }
    double torque_demand() const noexcept { return torque_demand_; }
    bool saturated() const noexcept { return saturated_; }
    const MotorSettings& motor() const noexcept { return settings_.motor; }
    const Plant& plant() const noexcept { return plant_; }
    AxisScale& scale() noexcept { return scale_; }
    const AxisScale& scale() const noexcept { return scale_; }

    Reference reference;  ///< written by the modes of operation

private:
    double control_torque(double dt, double torque_offset) noexcept;
    double torque_at_speed_limit(double max_speed) noexcept;
    double velocity_loop(double dt, double max_speed, Range torque_limits,
                         double torque_offset) noexcept;

    const AxisSettings& settings_;
    const AxisValues& values_;
    Plant plant_;
    AxisScale scale_;
    double encoder_zero_ = 0;
    double measured_ = 0;
    double integral_ = 0;
    double velocity_demand_ = 0;
    double torque_demand_ = 0;
    bool saturated_ = false;
};

}  // namespace hal::cia402
