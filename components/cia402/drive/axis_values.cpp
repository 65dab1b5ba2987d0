// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_values.hpp"

#include <algorithm>

namespace hal::cia402 {

AxisSettings possible(AxisSettings settings) {
    auto& m = settings.motor;
    const auto at_least = [](double& value, double min) {
        value = value >= min && value < 1e12 ? value : min;
    };
    at_least(m.inertia, 1e-9);
    at_least(m.rated_torque, 1e-6);
    at_least(m.peak_torque, m.rated_torque);
    at_least(m.rated_current, 1e-6);
    at_least(m.rated_voltage, 1e-3);
    at_least(m.highest_speed, 1);
    for (double* none :
         {&m.viscous_friction, &m.coulomb_friction, &m.current_loop_time, &m.thermal_time_constant,
          &m.brake_torque, &m.brake_release, &m.brake_engage}) {
        at_least(*none, 0);
    }
    m.resolution = std::max(m.resolution, 1U);
    return settings;
}

AxisValues::AxisValues(const AxisSettings& settings) {
    const auto& m = settings.motor;
    const auto turn = m.resolution;  // one revolution, in increments
    const auto whole = [](double value) {
        return static_cast<std::uint32_t>(std::clamp(value + 0.5, 0.0, 4294967295.0));
    };
    rated_current = whole(m.rated_current * 1000);
    rated_torque = whole(m.rated_torque * 1000);
    max_torque = max_current = positive_torque_limit = negative_torque_limit =
        static_cast<std::uint16_t>(std::min(65535U, whole(m.peak_torque / m.rated_torque * 1000)));
    dc_link = whole(m.rated_voltage * 1000);
    position_encoder = {turn, 1};
    velocity_encoder = {turn, 1};
    feed = {turn, 1};
    max_motor_speed = vl_max = whole(m.highest_speed);
    max_profile_velocity = whole(m.highest_speed / 60 * turn);
    profile_velocity = std::min(10 * turn, max_profile_velocity);
    profile_acceleration = profile_deceleration = 100 * turn;
    quick_stop_deceleration = 500 * turn;
    max_acceleration = max_deceleration = 1000 * turn;
    following_error_window = turn / 2;
    position_window = std::max(2U, turn / 400);
    velocity_window = static_cast<std::uint16_t>(std::clamp(turn / 10, 2U, 65535U));
    velocity_threshold = static_cast<std::uint16_t>(std::clamp(turn / 20, 2U, 65535U));
    homing_switch_speed = 5 * turn;
    homing_zero_speed = std::max(1U, turn / 2);
    homing_acceleration = 100 * turn;
    for (const auto& row : modes) {
        supported_modes |= bit_of(row.mode);
    }
}

}  // namespace hal::cia402
