// SPDX-License-Identifier: MIT
// The same sequences through a CANopen drive and an EtherCAT servo: modes, homing, limits, brake,
// faults.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "cia402/drive/axis_values.hpp"
#include "tests/unit/cia402/drive_on_bus.hpp"

namespace drive_on_bus {

std::unique_ptr<Drive> make_drive(Bus bus, unsigned axes, const std::string& motor) {
    return bus == Bus::canopen ? make_canopen_drive(axes, motor) : make_ethercat_drive(axes, motor);
}

namespace {

using namespace hal::cia402;

/// One revolution has 10 000 increments, the motor turns with up to 12 000 r/min.
const std::string motor = "resolution:10000;highest-speed:12000";
const std::string endless = motor + ";endless:1";
const std::string travel = motor +
                           ";negative-limit:-100000;positive-limit:100000;negative-stop:-120000"
                           ";positive-stop:120000;home-from:50000;home-to:60000";

struct DriveTest {
    std::unique_ptr<Drive> drive;

    std::int64_t get(std::uint16_t index, unsigned axis = 0, std::uint8_t sub = 0) {
        return drive->read(of_axis(index, axis), sub);
    }
    void set(std::uint16_t index, std::int64_t value, unsigned axis = 0, std::uint8_t sub = 0) {
        EXPECT_EQ(drive->command(of_axis(index, axis), sub, value), Abort::none)
            << std::hex << index << ' ' << value;
    }
    std::uint16_t word(unsigned axis = 0) {
        return static_cast<std::uint16_t>(get(object::statusword, axis));
    }
    State state(unsigned axis = 0) { return state_of(word(axis)); }
    bool bit(std::uint16_t mask, unsigned axis = 0) { return (word(axis) & mask) != 0; }
    std::int64_t position(unsigned axis = 0) { return get(object::position_actual, axis); }
    std::int64_t velocity(unsigned axis = 0) { return get(object::velocity_actual, axis); }

