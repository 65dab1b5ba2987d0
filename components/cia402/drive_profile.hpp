// SPDX-License-Identifier: MIT
// The constants of CiA 402, the drive profile (IEC 61800-7-201): objects, bits, states, modes, and
// their names. CANopen drives, CANopen masters and EtherCAT share it. All functions are pure and
// may be called in any thread.
#pragma once

#include <array>
#include <cstdint>

namespace hal::cia402 {

/// Nanoseconds on the clock of the caller; only differences count.
using Time = std::int64_t;
inline constexpr Time one_second = 1'000'000'000;

/// Axes of one node. The objects of axis n, counted from 0, are at +0x800·n, its PDOs at +64·n.
inline constexpr unsigned max_axes = 8;
/// Returns the object of an axis that corresponds to `index` of the first one. [any]
constexpr std::uint16_t of_axis(std::uint16_t index, unsigned axis) noexcept {
    return static_cast<std::uint16_t>(index + 0x800 * axis);
}
/// Returns the PDO number of an axis that corresponds to `number` of the first one. [any]
constexpr unsigned pdo_of_axis(unsigned number, unsigned axis) noexcept {
    return number + 64 * axis;
}
/// Returns the axis of an object 6000h..9FFFh. [any]
constexpr unsigned axis_of(std::uint16_t index) noexcept {
    return index < 0x6000 ? 0 : (index - 0x6000U) / 0x800;
}
/// Returns the object of the first axis that corresponds to `index` of any axis. [any]
constexpr std::uint16_t of_first_axis(std::uint16_t index) noexcept {
    return index < 0x6000 ? index : static_cast<std::uint16_t>(0x6000 + (index - 0x6000U) % 0x800);
}

/// Low word of 1000h and of 67FFh, and bits of its high word.
inline constexpr std::uint32_t profile_number = 402;
inline constexpr std::uint32_t servo_drive = 0x00020000;

inline constexpr std::uint32_t frequency_converter = 0x00010000;
inline constexpr std::uint32_t stepper = 0x00040000;

/// Objects of the first axis.
namespace object {
inline constexpr std::uint16_t abort_connection_option = 0x6007;

inline constexpr std::uint16_t error_code = 0x603f;
inline constexpr std::uint16_t controlword = 0x6040;
inline constexpr std::uint16_t statusword = 0x6041;
inline constexpr std::uint16_t vl_target_velocity = 0x6042;

inline constexpr std::uint16_t vl_velocity_demand = 0x6043;
inline constexpr std::uint16_t vl_control_effort = 0x6044;
inline constexpr std::uint16_t vl_velocity_min_max = 0x6046;

inline constexpr std::uint16_t vl_velocity_acceleration = 0x6048;
inline constexpr std::uint16_t vl_velocity_deceleration = 0x6049;

inline constexpr std::uint16_t vl_velocity_quick_stop = 0x604a;
inline constexpr std::uint16_t vl_set_point_factor = 0x604b;
inline constexpr std::uint16_t vl_dimension_factor = 0x604c;

inline constexpr std::uint16_t quick_stop_option = 0x605a;
inline constexpr std::uint16_t shutdown_option = 0x605b;
inline constexpr std::uint16_t disable_operation_option = 0x605c;

inline constexpr std::uint16_t halt_option = 0x605d;
inline constexpr std::uint16_t fault_reaction_option = 0x605e;
inline constexpr std::uint16_t modes_of_operation = 0x6060;

inline constexpr std::uint16_t modes_of_operation_display = 0x6061;
inline constexpr std::uint16_t position_demand = 0x6062;

inline constexpr std::uint16_t position_actual_internal = 0x6063;
inline constexpr std::uint16_t position_actual = 0x6064;
inline constexpr std::uint16_t following_error_window = 0x6065;

inline constexpr std::uint16_t following_error_timeout = 0x6066;
inline constexpr std::uint16_t position_window = 0x6067;
inline constexpr std::uint16_t position_window_time = 0x6068;

inline constexpr std::uint16_t velocity_sensor_actual = 0x6069;
inline constexpr std::uint16_t velocity_demand = 0x606b;
inline constexpr std::uint16_t velocity_actual = 0x606c;

inline constexpr std::uint16_t velocity_window = 0x606d;
inline constexpr std::uint16_t velocity_window_time = 0x606e;
inline constexpr std::uint16_t velocity_threshold = 0x606f;

inline constexpr std::uint16_t velocity_threshold_time = 0x6070;
inline constexpr std::uint16_t target_torque = 0x6071;
inline constexpr std::uint16_t max_torque = 0x6072;

inline constexpr std::uint16_t max_current = 0x6073;
inline constexpr std::uint16_t torque_demand = 0x6074;
inline constexpr std::uint16_t motor_rated_current = 0x6075;

inline constexpr std::uint16_t motor_rated_torque = 0x6076;
inline constexpr std::uint16_t torque_actual = 0x6077;
inline constexpr std::uint16_t current_actual = 0x6078;

inline constexpr std::uint16_t dc_link_voltage = 0x6079;
inline constexpr std::uint16_t target_position = 0x607a;
inline constexpr std::uint16_t position_range_limit = 0x607b;

inline constexpr std::uint16_t home_offset = 0x607c;
inline constexpr std::uint16_t software_position_limit = 0x607d;
inline constexpr std::uint16_t polarity = 0x607e;

inline constexpr std::uint16_t max_profile_velocity = 0x607f;
inline constexpr std::uint16_t max_motor_speed = 0x6080;
inline constexpr std::uint16_t profile_velocity = 0x6081;

inline constexpr std::uint16_t end_velocity = 0x6082;
inline constexpr std::uint16_t profile_acceleration = 0x6083;
inline constexpr std::uint16_t profile_deceleration = 0x6084;

inline constexpr std::uint16_t quick_stop_deceleration = 0x6085;
inline constexpr std::uint16_t motion_profile_type = 0x6086;
inline constexpr std::uint16_t torque_slope = 0x6087;

inline constexpr std::uint16_t torque_profile_type = 0x6088;
inline constexpr std::uint16_t position_encoder_resolution = 0x608f;

inline constexpr std::uint16_t velocity_encoder_resolution = 0x6090;
inline constexpr std::uint16_t gear_ratio = 0x6091;
inline constexpr std::uint16_t feed_constant = 0x6092;

inline constexpr std::uint16_t velocity_factor = 0x6096;
inline constexpr std::uint16_t acceleration_factor = 0x6097;
inline constexpr std::uint16_t homing_method = 0x6098;

inline constexpr std::uint16_t homing_speeds = 0x6099;
inline constexpr std::uint16_t homing_acceleration = 0x609a;
inline constexpr std::uint16_t position_unit = 0x60a8;

inline constexpr std::uint16_t velocity_unit = 0x60a9;
inline constexpr std::uint16_t acceleration_unit = 0x60aa;
inline constexpr std::uint16_t profile_jerk_use = 0x60a3;

inline constexpr std::uint16_t profile_jerk = 0x60a4;
inline constexpr std::uint16_t position_offset = 0x60b0;
inline constexpr std::uint16_t velocity_offset = 0x60b1;

inline constexpr std::uint16_t torque_offset = 0x60b2;
inline constexpr std::uint16_t touch_probe_function = 0x60b8;
inline constexpr std::uint16_t touch_probe_status = 0x60b9;

inline constexpr std::uint16_t touch_probe_1_positive = 0x60ba;
inline constexpr std::uint16_t touch_probe_1_negative = 0x60bb;

inline constexpr std::uint16_t touch_probe_2_positive = 0x60bc;
inline constexpr std::uint16_t touch_probe_2_negative = 0x60bd;

inline constexpr std::uint16_t interpolation_submode = 0x60c0;
inline constexpr std::uint16_t interpolation_data = 0x60c1;
inline constexpr std::uint16_t interpolation_period = 0x60c2;

inline constexpr std::uint16_t interpolation_configuration = 0x60c4;
inline constexpr std::uint16_t max_acceleration = 0x60c5;
inline constexpr std::uint16_t max_deceleration = 0x60c6;

inline constexpr std::uint16_t positive_torque_limit = 0x60e0;
inline constexpr std::uint16_t negative_torque_limit = 0x60e1;

inline constexpr std::uint16_t supported_homing_methods = 0x60e3;
inline constexpr std::uint16_t additional_position = 0x60e4;
inline constexpr std::uint16_t positioning_option = 0x60f2;

inline constexpr std::uint16_t following_error_actual = 0x60f4;
inline constexpr std::uint16_t max_slippage = 0x60f8;
inline constexpr std::uint16_t control_effort = 0x60fa;

inline constexpr std::uint16_t position_demand_internal = 0x60fc;
inline constexpr std::uint16_t digital_inputs = 0x60fd;
inline constexpr std::uint16_t digital_outputs = 0x60fe;

inline constexpr std::uint16_t target_velocity = 0x60ff;
inline constexpr std::uint16_t motor_type = 0x6402;
inline constexpr std::uint16_t supported_modes = 0x6502;
inline constexpr std::uint16_t drive_type = 0x67ff;
}  // namespace object

/// Bits of the controlword (6040h).
namespace control {
inline constexpr std::uint16_t switch_on = 0x0001;
inline constexpr std::uint16_t enable_voltage = 0x0002;
inline constexpr std::uint16_t not_quick_stop = 0x0004;

inline constexpr std::uint16_t enable_operation = 0x0008;
inline constexpr std::uint16_t fault_reset = 0x0080;
inline constexpr std::uint16_t halt = 0x0100;
// of pp
inline constexpr std::uint16_t new_set_point = 0x0010;
inline constexpr std::uint16_t change_immediately = 0x0020;

inline constexpr std::uint16_t relative = 0x0040;
inline constexpr std::uint16_t change_on_set_point = 0x0200;
// of vl
inline constexpr std::uint16_t enable_ramp = 0x0010;
inline constexpr std::uint16_t unlock_ramp = 0x0020;
inline constexpr std::uint16_t reference_ramp = 0x0040;
// of hm and ip
inline constexpr std::uint16_t start_homing = 0x0010;
inline constexpr std::uint16_t enable_interpolation = 0x0010;
}  // namespace control

/// Controlwords that command a transition.
namespace command {
inline constexpr std::uint16_t shutdown = 0x0006;
inline constexpr std::uint16_t switch_on = 0x0007;
inline constexpr std::uint16_t enable_operation = 0x000f;

inline constexpr std::uint16_t disable_operation = 0x0007;
inline constexpr std::uint16_t disable_voltage = 0x0000;

inline constexpr std::uint16_t quick_stop = 0x0002;
inline constexpr std::uint16_t fault_reset = 0x0080;
}  // namespace command

/// Commands of the controlword, without fault reset; switch_on is disable_operation as well.
enum class Command : std::uint8_t {
    disable_voltage,
    quick_stop,
    shutdown,
    switch_on,
    enable_operation
};
/// Coding of a command in the controlword.
struct CommandRow {
    Command command;
    std::uint16_t mask, value;  ///< controlword & mask == value
};
inline constexpr std::array<CommandRow, 5> commands{{
    {Command::disable_voltage, 0x0002, 0x0000},
    {Command::quick_stop, 0x0006, 0x0002},
    {Command::shutdown, 0x0007, 0x0006},
    {Command::switch_on, 0x000f, 0x0007},
    {Command::enable_operation, 0x000f, 0x000f},
}};
/// Returns the command coded in a controlword. [any]
constexpr Command command_of(std::uint16_t controlword) noexcept {
    for (const auto& row : commands) {
        if ((controlword & row.mask) == row.value) return row.command;
    }
    return Command::disable_voltage;
}

/// Bits of the statusword (6041h).
namespace status {
inline constexpr std::uint16_t ready_to_switch_on = 0x0001;
inline constexpr std::uint16_t switched_on = 0x0002;

inline constexpr std::uint16_t operation_enabled = 0x0004;
inline constexpr std::uint16_t fault = 0x0008;
inline constexpr std::uint16_t voltage_enabled = 0x0010;

inline constexpr std::uint16_t not_quick_stop = 0x0020;
inline constexpr std::uint16_t switch_on_disabled = 0x0040;

inline constexpr std::uint16_t warning = 0x0080;
inline constexpr std::uint16_t remote = 0x0200;
inline constexpr std::uint16_t target_reached = 0x0400;

inline constexpr std::uint16_t internal_limit = 0x0800;
// bit 12
inline constexpr std::uint16_t set_point_acknowledge = 0x1000;
inline constexpr std::uint16_t speed_is_zero = 0x1000;

inline constexpr std::uint16_t homing_attained = 0x1000;
inline constexpr std::uint16_t interpolation_active = 0x1000;

inline constexpr std::uint16_t follows_command = 0x1000;
// bit 13
inline constexpr std::uint16_t following_error = 0x2000;
inline constexpr std::uint16_t max_slippage = 0x2000;

inline constexpr std::uint16_t homing_error = 0x2000;
}  // namespace status

/// States of the drive's state machine.
enum class State : std::uint8_t {
    not_ready_to_switch_on,
    switch_on_disabled,
    ready_to_switch_on,
    switched_on,
    operation_enabled,
    quick_stop_active,
    fault_reaction_active,
    fault,
    unknown,  ///< bits of the statusword that are not a state
};
/// Coding of a state in the statusword.
struct StateRow {
    State state;
    std::uint16_t mask, value;  ///< statusword & mask == value
    const char* word;
};
inline constexpr std::array<StateRow, 8> states{{
    {State::not_ready_to_switch_on, 0x004f, 0x0000, "not ready to switch on"},
    {State::switch_on_disabled, 0x004f, 0x0040, "switch on disabled"},
    {State::ready_to_switch_on, 0x006f, 0x0021, "ready to switch on"},
    {State::switched_on, 0x006f, 0x0023, "switched on"},
    {State::operation_enabled, 0x006f, 0x0027, "operation enabled"},
    {State::quick_stop_active, 0x006f, 0x0007, "quick stop active"},
    {State::fault_reaction_active, 0x004f, 0x000f, "fault reaction active"},
    {State::fault, 0x004f, 0x0008, "fault"},
}};
/// Returns the state coded in a statusword, unknown for undefined bits. [any]
constexpr State state_of(std::uint16_t statusword) noexcept {
    for (const auto& row : states) {
        if ((statusword & row.mask) == row.value) return row.state;
    }
    return State::unknown;
}
/// Returns the name of a state, as in "switched on". [any]
constexpr const char* to_string(State state) noexcept {
    for (const auto& row : states) {
        if (row.state == state) return row.word;
    }
    return "unknown";
}

/// Modes of operation, 6060h and 6061h.
enum class Mode : std::int8_t {
    none = 0,
    profile_position = 1,
    velocity = 2,
    profile_velocity = 3,
    profile_torque = 4,
    homing = 6,
    interpolated_position = 7,
    cyclic_position = 8,
    cyclic_velocity = 9,
    cyclic_torque = 10,
};
/// Names of a mode.
struct ModeRow {
    Mode mode;
    const char *abbreviation, *word;
};
inline constexpr std::array<ModeRow, 9> modes{{
    {Mode::profile_position, "pp", "profile position"},
    {Mode::velocity, "vl", "velocity"},
    {Mode::profile_velocity, "pv", "profile velocity"},
    {Mode::profile_torque, "tq", "profile torque"},
    {Mode::homing, "hm", "homing"},
    {Mode::interpolated_position, "ip", "interpolated position"},
    {Mode::cyclic_position, "csp", "cyclic synchronous position"},
    {Mode::cyclic_velocity, "csv", "cyclic synchronous velocity"},
    {Mode::cyclic_torque, "cst", "cyclic synchronous torque"},
}};
/// Returns the name of a mode, as in "profile position"; "no mode" for unknown ones. [any]
constexpr const char* to_string(Mode mode) noexcept {
    for (const auto& row : modes) {
        if (row.mode == mode) return row.word;
    }
    return "no mode";
}
/// Returns the abbreviation of a mode, as in "pp"; "-" for unknown ones. [any]
constexpr const char* abbreviation(Mode mode) noexcept {
    for (const auto& row : modes) {
        if (row.mode == mode) return row.abbreviation;
    }
    return "-";
}
/// Returns the bit of a mode in 6502h; 0 for none. [any]
constexpr std::uint32_t bit_of(Mode mode) noexcept {
    const int number = static_cast<int>(mode);
    return number < 1 || number > 32 ? 0 : std::uint32_t{1} << (number - 1);
}

/// Values of 6007h and of 605Ah..605Eh.
enum class AbortConnection : std::int16_t {
    none = 0,
    fault = 1,
    disable_voltage = 2,
    quick_stop = 3
};
enum class Stop : std::int16_t {
    disable = 0,
    slow_down = 1,
    quick_stop = 2,
    current_limit = 3,
    voltage_limit = 4
};
/// Values of 605Ah from 5 on are those from 1 on, and the drive stays in quick stop active.
inline constexpr std::int16_t stay_in_quick_stop = 5;

/// Homing status, bits 13, 12 and 10 of the statusword in mode hm.
enum class Homing : std::uint8_t {
    running,
    interrupted,
    attained_but_moving,
    done,
    error_moving,
    error_stopped
};
/// Returns the homing status coded in a statusword. [any]
constexpr Homing homing_of(std::uint16_t statusword) noexcept {
    const bool error = (statusword & status::homing_error) != 0;

    const bool attained = (statusword & status::homing_attained) != 0;

    const bool reached = (statusword & status::target_reached) != 0;
    if (error) return reached ? Homing::error_stopped : Homing::error_moving;
    if (attained) return reached ? Homing::done : Homing::attained_but_moving;
    return reached ? Homing::interrupted : Homing::running;
}
/// Returns the name of a homing status. [any]
constexpr const char* to_string(Homing homing) noexcept {
    constexpr const char* words[] = {
        "running", "interrupted or not started", "attained, still moving",
        "done",    "error, still moving",        "error, stopped"};
    return words[static_cast<unsigned>(homing)];
}

/// Returns a description of homing methods 1..37; "reserved" for 15, 16, 31, 32, 36, "manufacturer
/// specific" for negative ones. [any]
constexpr const char* homing_method_word(int method) noexcept {
    constexpr const char* words[] = {
        "none",
        "index pulse right of the negative limit switch",
        "index pulse left of the positive limit switch",
        "index pulse left of the positive home switch",
        "index pulse inside the positive home switch",
        "index pulse right of the negative home switch",
        "index pulse inside the negative home switch",
        "index pulse left of the home switch, start to the right",
        "index pulse inside its left edge, start to the right",
        "index pulse inside its right edge, start to the right",
        "index pulse right of the home switch, start to the right",
        "index pulse right of the home switch, start to the left",
        "index pulse inside its right edge, start to the left",
        "index pulse inside its left edge, start to the left",
        "index pulse left of the home switch, start to the left",
        "reserved",
        "reserved",
        "edge of the negative limit switch",
        "edge of the positive limit switch",
        "edge of the positive home switch, from outside",
        "edge of the positive home switch, from inside",
        "edge of the negative home switch, from outside",
        "edge of the negative home switch, from inside",
        "left edge of the home switch from outside, start to the right",
        "left edge of the home switch from inside, start to the right",
        "right edge of the home switch from inside, start to the right",
        "right edge of the home switch from outside, start to the right",
        "right edge of the home switch from outside, start to the left",
        "right edge of the home switch from inside, start to the left",
        "left edge of the home switch from inside, start to the left",
        "left edge of the home switch from outside, start to the left",
        "reserved",
        "reserved",
        "next index pulse to the left",
        "next index pulse to the right",
        "present position (older form of 37)",
        "reserved",
        "present position",
    };
    if (method < 0) return "manufacturer specific";
    return method <= 37 ? words[method] : "reserved";
}

/// Values of 6086h, the ramps of pp and pv. 1 (sin² ramps) and 2 (jerk-free ramps) are unsupported.
inline constexpr std::int16_t linear_ramps = 0;
inline constexpr std::int16_t jerk_limited = 3;

/// Error codes of drives (603Fh, and in EMCYs).
namespace error {
inline constexpr std::uint16_t over_current = 0x2310;
inline constexpr std::uint16_t over_voltage = 0x3210;
inline constexpr std::uint16_t under_voltage = 0x3220;

inline constexpr std::uint16_t over_temperature = 0x4310;
inline constexpr std::uint16_t motor_blocked = 0x7121;

inline constexpr std::uint16_t position_sensor = 0x7305;
inline constexpr std::uint16_t heartbeat = 0x8130;
inline constexpr std::uint16_t over_speed = 0x8480;

inline constexpr std::uint16_t following_error = 0x8611;
inline constexpr std::uint16_t reference_limit = 0x8612;
}  // namespace error

/// Bits of 60FDh, and of 60FEh:1.
namespace input {
inline constexpr std::uint32_t negative_limit = 0x1;
inline constexpr std::uint32_t positive_limit = 0x2;
inline constexpr std::uint32_t home = 0x4;

inline constexpr std::uint32_t interlock = 0x8;
inline constexpr std::uint32_t probe_1 = 0x10000;
inline constexpr std::uint32_t probe_2 = 0x20000;  // of the simulated drive
}  // namespace input
namespace output {
inline constexpr std::uint32_t set_brake = 0x1;
}

/// Bits of 60B8h and 60B9h for probe 1; those of probe 2 are 8 places further up.
namespace probe {
inline constexpr std::uint16_t enable = 0x0001;
inline constexpr std::uint16_t continuous = 0x0002;
inline constexpr std::uint16_t index_pulse = 0x0004;

inline constexpr std::uint16_t positive_edge = 0x0010;
inline constexpr std::uint16_t negative_edge = 0x0020;
// it toggles
inline constexpr std::uint16_t enabled = 0x0001;
inline constexpr std::uint16_t positive_stored = 0x0002;
inline constexpr std::uint16_t negative_stored = 0x0004;

inline constexpr std::uint16_t updated = 0x0040;
}  // namespace probe

}  // namespace hal::cia402
