// SPDX-License-Identifier: MIT
// The state machine of CiA 402: transitions 0–16 one by one, those that do not exist, and the
// option codes of each stop.
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

struct DriveState : DriveBench {
    /// Walks there by the shortest way, at rest.
    void go(State wanted) {
        make();
        // Leaves a fault reaction time to be seen.
        set(object::profile_deceleration, 20000);
        set(object::quick_stop_deceleration, 20000);
        if (wanted == State::switch_on_disabled) return;
        if (wanted == State::fault || wanted == State::fault_reaction_active) {
            spin();
            set(0x2011, 0x08);  // over-temperature
            run(1);
            if (wanted == State::fault) {
                until([&] { return state() == State::fault; });
            }
            set(0x2011, 0);
            return;
        }
        if (wanted == State::quick_stop_active) {
            set(object::quick_stop_option, 6);
            spin();
            control(command::quick_stop);
            return;
        }
        control(command::shutdown);
        if (wanted == State::ready_to_switch_on) return;
        control(command::switch_on);
        if (wanted == State::switched_on) return;
        control(command::enable_operation);
    }
    void spin(double share = 1) {
        enable(Mode::profile_velocity);
        set(object::target_velocity, static_cast<int>(40960 * share));
        run(600);
        ASSERT_NEAR(velocity(), 40960 * share, 400);
    }
};

TEST_F(DriveState, Transitions_0_and_1_happen_by_themselves) {
    drive = std::make_unique<Drive>(settings, DeviceSettings{.node_id = 5});
    drive->start(now);
    EXPECT_EQ(state(), State::not_ready_to_switch_on);
    run(1);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_TRUE(bit(status::voltage_enabled));
    EXPECT_TRUE(bit(status::remote));
}

struct Transition {
    const char* name;
    State from;
    std::uint16_t word;
    State to;
};
void PrintTo(const Transition& t, std::ostream* out) { *out << t.name; }

struct DriveTransition : DriveState, testing::WithParamInterface<Transition> {};

TEST_P(DriveTransition, Leads_where_the_table_says) {
    const auto& t = GetParam();
    go(t.from);
    ASSERT_EQ(state(), t.from);
    set(object::controlword, t.word);
    EXPECT_TRUE(until([&] { return state() == t.to; }, 4000)) << state();
    run(20);
    EXPECT_EQ(state(), t.to);
}

using enum State;
INSTANTIATE_TEST_SUITE_P(
    , DriveTransition,
    testing::Values(Transition{"2", switch_on_disabled, 0x06, ready_to_switch_on},
                    Transition{"3", ready_to_switch_on, 0x07, switched_on},
                    Transition{"3_and_4", ready_to_switch_on, 0x0f, operation_enabled},
                    Transition{"4", switched_on, 0x0f, operation_enabled},
                    Transition{"5", operation_enabled, 0x07, switched_on},
                    Transition{"6", switched_on, 0x06, ready_to_switch_on},
                    Transition{"7_disable_voltage", ready_to_switch_on, 0x00, switch_on_disabled},
                    Transition{"7_quick_stop", ready_to_switch_on, 0x02, switch_on_disabled},
                    Transition{"8", operation_enabled, 0x06, ready_to_switch_on},
                    Transition{"9", operation_enabled, 0x00, switch_on_disabled},
                    Transition{"10_disable_voltage", switched_on, 0x00, switch_on_disabled},
                    Transition{"10_quick_stop", switched_on, 0x02, switch_on_disabled},
                    Transition{"11_and_12", operation_enabled, 0x02, switch_on_disabled},
                    Transition{"12_disable_voltage", quick_stop_active, 0x00, switch_on_disabled},
                    Transition{"14", fault_reaction_active, 0x0f, fault},
                    Transition{"15", fault, 0x80, switch_on_disabled},
                    Transition{"16", quick_stop_active, 0x0f, operation_enabled}),
    [](const auto& p) { return std::string("T") + p.param.name; });