    void control(std::uint16_t value, unsigned axis = 0) {
        set(object::controlword, value, axis);
        drive->run(2);
    }
    void enable(Mode mode, unsigned axis = 0) {
        set(object::modes_of_operation, static_cast<int>(mode), axis);
        control(command::shutdown, axis);
        control(command::switch_on, axis);
        control(command::enable_operation, axis);
        ASSERT_EQ(state(axis), State::operation_enabled) << to_string(state(axis));
    }
    /// Runs until it is so; false when it is not within the time.
    template <class F>
    bool until(F&& so, int ms = 10'000) {
        for (int n = 0; n < ms; ++n) {
            if (so()) return true;
            drive->run(1);
        }
        return so();
    }
    void expect_fault(std::uint16_t code, std::uint8_t register_bits, unsigned axis = 0) {
        ASSERT_TRUE(until([&] { return state(axis) == State::fault; }, 2000))
            << to_string(state(axis));
        EXPECT_EQ(get(object::error_code, axis), code);
        EXPECT_EQ(drive->read(0x1001, 0), register_bits);
        const auto reported = drive->emergencies();
        ASSERT_EQ(reported.size(), 1U);
        EXPECT_EQ(reported[0].code, code);
        EXPECT_EQ(reported[0].error_register, register_bits);
        EXPECT_EQ(reported[0].axis, axis);
    }
    void expect_reset(unsigned axis = 0) {
        control(0, axis);
        control(command::fault_reset, axis);
        EXPECT_EQ(state(axis), State::switch_on_disabled);
        EXPECT_EQ(get(object::error_code, axis), 0);
        EXPECT_EQ(drive->read(0x1001, 0), 0);
        const auto reported = drive->emergencies();
        ASSERT_EQ(reported.size(), 1U);
        EXPECT_EQ(reported[0].code, 0);
        EXPECT_EQ(reported[0].error_register, 0);
    }
};

struct BothBuses : testing::TestWithParam<Bus>, DriveTest {
    void start(const std::string& parameters = endless, unsigned axes = 1) {
        drive = make_drive(GetParam(), axes, parameters);
    }
};
INSTANTIATE_TEST_SUITE_P(, BothBuses, testing::Values(Bus::canopen, Bus::ethercat),
                         testing::PrintToStringParamName());

TEST_P(BothBuses, State_machine_follows_the_controlword) {
    start();
    EXPECT_EQ(state(), State::switch_on_disabled);
    control(command::switch_on);
    EXPECT_EQ(state(), State::switch_on_disabled) << "needs shutdown first";
    control(command::shutdown);
    EXPECT_EQ(state(), State::ready_to_switch_on);
    control(command::switch_on);
    EXPECT_EQ(state(), State::switched_on);
    control(command::enable_operation);
    EXPECT_EQ(state(), State::operation_enabled);
    control(command::switch_on);
    EXPECT_TRUE(until([&] { return state() == State::switched_on; }, 100)) << "after its ramp";
    control(command::shutdown);
    EXPECT_EQ(state(), State::ready_to_switch_on);
    control(command::disable_voltage);
    EXPECT_EQ(state(), State::switch_on_disabled);
}

TEST_P(BothBuses, Objects_and_modes_are_the_same) {
    start();
    EXPECT_EQ(get(object::supported_modes), 0x3ef);
    EXPECT_EQ(get(object::motor_rated_torque), 300);
    EXPECT_EQ(get(object::max_motor_speed), 12'000);
    EXPECT_EQ(get(object::supported_homing_methods, 0, 0), std::int64_t{homing_methods.size()});
    EXPECT_EQ(get(object::supported_homing_methods, 0, 32), 37);
    EXPECT_EQ(drive->write_by_sdo(object::modes_of_operation, 0, 5), Abort::value);
    EXPECT_EQ(drive->write_by_sdo(object::homing_method, 0, 36), Abort::value);
    EXPECT_EQ(drive->write_by_sdo(object::statusword, 0, 0), Abort::read_only);
    EXPECT_EQ(drive->write_by_sdo(object::halt_option, 0, 9), Abort::too_high);
    EXPECT_EQ(drive->write_by_sdo(object::halt_option, 0, 0), Abort::too_low);
    enable(Mode::profile_velocity);
    EXPECT_EQ(drive->write_by_sdo(object::polarity, 0, 0x80), Abort::device_state);
}

TEST_P(BothBuses, Profile_position_reaches_its_targets) {
    start();
    enable(Mode::profile_position);
    set(object::target_position, 20'000);
    control(0x1f);
    EXPECT_TRUE(bit(status::set_point_acknowledge));
    control(0x0f);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    EXPECT_NEAR(static_cast<double>(position()), 20'000, 25);
    set(object::target_position, -5'000);
    control(0x1f | control::relative);
    control(0x0f | control::relative);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    EXPECT_NEAR(static_cast<double>(position()), 15'000, 25);
}

TEST_P(BothBuses, Profile_velocity_accelerates_and_halts) {
    start();
    enable(Mode::profile_velocity);
    set(object::target_velocity, 50'000);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    EXPECT_NEAR(static_cast<double>(velocity()), 50'000, 1'000);
    control(0x0f | control::halt);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    EXPECT_TRUE(until([&] { return bit(status::speed_is_zero); }));
}

TEST_P(BothBuses, Velocity_mode_turns_with_the_speed_in_revolutions_per_minute) {
    start();
    set(object::vl_target_velocity, 600);
    enable(Mode::velocity);
    control(0x7f);
    drive->run(2'000);
    EXPECT_NEAR(static_cast<double>(get(object::vl_control_effort)), 600, 6);
    EXPECT_NEAR(static_cast<double>(velocity()), 100'000, 1'000);
}

TEST_P(BothBuses, Profile_torque_follows_its_slope) {
    start();
    drive->set_load_torque(0, -0.03);
    set(object::torque_slope, 1'000);
    set(object::target_torque, 100);
    enable(Mode::profile_torque);
    drive->run(50);
    EXPECT_NEAR(static_cast<double>(get(object::torque_demand)), 55, 10);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    EXPECT_NEAR(static_cast<double>(get(object::torque_actual)), 100, 5);
}

TEST_P(BothBuses, Interpolated_position_follows_its_records) {
    start();
    enable(Mode::interpolated_position);
    for (int n = 1; n <= 20; ++n) {
        set(object::interpolation_data, n * 50, 0, 1);
    }
    control(0x0f | control::enable_interpolation);
    drive->run(100);
    EXPECT_NEAR(static_cast<double>(position()), 1'000, 20);
}

TEST_P(BothBuses, Cyclic_modes_follow_the_set_points_of_every_cycle) {
    start();
    enable(Mode::cyclic_position);
    for (int n = 1; n <= 500; ++n) {
        set(object::target_position, n * 20);
        drive->run(1);
    }
    drive->run(50);
    EXPECT_NEAR(static_cast<double>(position()), 10'000, 20);
    EXPECT_TRUE(bit(status::follows_command));
    set(object::target_velocity, 0);
    set(object::modes_of_operation, static_cast<int>(Mode::cyclic_velocity));
    for (int n = 1; n <= 500; ++n) {
        set(object::target_velocity, n * 100);
        drive->run(1);
    }
    EXPECT_NEAR(static_cast<double>(velocity()), 50'000, 1'000);
    EXPECT_EQ(get(object::modes_of_operation_display), static_cast<int>(Mode::cyclic_velocity));
}

TEST_P(BothBuses, Cyclic_torque_follows_the_set_point) {
    start();
    enable(Mode::cyclic_torque);
    for (int n = 0; n < 20; ++n) {
        set(object::target_torque, 200);
        drive->run(1);
    }
    EXPECT_NEAR(static_cast<double>(get(object::torque_actual)), 200, 5);
}

TEST_P(BothBuses, Software_limits_stop_the_axis) {
    start();
    set(object::software_position_limit, -1'000, 0, 1);
    set(object::software_position_limit, 30'000, 0, 2);
    enable(Mode::profile_velocity);
    set(object::target_velocity, 50'000);
    ASSERT_TRUE(until([&] { return bit(status::internal_limit); }));
    drive->run(500);
    EXPECT_NEAR(static_cast<double>(position()), 30'000, 50);
}

TEST_P(BothBuses, Limit_switch_stops_the_axis_and_lets_it_back) {
    start(travel);
    enable(Mode::profile_velocity);
    set(object::target_velocity, 50'000);
    ASSERT_TRUE(until([&] { return (get(object::digital_inputs) & 2) != 0; }));
    drive->run(500);
    EXPECT_LT(position(), 120'000);
    EXPECT_TRUE(bit(status::warning));
    set(object::target_velocity, -50'000);
    EXPECT_TRUE(until([&] { return position() < 90'000; }));
}

TEST_P(BothBuses, Brake_holds_a_load_while_the_drive_is_off) {
    start(endless + ";brake-torque:0.5");
    drive->set_load_torque(0, 0.1);
    drive->run(100);
    EXPECT_TRUE(drive->brake_closed(0));
    EXPECT_EQ(position(), 0);
    enable(Mode::profile_velocity);
    drive->run(200);
    EXPECT_FALSE(drive->brake_closed(0));
    EXPECT_NEAR(static_cast<double>(position()), 0, 500);
    control(command::switch_on);
    ASSERT_TRUE(until([&] { return drive->brake_closed(0); }, 2000));
    const auto held = position();
    drive->run(500);
    EXPECT_NEAR(static_cast<double>(position()), static_cast<double>(held), 20);
}

TEST_P(BothBuses, Quick_stop_brakes_on_its_ramp) {
    start();
    enable(Mode::profile_velocity);
    set(object::target_velocity, 100'000);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    set(object::quick_stop_option, 6);
    control(command::quick_stop);
    EXPECT_EQ(state(), State::quick_stop_active);
    ASSERT_TRUE(until([&] { return std::abs(velocity()) < 10; }, 1000));
    EXPECT_EQ(state(), State::quick_stop_active) << "option 6 stays";
    control(command::enable_operation);
    EXPECT_EQ(state(), State::operation_enabled);
}

TEST_P(BothBuses, Touch_probe_keeps_the_position_of_its_input) {
    start();
    enable(Mode::profile_velocity);
    set(object::touch_probe_function, 0x0011);
    set(object::target_velocity, 20'000);
    drive->run(200);
    drive->set_inputs(0, 1U << 16);
    drive->run(2);
    EXPECT_NE(get(object::touch_probe_status) & 2, 0);
    EXPECT_NEAR(static_cast<double>(get(object::touch_probe_1_positive)),
                static_cast<double>(position()), 60);
}

TEST_P(BothBuses, Faults_are_reported_and_reset) {
    start();
    enable(Mode::profile_velocity);
    drive->set_dc_link(0, 100);
    expect_fault(error::over_voltage, 0x05);
    drive->set_dc_link(0, 48);
    expect_reset();
    enable(Mode::profile_velocity);
    drive->set_encoder_broken(0, true);
    expect_fault(error::position_sensor, 0x21);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault) << "the cause is still there";
    drive->set_encoder_broken(0, false);
    expect_reset();
    set(faults_simulated, simulated::over_temperature);
    expect_fault(error::over_temperature, 0x09);
    set(faults_simulated, 0);
    expect_reset();
    set(faults_simulated, simulated::over_current);
    expect_fault(error::over_current, 0x03);
    set(faults_simulated, 0);
    expect_reset();
}

TEST_P(BothBuses, Following_error_is_a_fault) {
    start();
    set(object::following_error_window, 200);
    enable(Mode::cyclic_position);
    set(object::max_torque, 10);
    for (int n = 1; n <= 200 && state() == State::operation_enabled; ++n) {
        set(object::target_position, n * 500);
        drive->run(1);
    }
    expect_fault(error::following_error, 0x21);
}

TEST_P(BothBuses, Axes_of_one_drive_are_independent) {
    start(endless, 2);
    enable(Mode::profile_velocity, 1);
    set(object::target_velocity, 10'000, 1);
    drive->run(500);
    EXPECT_EQ(state(0), State::switch_on_disabled);
    EXPECT_EQ(position(0), 0);
    EXPECT_NEAR(static_cast<double>(velocity(1)), 10'000, 500);
    drive->set_dc_link(1, 100);
    expect_fault(error::over_voltage, 0x05, 1);
    EXPECT_EQ(state(0), State::switch_on_disabled);
    drive->set_dc_link(1, 48);
    expect_reset(1);
}

TEST_P(BothBuses, Loss_of_the_master_acts_as_6007h_says) {
    start();
    ASSERT_EQ(drive->write_by_sdo(object::abort_connection_option, 0, 1), Abort::none);
    enable(Mode::profile_velocity);
    drive->stop_bus();
    EXPECT_EQ(get(object::error_code), error::heartbeat);
    start();
    ASSERT_EQ(drive->write_by_sdo(object::abort_connection_option, 0, 2), Abort::none);
    enable(Mode::profile_velocity);
    drive->stop_bus();
    EXPECT_EQ(get(object::error_code), 0);
    EXPECT_EQ(state(), State::switch_on_disabled);
}

TEST_P(BothBuses, Loss_of_the_master_with_6007h_0_keeps_the_drive_as_it_is) {
    start();
    ASSERT_EQ(drive->write_by_sdo(object::abort_connection_option, 0, 0), Abort::none);
    control(command::shutdown);
    drive->stop_bus();
    drive->run(2);
    EXPECT_EQ(state(), State::ready_to_switch_on);
    drive->start_bus();
    enable(Mode::profile_velocity);
    drive->stop_bus();
    drive->run(2);
    EXPECT_EQ(state(), State::operation_enabled);
    drive->start_bus();
    control(command::enable_operation);
    EXPECT_EQ(state(), State::operation_enabled);
}

TEST_P(BothBuses, Loss_of_the_master_with_6007h_3_stops_on_the_quick_stop_ramp) {
    start();
    ASSERT_EQ(drive->write_by_sdo(object::abort_connection_option, 0, 3), Abort::none);
    enable(Mode::profile_velocity);
    set(object::target_velocity, 100'000);
    ASSERT_TRUE(until([&] { return bit(status::target_reached); }));
    drive->stop_bus();
    EXPECT_EQ(state(), State::quick_stop_active);
    ASSERT_TRUE(until([&] { return state() == State::switch_on_disabled; }, 1000));
    EXPECT_NEAR(static_cast<double>(velocity()), 0, 200);
    drive->start_bus();
    control(command::enable_operation);
    EXPECT_EQ(state(), State::switch_on_disabled) << "needs shutdown first";
    enable(Mode::profile_velocity);
}

TEST_P(BothBuses, Loss_of_the_master_takes_a_ready_drive_to_switch_on_disabled) {
    start();
    control(command::shutdown);
    ASSERT_EQ(state(), State::ready_to_switch_on);
    drive->stop_bus();
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(get(object::error_code), 0);
    EXPECT_EQ(get(object::controlword), 0);
}

TEST_P(BothBuses, Fault_reset_that_was_held_rises_again_after_the_loss_of_the_master) {
    start();
    enable(Mode::profile_velocity);
    control(command::enable_operation | command::fault_reset);
    drive->set_dc_link(0, 100);
    ASSERT_TRUE(until([&] { return state() == State::fault; }, 2000));
    drive->set_dc_link(0, 48);
    control(command::fault_reset);
    ASSERT_EQ(state(), State::fault) << "bit 7 has not risen";
    drive->stop_bus();
    drive->start_bus();
    control(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
}

struct Homing : testing::TestWithParam<std::tuple<Bus, std::int8_t>>, DriveTest {};

/// Returns where the home position is along the travel, with an index pulse every 10 000 increments.
double home_of(int method) {
    constexpr double begin = -100'000;
    constexpr double end = 100'000;
    constexpr double left = 50'500;
    constexpr double right = 60'500;
    switch (method) {
    case 1: return begin + 10'000;
    case 2: return end - 10'000;
    case 3:
    case 7:
    case 14: return 50'000;
    case 4:
    case 8:
    case 13: return 60'000;
    case 5:
    case 10:
    case 11: return 70'000;
    case 6:
    case 9:
    case 12: return 60'000;
    case 17: return begin;
    case 18: return end;
    case 19:
    case 20:
    case 23:
    case 24:
    case 29:
    case 30: return left;
    case 21:
    case 22:
    case 25:
    case 26:
    case 27:
    case 28: return right;
    case 33: return -10'000;
    case 34: return 10'000;
    default: return 0;
    }
}

TEST_P(Homing, Method_finds_its_home) {
    const auto [bus, method] = GetParam();
    std::string parameters = travel + ";home-from:50500;home-to:60500";
    const int base = method > 16 ? method - 16 : method;
    if (base == 3 || base == 4) {
        parameters += ";home-to:1e9";
    }
    if (base == 5 || base == 6) {
        parameters += ";home-from:-1e9";
    }
    drive = make_drive(bus, 1, parameters);
    set(object::homing_method, method);
    set(object::home_offset, 123);
    set(object::following_error_window, 0xffffffff);
    enable(Mode::homing);
    control(0x1f);
    ASSERT_TRUE(
        until([&] { return bit(status::homing_attained) && bit(status::target_reached); }, 30'000));
    EXPECT_FALSE(bit(status::homing_error));
    EXPECT_NEAR(static_cast<double>(position()), 123, 30);
    EXPECT_NEAR(static_cast<double>(get(object::additional_position, 0, 1)), home_of(method), 40);
}
INSTANTIATE_TEST_SUITE_P(, Homing,
                         testing::Combine(testing::Values(Bus::canopen, Bus::ethercat),
                                          testing::ValuesIn(homing_methods)));

}  // namespace
}  // namespace drive_on_bus
