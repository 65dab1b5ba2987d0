// SPDX-License-Identifier: MIT
// The master's axis and the simulated drive against each other in every mode, with one cycle of
// delay each way as on a bus.
#include "cia402/axis.hpp"
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

struct AxisAndDrive : DriveBench {
    Axis axis;
    AxisCommand command;
    AxisRules rules;
    AxisOrders orders, on_the_way;
    AxisFeedback feedback;

    void SetUp() override {
        settings.axis[0].motor.endless();
        make();
        // A unit is a turn; velocities per second.
        rules.position = rules.velocity = rules.acceleration = {4096, 1};
        rules.torque = {1000, 0.3};
        rules.vl = {60, 1};
        command.profile_velocity = 8;
        command.profile_acceleration = 40;

        command.profile_deceleration = 40;
    }
    AxisFeedback read() {
        return {.operational = true,
                .statusword = word(),
                .error_code = get<std::uint16_t>(object::error_code),
                .mode = static_cast<Mode>(get<std::int8_t>(object::modes_of_operation_display)),
                .position = position(),
                .velocity = velocity(),
                .vl_velocity = get<std::int16_t>(object::vl_control_effort),
                .torque = get<std::int16_t>(object::torque_actual)};
    }
    void tell(const AxisOrders& o) {
        if (o.mode != Mode::none) {
            set_mode(o.mode);
        }
        set(object::target_position, o.target_position);
        // it may be full
        if (o.mode == Mode::interpolated_position) {
            write(object::interpolation_data, 1, o.interpolation);
        }
        set(object::target_velocity, o.target_velocity);
        set(object::vl_target_velocity, o.vl_target_velocity);
        set(object::target_torque, o.target_torque);
        set(object::velocity_offset, o.velocity_offset);
        set(object::torque_offset, o.torque_offset);
        set(object::profile_velocity, o.profile_velocity);
        set(object::profile_acceleration, o.profile_acceleration);
        set(object::profile_deceleration, o.profile_deceleration);
        set(object::controlword, o.controlword);
    }
    void cycle() {
        const auto seen = read();
        tell(on_the_way);
        run(1);
        on_the_way = axis.step(feedback, command, rules, now);
        feedback = seen;
    }
    void cycles(int n) {
        while (n-- > 0) {
            cycle();
        }
    }
    template <class F>
    bool wait(F&& so, int max = 5000) {
        for (int n = 0; n < max; ++n) {
            if (so()) return true;
            cycle();
        }
        return so();
    }
    void enable(Mode mode) {
        command.mode = mode;
        command.enable = true;
        EXPECT_TRUE(wait([&] { return axis.active(); }, 100)) << cia402::to_string(axis.state());
        EXPECT_FALSE(axis.failure());
    }
};