/// From each state all words that mean nothing there.
struct DriveNoTransition : DriveState, testing::WithParamInterface<Transition> {};
TEST_P(DriveNoTransition, Stays_where_it_is) {
    const auto& t = GetParam();
    go(t.from);
    ASSERT_EQ(state(), t.from);
    control(t.word);
    EXPECT_EQ(state(), t.from);
    run(2);
    EXPECT_EQ(state(), t.from);
}
INSTANTIATE_TEST_SUITE_P(
    , DriveNoTransition,
    testing::Values(Transition{"disabled_switch_on", switch_on_disabled, 0x07, {}},
                    Transition{"disabled_enable", switch_on_disabled, 0x0f, {}},
                    Transition{"disabled_quick_stop", switch_on_disabled, 0x02, {}},
                    Transition{"disabled_disable", switch_on_disabled, 0x00, {}},
                    Transition{"disabled_reset", switch_on_disabled, 0x80, {}},
                    Transition{"disabled_shutdown_with_reset", switch_on_disabled, 0x86, {}},
                    Transition{"ready_shutdown", ready_to_switch_on, 0x06, {}},
                    Transition{"ready_reset", ready_to_switch_on, 0x80, {}},
                    Transition{"on_switch_on", switched_on, 0x07, {}},
                    Transition{"enabled_enable", operation_enabled, 0x0f, {}},
                    Transition{"enabled_reset", operation_enabled, 0x8f, {}},
                    Transition{"quick_stop_shutdown", quick_stop_active, 0x06, {}},
                    Transition{"quick_stop_switch_on", quick_stop_active, 0x07, {}},
                    Transition{"quick_stop_quick_stop", quick_stop_active, 0x02, {}},
                    Transition{"reaction_enable", fault_reaction_active, 0x0f, {}},
                    Transition{"reaction_reset", fault_reaction_active, 0x80, {}},
                    Transition{"reaction_disable", fault_reaction_active, 0x00, {}},
                    Transition{"fault_shutdown", fault, 0x06, {}},
                    Transition{"fault_enable", fault, 0x0f, {}},
                    Transition{"fault_disable", fault, 0x00, {}}),
    [](const auto& p) { return std::string(p.param.name); });

TEST_F(DriveState, Fault_reset_acts_on_its_rising_edge_only) {
    go(fault);
    control(0x80);
    ASSERT_EQ(state(), switch_on_disabled);
    set(0x2011, 0x08);
    run(2);
    ASSERT_EQ(state(), fault);
    set(0x2011, 0);
    control(0x80);  // it still stands there
    EXPECT_EQ(state(), fault);
    control(0x00);
    control(0x80);
    EXPECT_EQ(state(), switch_on_disabled);
}
TEST_F(DriveState, Fault_reset_waits_for_the_cause_to_go) {
    go(fault);
    set(0x2011, 0x08);
    control(0x80);
    EXPECT_EQ(state(), fault);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), 0x4310);
    control(0x00);
    set(0x2011, 0);
    control(0x80);
    EXPECT_EQ(state(), switch_on_disabled);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), 0);
}
TEST_F(DriveState, Without_voltage_it_does_not_become_ready) {
    make();
    drive->set_dc_link(0, 20);
    run(1);
    EXPECT_FALSE(bit(status::voltage_enabled));
    control(0x06);
    EXPECT_EQ(state(), switch_on_disabled);
    drive->set_dc_link(0, 48);
    control(0x06);
    EXPECT_EQ(state(), ready_to_switch_on);
}

// How it stops. At 10 rev/s, 20 000 increments/s²: 2.05 s; without torque the motor of the bench
// runs out in about 0.6 s.

TEST_F(DriveState, Disable_voltage_takes_the_torque_away_at_once) {
    go(switched_on);
    spin();
    control(0x00);
    run(5);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 0);
    EXPECT_GT(velocity(), 30000);
}

