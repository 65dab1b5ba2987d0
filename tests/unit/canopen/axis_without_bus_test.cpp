// SPDX-License-Identifier: MIT
// The simulated axis of a drive without a bus, as EtherCAT or any other one would wrap it.
#include <gtest/gtest.h>

#include <vector>

#include "cia402/drive/drive_axis.hpp"

namespace hal::canopen::test {
namespace {

using namespace cia402;

/// A bus that keeps what the axis reports.
struct ReportedFaults final : AxisBus {
    void raise(std::uint16_t code, std::int32_t) noexcept override { present.push_back(code); }
    void clear(std::uint16_t code) noexcept override { std::erase(present, code); }
    bool master_alive() const noexcept override { return alive; }
    std::vector<std::uint16_t> present;
    bool alive = true;
};

struct AxisWithoutBus : testing::Test {
    AxisWithoutBus() { axis.connect(bus); }
    void command(std::uint16_t word) {
        axis.values().controlword = word;
        axis.written(object::controlword, 0);
        axis.step(0.001);
    }
    void enable(Mode mode) {
        axis.values().mode = static_cast<std::int8_t>(mode);
        axis.step(0.001);
        command(command::shutdown);
        command(command::switch_on);
        command(command::enable_operation);
    }
    State state() { return state_of(axis.values().statusword); }

    ReportedFaults bus;
    DriveAxis axis{AxisSettings{}};
};

TEST_F(AxisWithoutBus, follows_the_cyclic_targets_that_are_written) {
    enable(Mode::cyclic_position);
    ASSERT_EQ(state(), State::operation_enabled);
    for (int target = 1; target <= 1000; ++target) {
        axis.values().target_position = target;
        axis.written(object::target_position, 0);
        axis.step(0.001);
    }
    EXPECT_NEAR(axis.values().position_actual, 1000, 2);
}

TEST_F(AxisWithoutBus, reports_a_fault_until_it_is_reset) {
    enable(Mode::cyclic_position);
    axis.set_dc_link(100);
    axis.step(0.001);
    EXPECT_EQ(bus.present, std::vector<std::uint16_t>{error::over_voltage});
    EXPECT_EQ(axis.values().error_code, error::over_voltage);
    axis.set_dc_link(48);
    for (int n = 0; n < 100; ++n) {
        axis.step(0.001);
    }
    EXPECT_EQ(state(), State::fault);
    command(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_TRUE(bus.present.empty());
}

TEST_F(AxisWithoutBus, stays_in_fault_while_the_master_is_lost) {
    enable(Mode::cyclic_position);
    bus.alive = false;
    axis.lose_connection();
    for (int n = 0; n < 100; ++n) {
        axis.step(0.001);
    }
    command(command::fault_reset);
    EXPECT_EQ(state(), State::fault);
    bus.alive = true;
    command(0);
    command(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
}

TEST_F(AxisWithoutBus, checks_what_a_master_writes) {
    const auto check = [&](std::uint16_t index, std::vector<std::uint8_t> value) {
        return axis.check(index, value);
    };
    EXPECT_EQ(check(object::modes_of_operation, {8}), WriteCheck::accepted);
    EXPECT_EQ(check(object::modes_of_operation, {5}), WriteCheck::invalid_value);
    EXPECT_EQ(check(object::homing_method, {36}), WriteCheck::invalid_value);
    EXPECT_EQ(check(object::polarity, {0x80}), WriteCheck::accepted);
    enable(Mode::interpolated_position);
    EXPECT_EQ(check(object::polarity, {0x80}), WriteCheck::wrong_state);
    for (unsigned n = 0; n < interpolation_capacity; ++n) {
        EXPECT_EQ(check(object::interpolation_data, {0, 0, 0, 0}), WriteCheck::accepted);
        axis.written(object::interpolation_data, 1);
    }
    EXPECT_EQ(check(object::interpolation_data, {0, 0, 0, 0}), WriteCheck::buffer_full);
}

TEST(ControlwordCommand, is_decoded_from_the_lowest_bits) {
    EXPECT_EQ(command_of(0x0000), Command::disable_voltage);
    EXPECT_EQ(command_of(0x000d), Command::disable_voltage);
    EXPECT_EQ(command_of(0x0002), Command::quick_stop);
    EXPECT_EQ(command_of(0x000b), Command::quick_stop);
    EXPECT_EQ(command_of(0x0006), Command::shutdown);
    EXPECT_EQ(command_of(0x000e), Command::shutdown);
    EXPECT_EQ(command_of(0x0007), Command::switch_on);
    EXPECT_EQ(command_of(0x001f), Command::enable_operation);
}

}  // namespace
}  // namespace hal::canopen::test
