// SPDX-License-Identifier: MIT
// The values of the objects of one axis, without an object dictionary: a bus binds its dictionary
// to them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "cia402/drive/axis_settings.hpp"

namespace hal::cia402 {

/// Manufacturer-specific objects, 0x800 further up for each axis: external torque in mN·m, and
/// simulated faults.
inline constexpr std::uint16_t load_torque_simulated = 0x2010;
inline constexpr std::uint16_t faults_simulated = 0x2011;
namespace simulated {
inline constexpr std::uint16_t encoder_broken = 0x01;
inline constexpr std::uint16_t over_voltage = 0x02;
inline constexpr std::uint16_t under_voltage = 0x04;

inline constexpr std::uint16_t over_temperature = 0x08;
inline constexpr std::uint16_t over_current = 0x10;
}  // namespace simulated

inline constexpr std::array<std::int8_t, 32> homing_methods{
    1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 17, 18,
    19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 33, 34, 35, 37};
inline constexpr unsigned interpolation_capacity = 32;
inline constexpr std::uint32_t no_window = 0xffffffff;  ///< of 6065h and 6067h: not monitored

/// A numerator over a denominator.
struct Ratio {
    std::uint32_t numerator = 1;
    std::uint32_t denominator = 1;
    double value() const noexcept {
        return denominator == 0 ? 1.0 : static_cast<double>(numerator) / denominator;
    }
};
/// A ramp of vl: a speed in r/min per time in s.
struct Ramp {
    std::uint32_t speed = 1000;
    std::uint16_t time = 1;
};

/// The values of the objects. The dictionary writes command values, the axis writes actual values;
/// both in one thread.
struct AxisValues {
    std::int32_t load_torque = 0;
    std::uint16_t simulated_faults = 0;
    std::int16_t abort_connection_option = 1;
    std::uint16_t error_code = 0;
    std::uint16_t controlword = 0;
    std::uint16_t statusword = 0;
    std::int16_t vl_target = 0;
    std::int16_t vl_demand = 0;
    std::int16_t vl_actual = 0;
    std::uint32_t vl_min = 0;
    std::uint32_t vl_max = 6000;
    Ramp vl_acceleration, vl_deceleration, vl_quick_stop{5000, 1};
    std::int16_t vl_set_point_numerator = 1;
    std::int16_t vl_set_point_denominator = 1;
    std::int32_t vl_dimension_numerator = 1;
    std::int32_t vl_dimension_denominator = 1;
    std::int16_t quick_stop_option = 2;
    std::int16_t shutdown_option = 0;
    std::int16_t disable_operation_option = 1;

    std::int16_t halt_option = 1;
    std::int16_t fault_reaction_option = 2;
    std::int8_t mode = 1;
    std::int8_t mode_display = 1;
    std::int32_t position_demand = 0;
    std::int32_t position_actual_internal = 0;
    std::int32_t position_actual = 0;
    std::uint32_t following_error_window = 2048;
    std::uint16_t following_error_timeout = 10;
    std::uint32_t position_window = 10;
    std::uint16_t position_window_time = 5;
    std::int32_t velocity_sensor = 0;
    std::int32_t velocity_demand = 0;
    std::int32_t velocity_actual = 0;
    std::uint16_t velocity_window = 400;
    std::uint16_t velocity_window_time = 5;
    std::uint16_t velocity_threshold = 200;

    std::uint16_t velocity_threshold_time = 5;
    std::int16_t target_torque = 0;
    std::uint16_t max_torque = 3000;
    std::uint16_t max_current = 3000;
    std::int16_t torque_demand = 0;
    std::uint32_t rated_current = 0;
    std::uint32_t rated_torque = 0;
    std::int16_t torque_actual = 0;
    std::int16_t current_actual = 0;
    std::uint32_t dc_link = 0;
    std::int32_t target_position = 0;
    std::int32_t range_min = 0;
    std::int32_t range_max = 0;
    std::int32_t home_offset = 0;
    std::int32_t software_min = std::numeric_limits<std::int32_t>::min();

    std::int32_t software_max = std::numeric_limits<std::int32_t>::max();
    std::uint8_t polarity = 0;
    std::uint32_t max_profile_velocity = 0;
    std::uint32_t max_motor_speed = 0;
    std::uint32_t profile_velocity = 0;

    std::uint32_t end_velocity = 0;
    std::uint32_t profile_acceleration = 0;
    std::uint32_t profile_deceleration = 0;

    std::uint32_t quick_stop_deceleration = 0;
    std::int16_t motion_profile_type = 0;
    std::uint8_t profile_jerk_use = 1;
    std::uint32_t profile_jerk = 0;
    std::uint32_t torque_slope = 10000;
    std::int16_t torque_profile_type = 0;
    Ratio position_encoder, velocity_encoder, gear, feed, velocity_factor, acceleration_factor;
    std::int8_t homing_method = 0;
    std::uint32_t homing_switch_speed = 0;
    std::uint32_t homing_zero_speed = 0;
    std::uint32_t homing_acceleration = 0;
    std::uint32_t position_unit = 0;
    std::uint32_t velocity_unit = 0;
    std::uint32_t acceleration_unit = 0;
    std::int32_t position_offset = 0;
    std::int32_t velocity_offset = 0;
    std::int16_t torque_offset = 0;
    std::uint16_t probe_function = 0;
    std::uint16_t probe_status = 0;
    std::array<std::int32_t, 4> probe_positions{};
    std::int16_t interpolation_submode = 0;
    std::int32_t interpolation_record = 0;
    std::uint8_t interpolation_period = 1;
    std::int8_t interpolation_exponent = -3;
    std::uint32_t buffer_capacity = interpolation_capacity;
    std::uint32_t buffer_size = interpolation_capacity;
    std::uint8_t buffer_organisation = 0;
    std::uint16_t buffer_position = 0;
    std::uint8_t buffer_record_size = 4;
    std::uint8_t buffer_clear = 1;
    std::uint32_t max_acceleration = 0;
    std::uint32_t max_deceleration = 0;
    std::uint16_t positive_torque_limit = 3000;
    std::uint16_t negative_torque_limit = 3000;
    std::int32_t additional_position = 0;
    std::uint16_t positioning_option = 0;
    std::int32_t following_error = 0;
    std::int32_t max_slippage = 0;
    std::int32_t control_effort = 0;

    std::int32_t position_demand_internal = 0;
    std::uint32_t inputs = 0;
    std::uint32_t outputs = 0;
    std::uint32_t output_mask = 0;
    std::int32_t target_velocity = 0;
    std::uint16_t motor_type = 0x000a;  // sinusoidal permanent-magnet brushless
    std::uint32_t supported_modes = 0;
    std::uint32_t type = servo_drive | profile_number;
    std::array<std::int8_t, homing_methods.size()> supported_homing = homing_methods;

    /// Sets the initial values for a motor; units are encoder increments. [setup]
    explicit AxisValues(const AxisSettings&);
};

}  // namespace hal::cia402