struct StopOption {
    std::uint16_t option_object;
    int option;
    std::uint16_t word;
    State during;
    State after;
    double ms;  ///< until it stands; 0: without torque
};
struct DriveStops : DriveState, testing::WithParamInterface<StopOption> {};
TEST_P(DriveStops, As_its_option_code_says) {
    const auto& p = GetParam();
    make();
    set(object::profile_deceleration, 81920);
    set(object::quick_stop_deceleration, 409600);
    set(p.option_object, p.option);
    spin();
    set(object::controlword, p.word);
    if (p.option_object == object::fault_reaction_option) {
        set(0x2011, 0x08);
    }
    run(1);
    EXPECT_EQ(state(), p.during);
    if (p.ms == 0) {
        run(5);
        EXPECT_EQ(state(), p.after);
        EXPECT_EQ(get<std::int16_t>(object::torque_actual), 0);
        EXPECT_GT(velocity(), 30000);
        return;
    }
    int took = 1;
    while (velocity() > 1000 && took < 3000) {
        run(1);
        ++took;
    }
    EXPECT_NEAR(took, p.ms, 5 + p.ms / 10);
    run(200);
    EXPECT_EQ(state(), p.after);
}
// 40 960 increments/s: by 81 920 per s² 0.5 s, by 409 600 0.1 s; by 0.9 N·m and 5e-5 kg·m² 62.8
// rad/s in 3.5 ms.
INSTANTIATE_TEST_SUITE_P(
    , DriveStops,
    testing::Values(
        StopOption{object::quick_stop_option, 0, 0x02, switch_on_disabled, switch_on_disabled, 0},
        StopOption{object::quick_stop_option, 1, 0x02, quick_stop_active, switch_on_disabled, 500},
        StopOption{object::quick_stop_option, 2, 0x02, quick_stop_active, switch_on_disabled, 100},
        StopOption{object::quick_stop_option, 3, 0x02, quick_stop_active, switch_on_disabled, 4},
        StopOption{object::quick_stop_option, 4, 0x02, quick_stop_active, switch_on_disabled, 4},
        StopOption{object::quick_stop_option, 5, 0x02, quick_stop_active, quick_stop_active, 500},
        StopOption{object::quick_stop_option, 6, 0x02, quick_stop_active, quick_stop_active, 100},
        StopOption{object::quick_stop_option, 7, 0x02, quick_stop_active, quick_stop_active, 4},
        StopOption{object::quick_stop_option, 8, 0x02, quick_stop_active, quick_stop_active, 4},
        StopOption{object::shutdown_option, 0, 0x06, ready_to_switch_on, ready_to_switch_on, 0},
        StopOption{object::shutdown_option, 1, 0x06, operation_enabled, ready_to_switch_on, 500},
        StopOption{object::disable_operation_option, 0, 0x07, switched_on, switched_on, 0},
        StopOption{object::disable_operation_option, 1, 0x07, operation_enabled, switched_on, 500},
        StopOption{object::halt_option, 1, 0x10f, operation_enabled, operation_enabled, 500},
        StopOption{object::halt_option, 2, 0x10f, operation_enabled, operation_enabled, 100},
        StopOption{object::halt_option, 3, 0x10f, operation_enabled, operation_enabled, 4},
        StopOption{object::halt_option, 4, 0x10f, operation_enabled, operation_enabled, 4},
        StopOption{object::fault_reaction_option, 0, 0x0f, fault_reaction_active, fault, 0},
        StopOption{object::fault_reaction_option, 1, 0x0f, fault_reaction_active, fault, 500},
        StopOption{object::fault_reaction_option, 2, 0x0f, fault_reaction_active, fault, 100},
        StopOption{object::fault_reaction_option, 3, 0x0f, fault_reaction_active, fault, 4},
        StopOption{object::fault_reaction_option, 4, 0x0f, fault_reaction_active, fault, 4}),
    [](const auto& p) {
        char name[40];
        std::snprintf(name, sizeof name, "Object%04X_is_%d", p.param.option_object, p.param.option);
        return std::string(name);
    });

