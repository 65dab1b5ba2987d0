// SPDX-License-Identifier: MIT
// Faults with their EMCY, loss of the master.
#include "drive_fault_bench.hpp"
namespace hal::canopen::test {
namespace {

TEST_F(DriveFault, Following_error_after_its_time) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 500);
    set(object::following_error_timeout, 50);
    enable(Mode::profile_position);
    set(object::max_torque, 50);
    drive->set_load_torque(0, -0.1);  // drags it away
    int over = 0;
    ASSERT_TRUE(until([&] {
        over += bit(status::following_error) ? 1 : 0;
        return state() != State::operation_enabled;
    }, 2000));
    EXPECT_NEAR(over, 49, 1);
    EXPECT_EQ(state(), State::fault_reaction_active);
    drive->set_load_torque(0, 0);
    expect_fault(0x8611, error_profile);
    EXPECT_LT(load<std::int32_t>(emergencies().back().manufacturer.data() + 1), 5000);
    EXPECT_GT(load<std::int32_t>(emergencies().back().manufacturer.data() + 1), 500);
    expect_reset();
}
TEST_F(DriveFault, Following_error_window_can_be_off) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 0xffffffff);
    enable(Mode::profile_position);
    set(object::max_torque, 50);
    drive->set_load_torque(0, -0.1);
    run(200);
    EXPECT_LT(position(), -1000);
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveFault, Against_a_stop_the_position_modes_see_a_following_error) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_position);
    set(object::target_position, 20000);
    control(0x1f);
    expect_fault(0x8611, error_profile);
    EXPECT_NEAR(position(), 3000, 100);
}
TEST_F(DriveFault, Over_current_when_it_presses_too_long) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_torque);
    set(object::target_torque, 2000);
    // θ = 4 (1 − e^(−t/10 s)) is 1.1 after 3.2 s
    run(3000);
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_TRUE(bit(status::warning));
    ASSERT_TRUE(until([&] { return state() == State::fault; }, 500));
    expect_fault(0x2310, error_current);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);  // still hot
    run(2000);
    expect_reset();
}
TEST_F(DriveFault, Rated_torque_is_not_too_much) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_torque);
    set(object::target_torque, 1000);
    for (int n = 0; n < 60; ++n) {
        run(1000);
    }
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveFault, Voltages) {
    moving();
    drive->set_dc_link(0, 70);
    expect_fault(0x3210, error_voltage);
    drive->set_dc_link(0, 48);
    expect_reset();
    enable(Mode::profile_velocity);
    drive->set_dc_link(0, 30);
    EXPECT_EQ(get<std::uint32_t>(object::dc_link_voltage), 48000U);
    run(1);
    EXPECT_EQ(get<std::uint32_t>(object::dc_link_voltage), 30000U);
    EXPECT_FALSE(bit(status::voltage_enabled));
    expect_fault(0x3220, error_voltage);
    drive->set_dc_link(0, 48);
    run(1);
    expect_reset();
}
TEST_F(DriveFault, Broken_encoder_takes_the_torque_away) {
    moving();
    drive->set_encoder_broken(0, true);
    run(2);
    EXPECT_EQ(state(), State::fault);
    const auto stood = position();
    run(10);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 0);
    EXPECT_EQ(position(), stood);
    expect_fault(0x7305, error_profile);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);
    drive->set_encoder_broken(0, false);
    expect_reset();
}
TEST_F(DriveFault, Over_speed) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 0xffffffff);
    enable(Mode::profile_torque);
    drive->set_load_torque(0, 0.3);
    expect_fault(0x8480, error_profile);
    drive->set_load_torque(0, 0);
    until([&] { return std::abs(drive->status(0).speed) < 7000; });
    expect_reset();
}
TEST_F(DriveFault, Each_simulated_fault_over_2011h) {
    struct Row {
        int bit;
        std::uint16_t code;
        std::uint8_t register_bit;
    };
    for (const auto& row : {Row{1, 0x7305, error_profile}, Row{2, 0x3210, error_voltage},
                            Row{4, 0x3220, error_voltage}, Row{8, 0x4310, error_temperature},
                            Row{16, 0x2310, error_current}}) {
        moving();
        set(0x2011, row.bit);
        expect_fault(row.code, row.register_bit);
        set(0x2011, 0);
        expect_reset();
    }
}
TEST_F(DriveFault, A_second_fault_is_told_too_and_both_must_go) {
    moving();
    set(0x2011, 8);
    ASSERT_TRUE(until([&] { return state() == State::fault; }, 1000));
    set(0x2011, 10);
    run(1);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), 0x3210);
    EXPECT_EQ(emergencies().size(), 2U);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0),
              error_generic | error_temperature | error_voltage);
    set(0x2011, 8);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);
    set(0x2011, 0);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), 0);
}