TEST_F(AxisAndDrive, Walk_up_and_down) {
    enable(Mode::cyclic_position);
    EXPECT_EQ(state(), State::operation_enabled);
    command.enable = false;
    EXPECT_TRUE(wait([&] { return state() == State::switch_on_disabled; }, 500));
    EXPECT_FALSE(axis.failure());
}
TEST_F(AxisAndDrive, Cyclic_position) {
    enable(Mode::cyclic_position);
    for (int n = 0; n < 2000; ++n) {
        command.position = 3 - 3 * std::cos(n * 0.003);
        command.velocity = 9 * std::sin(n * 0.003);
        cycle();
        ASSERT_TRUE(axis.enabled()) << n;
    }
    EXPECT_NEAR(axis.position(), command.position, 0.03);
}
TEST_F(AxisAndDrive, Cyclic_velocity_and_torque) {
    enable(Mode::cyclic_velocity);
    command.velocity = -4;
    cycles(200);
    EXPECT_NEAR(axis.velocity(), -4, 0.05);
    command.velocity = 0;
    cycles(200);
    enable(Mode::cyclic_torque);
    command.torque = 0.06;
    cycles(20);
    EXPECT_NEAR(axis.torque(), 0.06, 0.001);
}
TEST_F(AxisAndDrive, Interpolated_position) {
    enable(Mode::interpolated_position);
    for (int n = 0; n < 1500; ++n) {
        command.position = 2 * n / 1500.0;
        cycle();
    }
    cycles(200);
    EXPECT_NEAR(axis.position(), 2, 0.01);
    EXPECT_TRUE(axis.enabled());
}
TEST_F(AxisAndDrive, Profile_position_one_and_many) {
    enable(Mode::profile_position);
    const auto go = [&](double position) {
        command.position = position;
        command.go = true;
        cycle();
        command.go = false;
        cycle();
    };
    go(5);
    EXPECT_FALSE(axis.target_reached());
    EXPECT_TRUE(wait([&] { return axis.target_reached(); }));
    EXPECT_NEAR(axis.position(), 5, 0.01);
    for (int n = 1; n <= 10; ++n) {
        go(n % 2 == 0 ? n / 10.0 : -n / 10.0);
    }
    EXPECT_TRUE(wait([&] { return axis.target_reached(); }, 20000));
    EXPECT_NEAR(axis.position(), 1, 0.01);
    EXPECT_FALSE(axis.failure());
    command.relative = true;
    go(2);
    EXPECT_TRUE(wait([&] { return axis.target_reached(); }));
    EXPECT_NEAR(axis.position(), 3, 0.01);
}
TEST_F(AxisAndDrive, Profile_velocity_vl_and_torque) {
    enable(Mode::profile_velocity);
    command.velocity = 3;
    cycles(500);
    EXPECT_NEAR(axis.velocity(), 3, 0.03);
    command.halt = true;
    cycles(500);
    EXPECT_NEAR(axis.velocity(), 0, 0.03);
    command.halt = false;
    enable(Mode::velocity);
    command.velocity = -2;
    cycles(500);
    EXPECT_NEAR(axis.velocity(), -2, 0.03);
    command.velocity = 0;
    cycles(500);
    enable(Mode::profile_torque);
    command.torque = -0.06;
    cycles(100);
    EXPECT_NEAR(axis.torque(), -0.06, 0.001);
}
TEST_F(AxisAndDrive, Homing_with_and_without_a_way) {
    for (const int method : {37, 35, 34, 24, 10}) {
        set(object::homing_method, method);
        set(object::home_offset, 8192);
        enable(Mode::cyclic_position);
        command.home = true;
        command.position = 2;
        ASSERT_TRUE(wait([&] { return axis.homed() && !axis.homing(); }, 20000)) << method;
        EXPECT_NEAR(axis.position(), 2, 0.01) << method;
        command.home = false;
        cycles(100);
        EXPECT_NEAR(axis.position(), 2, 0.01) << method;
        EXPECT_TRUE(axis.enabled());
        command.enable = false;
        cycles(500);
    }
}
TEST_F(AxisAndDrive, Homing_that_cannot_end_fails_in_words) {
    set(object::homing_method, 17);
    set(object::homing_speeds, 0, 0, 1);
    enable(Mode::cyclic_position);
    command.home = true;
    EXPECT_TRUE(wait([&] { return static_cast<bool>(axis.failure()); }));
    EXPECT_EQ(axis.failure().cause, Cause::homing_error);
    EXPECT_TRUE(wait([&] { return state() == State::switch_on_disabled; }));
}
TEST_F(AxisAndDrive, Fault_is_seen_and_reset) {
    enable(Mode::profile_velocity);
    command.velocity = 3;
    cycles(300);
    set(0x2011, 8);
    EXPECT_TRUE(wait([&] { return axis.fault(); }));
    EXPECT_TRUE(wait([&] { return axis.failure().error_code == 0x4310; }, 200));
    set(0x2011, 0);
    EXPECT_TRUE(wait([&] { return state() == State::fault; }));
    command.enable = false;
    command.reset = true;
    EXPECT_TRUE(wait([&] { return state() == State::switch_on_disabled; }, 500)) << state();
    command.reset = false;
    cycles(3);
    EXPECT_FALSE(axis.fault());
    enable(Mode::profile_velocity);
}
TEST_F(AxisAndDrive, Quick_stop) {
    enable(Mode::profile_velocity);
    command.velocity = 8;
    cycles(500);
    command.quick_stop = true;
    EXPECT_TRUE(wait([&] { return state() == State::switch_on_disabled; }, 500)) << state();
    EXPECT_NEAR(axis.velocity(), 0, 0.1);
}

}  // namespace
}  // namespace hal::canopen::test
