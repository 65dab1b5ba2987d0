// SPDX-License-Identifier: MIT
// The objects of one axis: each is declared once; the dictionary of a drive on any bus and its
// binding come from the list below, the first values from `axis_values.hpp`.
#pragma once

#include <cstdint>
#include <limits>

#include "cia301/shorthand.hpp"
#include "cia402/drive/axis_values.hpp"

namespace hal::cia402 {

using cia301::Access;

/// Properties of an object besides its value.
struct ObjectRow {
    enum Pdo : std::uint8_t { no_pdo, sent, received, both };
    std::uint16_t index;
    std::uint8_t sub;
    Access access;
    Pdo pdo;
    const char* name;
    std::int64_t low = 0;
    std::int64_t high = 0;  ///< both 0: the limits of the type
};

/// Calls f(row, value) for every object of the first axis. [setup]
template <class F>
void each_object(AxisValues& o, F&& f) {
    using namespace cia301::shorthand;
    using namespace object;
    constexpr auto no = ObjectRow::no_pdo;
    constexpr auto tx = ObjectRow::sent;
    constexpr auto rx = ObjectRow::received;
    constexpr auto both = ObjectRow::both;
    const auto ramp = [&](std::uint16_t index, Ramp& r) {
        f(ObjectRow{index, 1, rw, no, "Delta speed"}, r.speed);
        f(ObjectRow{index, 2, rw, no, "Delta time"}, r.time);
    };
    const auto ratio = [&](std::uint16_t index, Ratio& r, const char* numerator,
                           const char* denominator) {
        constexpr std::int64_t max = std::numeric_limits<std::uint32_t>::max();
        f(ObjectRow{index, 1, rw, no, numerator, 1, max}, r.numerator);
        f(ObjectRow{index, 2, rw, no, denominator, 1, max}, r.denominator);
    };
    f(ObjectRow{load_torque_simulated, 0, rw, rx, "Load torque"}, o.load_torque);
    f(ObjectRow{faults_simulated, 0, rw, rx, "Simulated faults"}, o.simulated_faults);
    f(ObjectRow{abort_connection_option, 0, rw, no, "Abort connection option code", 0, 3},
      o.abort_connection_option);
    f(ObjectRow{error_code, 0, ro, tx, "Error code"}, o.error_code);
    f(ObjectRow{controlword, 0, rw, rx, "Controlword"}, o.controlword);
    f(ObjectRow{statusword, 0, ro, tx, "Statusword"}, o.statusword);
    f(ObjectRow{vl_target_velocity, 0, rw, rx, "vl target velocity"}, o.vl_target);
    f(ObjectRow{vl_velocity_demand, 0, ro, tx, "vl velocity demand"}, o.vl_demand);
    f(ObjectRow{vl_control_effort, 0, ro, tx, "vl velocity actual value"}, o.vl_actual);
    f(ObjectRow{vl_velocity_min_max, 1, rw, no, "vl velocity min amount"}, o.vl_min);
    f(ObjectRow{vl_velocity_min_max, 2, rw, no, "vl velocity max amount"}, o.vl_max);
    ramp(vl_velocity_acceleration, o.vl_acceleration);
    ramp(vl_velocity_deceleration, o.vl_deceleration);
    ramp(vl_velocity_quick_stop, o.vl_quick_stop);
    f(ObjectRow{vl_set_point_factor, 1, rw, no, "vl set-point factor numerator", 1, 32767},
      o.vl_set_point_numerator);
    f(ObjectRow{vl_set_point_factor, 2, rw, no, "vl set-point factor denominator", 1, 32767},
      o.vl_set_point_denominator);
    f(ObjectRow{vl_dimension_factor, 1, rw, no, "vl dimension factor numerator", 1, 0x7fffffff},
      o.vl_dimension_numerator);
    f(ObjectRow{vl_dimension_factor, 2, rw, no, "vl dimension factor denominator", 1, 0x7fffffff},
      o.vl_dimension_denominator);
    f(ObjectRow{quick_stop_option, 0, rw, no, "Quick stop option code", 0, 8}, o.quick_stop_option);
    f(ObjectRow{shutdown_option, 0, rw, no, "Shutdown option code", 0, 1}, o.shutdown_option);
    f(ObjectRow{disable_operation_option, 0, rw, no, "Disable operation option code", 0, 1},
      o.disable_operation_option);
    f(ObjectRow{halt_option, 0, rw, no, "Halt option code", 1, 4}, o.halt_option);
    f(ObjectRow{fault_reaction_option, 0, rw, no, "Fault reaction option code", 0, 4},
      o.fault_reaction_option);
    f(ObjectRow{modes_of_operation, 0, rw, rx, "Modes of operation"}, o.mode);
    f(ObjectRow{modes_of_operation_display, 0, ro, tx, "Modes of operation display"},
      o.mode_display);
    f(ObjectRow{position_demand, 0, ro, tx, "Position demand value"}, o.position_demand);
    f(ObjectRow{position_actual_internal, 0, ro, tx, "Position actual internal value"},
      o.position_actual_internal);
    f(ObjectRow{position_actual, 0, ro, tx, "Position actual value"}, o.position_actual);
    f(ObjectRow{following_error_window, 0, rw, rx, "Following error window"},
      o.following_error_window);
    f(ObjectRow{following_error_timeout, 0, rw, no, "Following error time out"},
      o.following_error_timeout);
    f(ObjectRow{position_window, 0, rw, no, "Position window"}, o.position_window);
    f(ObjectRow{position_window_time, 0, rw, no, "Position window time"}, o.position_window_time);
    f(ObjectRow{velocity_sensor_actual, 0, ro, tx, "Velocity sensor actual value"},
      o.velocity_sensor);
    f(ObjectRow{velocity_demand, 0, ro, tx, "Velocity demand value"}, o.velocity_demand);
    f(ObjectRow{velocity_actual, 0, ro, tx, "Velocity actual value"}, o.velocity_actual);
    f(ObjectRow{velocity_window, 0, rw, no, "Velocity window"}, o.velocity_window);
    f(ObjectRow{velocity_window_time, 0, rw, no, "Velocity window time"}, o.velocity_window_time);
    f(ObjectRow{velocity_threshold, 0, rw, no, "Velocity threshold"}, o.velocity_threshold);
    f(ObjectRow{velocity_threshold_time, 0, rw, no, "Velocity threshold time"},
      o.velocity_threshold_time);
    f(ObjectRow{target_torque, 0, rw, rx, "Target torque"}, o.target_torque);
    f(ObjectRow{max_torque, 0, rw, rx, "Max torque"}, o.max_torque);
    f(ObjectRow{max_current, 0, rw, rx, "Max current"}, o.max_current);
    f(ObjectRow{torque_demand, 0, ro, tx, "Torque demand"}, o.torque_demand);
    f(ObjectRow{motor_rated_current, 0, rw, no, "Motor rated current"}, o.rated_current);
    f(ObjectRow{motor_rated_torque, 0, rw, no, "Motor rated torque"}, o.rated_torque);
    f(ObjectRow{torque_actual, 0, ro, tx, "Torque actual value"}, o.torque_actual);
    f(ObjectRow{current_actual, 0, ro, tx, "Current actual value"}, o.current_actual);
    f(ObjectRow{dc_link_voltage, 0, ro, tx, "DC link circuit voltage"}, o.dc_link);
    f(ObjectRow{target_position, 0, rw, both, "Target position"}, o.target_position);
    f(ObjectRow{position_range_limit, 1, rw, no, "Min position range limit"}, o.range_min);
    f(ObjectRow{position_range_limit, 2, rw, no, "Max position range limit"}, o.range_max);
    f(ObjectRow{home_offset, 0, rw, no, "Home offset"}, o.home_offset);
    f(ObjectRow{software_position_limit, 1, rw, no, "Min position limit"}, o.software_min);
    f(ObjectRow{software_position_limit, 2, rw, no, "Max position limit"}, o.software_max);
    f(ObjectRow{polarity, 0, rw, no, "Polarity"}, o.polarity);
    f(ObjectRow{max_profile_velocity, 0, rw, rx, "Max profile velocity"}, o.max_profile_velocity);
    f(ObjectRow{max_motor_speed, 0, rw, no, "Max motor speed"}, o.max_motor_speed);
    f(ObjectRow{profile_velocity, 0, rw, rx, "Profile velocity"}, o.profile_velocity);
    f(ObjectRow{end_velocity, 0, rw, rx, "End velocity"}, o.end_velocity);
    f(ObjectRow{profile_acceleration, 0, rw, rx, "Profile acceleration"}, o.profile_acceleration);
    f(ObjectRow{profile_deceleration, 0, rw, rx, "Profile deceleration"}, o.profile_deceleration);
    f(ObjectRow{quick_stop_deceleration, 0, rw, rx, "Quick stop deceleration"},
      o.quick_stop_deceleration);
    f(ObjectRow{motion_profile_type, 0, rw, no, "Motion profile type"}, o.motion_profile_type);
    f(ObjectRow{object::profile_jerk_use, 0, rw, no, "Profile jerk use"}, o.profile_jerk_use);
    f(ObjectRow{object::profile_jerk, 1, rw, no, "Profile jerk"}, o.profile_jerk);
    f(ObjectRow{torque_slope, 0, rw, rx, "Torque slope"}, o.torque_slope);
    f(ObjectRow{torque_profile_type, 0, rw, no, "Torque profile type"}, o.torque_profile_type);
    ratio(position_encoder_resolution, o.position_encoder, "Encoder increments",
          "Motor revolutions");
    ratio(velocity_encoder_resolution, o.velocity_encoder, "Encoder increments per second",
          "Motor revolutions per second");
    ratio(gear_ratio, o.gear, "Motor revolutions", "Shaft revolutions");
    ratio(feed_constant, o.feed, "Feed", "Shaft revolutions");
    ratio(velocity_factor, o.velocity_factor, "Velocity factor numerator",
          "Velocity factor divisor");
    ratio(acceleration_factor, o.acceleration_factor, "Acceleration factor numerator",
          "Acceleration factor divisor");
    f(ObjectRow{homing_method, 0, rw, rx, "Homing method"}, o.homing_method);
    f(ObjectRow{homing_speeds, 1, rw, no, "Speed during search for switch"}, o.homing_switch_speed);
    f(ObjectRow{homing_speeds, 2, rw, no, "Speed during search for zero"}, o.homing_zero_speed);
    f(ObjectRow{homing_acceleration, 0, rw, no, "Homing acceleration"}, o.homing_acceleration);
    f(ObjectRow{position_unit, 0, rw, no, "SI unit position"}, o.position_unit);
    f(ObjectRow{velocity_unit, 0, rw, no, "SI unit velocity"}, o.velocity_unit);
    f(ObjectRow{acceleration_unit, 0, rw, no, "SI unit acceleration"}, o.acceleration_unit);
    f(ObjectRow{position_offset, 0, rw, rx, "Position offset"}, o.position_offset);
    f(ObjectRow{velocity_offset, 0, rw, rx, "Velocity offset"}, o.velocity_offset);
    f(ObjectRow{torque_offset, 0, rw, rx, "Torque offset"}, o.torque_offset);
    f(ObjectRow{touch_probe_function, 0, rw, rx, "Touch probe function"}, o.probe_function);
    f(ObjectRow{touch_probe_status, 0, ro, tx, "Touch probe status"}, o.probe_status);
    f(ObjectRow{touch_probe_1_positive, 0, ro, tx, "Touch probe 1 positive edge"},
      o.probe_positions[0]);
    f(ObjectRow{touch_probe_1_negative, 0, ro, tx, "Touch probe 1 negative edge"},
      o.probe_positions[1]);
    f(ObjectRow{touch_probe_2_positive, 0, ro, tx, "Touch probe 2 positive edge"},
      o.probe_positions[2]);
    f(ObjectRow{touch_probe_2_negative, 0, ro, tx, "Touch probe 2 negative edge"},
      o.probe_positions[3]);
    f(ObjectRow{interpolation_submode, 0, rw, no, "Interpolation sub mode select"},
      o.interpolation_submode);
    f(ObjectRow{interpolation_data, 1, rw, rx, "Interpolation data record"},
      o.interpolation_record);
    f(ObjectRow{interpolation_period, 1, rw, no, "Interpolation time period value"},
      o.interpolation_period);
    f(ObjectRow{interpolation_period, 2, rw, no, "Interpolation time index", -6, 0},
      o.interpolation_exponent);
    f(ObjectRow{interpolation_configuration, 1, ro, no, "Maximum buffer size"}, o.buffer_capacity);
    f(ObjectRow{interpolation_configuration, 2, rw, no, "Actual buffer size", 1,
                interpolation_capacity},
      o.buffer_size);
    f(ObjectRow{interpolation_configuration, 3, rw, no, "Buffer organisation"},
      o.buffer_organisation);
    f(ObjectRow{interpolation_configuration, 4, rw, no, "Buffer position"}, o.buffer_position);
    f(ObjectRow{interpolation_configuration, 5, Access::write_only, no, "Size of data record", 4,
                4},
      o.buffer_record_size);
    f(ObjectRow{interpolation_configuration, 6, Access::write_only, no, "Buffer clear"},
      o.buffer_clear);
    f(ObjectRow{max_acceleration, 0, rw, no, "Max acceleration"}, o.max_acceleration);
    f(ObjectRow{max_deceleration, 0, rw, no, "Max deceleration"}, o.max_deceleration);
    f(ObjectRow{positive_torque_limit, 0, rw, rx, "Positive torque limit value"},
      o.positive_torque_limit);
    f(ObjectRow{negative_torque_limit, 0, rw, rx, "Negative torque limit value"},
      o.negative_torque_limit);
    for (std::size_t n = 0; n < homing_methods.size(); ++n) {
        f(ObjectRow{supported_homing_methods, static_cast<std::uint8_t>(n + 1), fixed, no,
                    "Supported homing method"},
          o.supported_homing[n]);
    }
    f(ObjectRow{additional_position, 1, ro, tx, "1st additional position actual value"},
      o.additional_position);
    f(ObjectRow{positioning_option, 0, rw, rx, "Positioning option code"}, o.positioning_option);
    f(ObjectRow{following_error_actual, 0, ro, tx, "Following error actual value"},
      o.following_error);
    f(ObjectRow{max_slippage, 0, rw, no, "Max slippage"}, o.max_slippage);
    f(ObjectRow{control_effort, 0, ro, tx, "Control effort"}, o.control_effort);
    f(ObjectRow{position_demand_internal, 0, ro, tx, "Position demand internal value"},
      o.position_demand_internal);
    f(ObjectRow{digital_inputs, 0, ro, tx, "Digital inputs"}, o.inputs);
    f(ObjectRow{digital_outputs, 1, rw, rx, "Physical outputs"}, o.outputs);
    f(ObjectRow{digital_outputs, 2, rw, no, "Bit mask"}, o.output_mask);
    f(ObjectRow{target_velocity, 0, rw, rx, "Target velocity"}, o.target_velocity);
    f(ObjectRow{motor_type, 0, ro, no, "Motor type"}, o.motor_type);
    f(ObjectRow{supported_modes, 0, ro, no, "Supported drive modes"}, o.supported_modes);
    f(ObjectRow{drive_type, 0, ro, no, "Single device type"}, o.type);
}

/// Returns the name of an object with sub-indices; "" for others. [setup]
const char* name_of_record(std::uint16_t index) noexcept;

}  // namespace hal::cia402