// The master is lost: 6007h.

struct Lost {
    int option;
    State after;
    std::uint16_t code;
};
struct DriveLost : DriveFault, testing::WithParamInterface<Lost> {
    void lose_heartbeat() {
        device().command(NmtCommand::start, now);
        EXPECT_EQ(device().dictionary().write(0x1016, 1, std::array<std::uint8_t, 4>{100, 0, 1, 0}),
                  Abort::none);
        device().handle({0x701, {5}}, now);
        run(50);
        EXPECT_EQ(state(), State::operation_enabled);
        run(60);
    }
};
TEST_P(DriveLost, Does_what_6007h_says) {
    moving();
    set(object::abort_connection_option, GetParam().option);
    lose_heartbeat();
    run(500);
    EXPECT_EQ(state(), GetParam().after);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), GetParam().code);
    EXPECT_NEAR(velocity(), GetParam().after == State::operation_enabled ? 20000 : 0, 200);
    EXPECT_EQ(events.communication_errors, 1);
    const auto told = emergencies();
    ASSERT_FALSE(told.empty());
    EXPECT_EQ(told[0].code, 0x8130);
    if (GetParam().code == 0) return;
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);  // still silent
    device().handle({0x701, {5}}, now);
    run(1);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), 0);
}
INSTANTIATE_TEST_SUITE_P(, DriveLost,
                         testing::Values(Lost{0, State::operation_enabled, 0},
                                         Lost{1, State::fault, 0x8130},
                                         Lost{2, State::switch_on_disabled, 0},
                                         Lost{3, State::switch_on_disabled, 0}),
                         [](const auto& p) { return "Option" + std::to_string(p.param.option); });

TEST_F(DriveFault, Bus_off_nmt_stop_and_reset_communication_are_a_lost_master_too) {
    for (const int way : {0, 1, 2}) {
        moving();
        device().command(NmtCommand::start, now);
        run(1);
        if (way == 0) {
            device().bus_off(now);
        }
        if (way == 1) {
            device().command(NmtCommand::stop, now);
        }
        if (way == 2) {
            device().command(NmtCommand::reset_communication, now);
        }
        run(500);
        EXPECT_EQ(state(), State::fault) << way;
        EXPECT_NEAR(velocity(), 0, 10) << way;
    }
}
TEST_F(DriveFault, Reset_of_the_node_is_a_power_cycle) {
    moving();
    set(object::profile_velocity, 1234);
    const auto place = drive->status(0).place;
    device().command(NmtCommand::reset_node, now);
    EXPECT_EQ(state(), State::not_ready_to_switch_on);
    run(1);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(get<std::uint32_t>(object::profile_velocity), 40960U);
    EXPECT_NEAR(position(), 20, 5);  // counted since
    EXPECT_NEAR(drive->status(0).place, place + 20, 5);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual) != 0 || velocity() > 10000, true);
    run(5000);
    EXPECT_EQ(velocity(), 0);
}

}  // namespace
}  // namespace hal::canopen::test