TEST_F(DriveState, A_stop_on_the_way_out_is_called_off_by_enable_operation) {
    make();
    set(object::profile_deceleration, 81920);
    spin();
    control(0x07);
    run(100);
    EXPECT_LT(velocity(), 35000);
    control(0x0f);
    run(400);
    EXPECT_EQ(state(), operation_enabled);
    EXPECT_NEAR(velocity(), 40960, 400);
}
TEST_F(DriveState, Quick_stop_says_when_it_stands) {
    make();
    set(object::quick_stop_option, 6);
    spin();
    control(0x02);
    EXPECT_FALSE(bit(status::target_reached));
    run(300);
    EXPECT_TRUE(bit(status::target_reached));
    EXPECT_NEAR(velocity(), 0, 100);
}
TEST_F(DriveState, Option_codes_out_of_range_are_refused) {
    make();
    EXPECT_EQ(write(object::quick_stop_option, 0, 9), Abort::too_high);
    EXPECT_EQ(write(object::halt_option, 0, 0), Abort::too_low);
    EXPECT_EQ(write(object::shutdown_option, 0, 2), Abort::too_high);
    EXPECT_EQ(write(object::fault_reaction_option, 0, 5), Abort::too_high);
    EXPECT_EQ(write(object::modes_of_operation, 0, 5), Abort::value);
    EXPECT_EQ(write(object::modes_of_operation, 0, -1), Abort::value);
    EXPECT_EQ(write(object::homing_method, 0, 36), Abort::value);
    EXPECT_EQ(write(object::homing_method, 0, 15), Abort::value);
    EXPECT_EQ(write(object::statusword, 0, 0), Abort::read_only);
    EXPECT_EQ(write(object::gear_ratio, 2, 0), Abort::too_low);
}
TEST_F(DriveState, Brake_opens_before_it_moves_and_torque_stays_until_it_holds) {
    settings.axis[0].motor.brake_torque = 2;
    settings.axis[0].motor.brake_release = 0.05;
    settings.axis[0].motor.brake_engage = 0.05;
    make();
    drive->set_load_torque(0, -0.1);  // hangs
    run(200);
    EXPECT_EQ(position(), 0);
    EXPECT_TRUE(drive->status(0).brake_closed);
    enable(Mode::profile_velocity);
    set(object::target_velocity, 10000);
    run(40);
    EXPECT_TRUE(drive->status(0).brake_closed);
    EXPECT_EQ(position(), 0);
    run(300);
    EXPECT_FALSE(drive->status(0).brake_closed);
    EXPECT_NEAR(velocity(), 10000, 300);
    control(0x07);
    ASSERT_TRUE(until([&] { return state() == switched_on; }));
    const auto stood = position();
    EXPECT_FALSE(drive->status(0).brake_closed);
    run(60);
    EXPECT_TRUE(drive->status(0).brake_closed);
    run(500);
    EXPECT_NEAR(position(), stood, 5);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 0);
}
TEST_F(DriveState, Without_a_brake_a_hanging_load_falls) {
    make();
    drive->set_load_torque(0, -0.1);
    run(200);
    EXPECT_LT(position(), -1000);
}
TEST_F(DriveState, Stale_target_does_not_move_it_when_it_is_enabled) {
    for (const auto mode : {Mode::profile_position, Mode::cyclic_position, Mode::cyclic_velocity,
                            Mode::cyclic_torque, Mode::interpolated_position, Mode::homing}) {
        make();
        set(object::target_position, 50000);
        set(object::target_velocity, 50000);
        set(object::target_torque, 500);
        set(object::homing_method, 33);
        enable(mode);
        run(50);
        EXPECT_NEAR(position(), 0, 1) << cia402::to_string(mode);
    }
}

}  // namespace
}  // namespace hal::canopen::test
