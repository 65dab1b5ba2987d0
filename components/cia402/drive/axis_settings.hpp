// SPDX-License-Identifier: MIT
// The settings of a simulated axis, and what can be seen of it from the machine, not from the bus.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "cia402/drive_profile.hpp"

namespace hal::cia402 {

/// The motor, its load, and the switches along its travel. Places along the travel are in encoder
/// increments; 0 is index pulse 0. A switch or mark whose first place is not below its second does
/// not exist. Impossible values, such as an inertia of 0, are replaced by the smallest possible
/// ones.
struct MotorSettings {
    double inertia = 5e-5;  ///< of rotor and load, at the motor shaft, kg·m²
    double viscous_friction = 1e-5;  ///< N·m·s/rad
    double coulomb_friction = 0.005;  ///< N·m
    double rated_torque = 0.3;  ///< N·m, continuous
    double peak_torque = 0.9;  ///< N·m, short-term
    double rated_current = 3.0;  ///< A, at the rated torque
    double thermal_time_constant = 10;  ///< s, of the winding, for the over-current fault
    double current_loop_time = 0.0005;  ///< s, time constant of the closed current loop
    double rated_voltage = 48;  ///< V, of the DC link; the drive works at 70..130 % of it
    double highest_speed = 6000;  ///< r/min
    std::uint32_t resolution = 4096;  ///< encoder increments per revolution
    /// one per revolution, where the increments are a multiple of the resolution
    bool index_pulse = true;
    /// the encoder keeps its count without power, and counts 0 at place 0
    bool absolute_encoder = false;
    double start = 0;  ///< place at power-on, where another encoder counts 0
    double negative_limit = -204800;
    double positive_limit = 204800;  ///< limit switches are active beyond
    double negative_stop = -208896;
    double positive_stop = 208896;  ///< mechanical stops
    /// the home switch is active in [from, to)
    double home_from = 20480;
    double home_to = 24576;
    /// touch probes 1 and 2
    std::array<double, 2> probe_from{30000, 40000}, probe_to{30100, 40100};
    double brake_torque = 0;  ///< N·m, holding torque; 0: no brake
    double brake_release = 0.02;
    double brake_engage = 0.02;  ///< s

    /// Removes limit switches and stops: a wheel. Returns itself. [setup]
    MotorSettings& endless() {
        negative_limit = negative_stop = -std::numeric_limits<double>::infinity();
        positive_limit = positive_stop = std::numeric_limits<double>::infinity();
        return *this;
    }
};

/// Gains of the position and velocity loops. The drive feeds forward motor model and set-points, so
/// the loops act on errors only.
struct LoopSettings {
    double position = 60;  ///< velocity demanded per position error, 1/s
    double velocity = 250;  ///< acceleration demanded per velocity error, 1/s
    double integral = 40;  ///< 1/s, of the velocity error on top
    double feed_forward = 1;  ///< fraction of the acceleration torque that is fed forward
};

/// Settings of one axis.
struct AxisSettings {
    MotorSettings motor{};
    LoopSettings loop{};
};

/// Returns the settings with impossible values of the motor (inertia, torque, speed, encoder)
/// replaced by possible ones. [setup]
AxisSettings possible(AxisSettings);

/// Status of an axis as seen from the machine, not from the bus.
struct AxisStatus {
    State state = State::not_ready_to_switch_on;
    Mode mode = Mode::none;
    bool homed = false;  ///< since power-on
    bool brake_closed = false;
    std::uint16_t error_code = 0;  ///< 603Fh
    std::uint32_t inputs = 0;  ///< 60FDh
    std::uint32_t outputs = 0;  ///< 60FEh:1 under its mask
    double place = 0;  ///< along the travel, encoder increments, not rounded
    double speed = 0;  ///< r/min
    double torque = 0;  ///< N·m of the motor
    double current = 0;  ///< A
};

}  // namespace hal::cia402
