// SPDX-License-Identifier: MIT
// Modes in which the master makes the set-points: csp, csv, cst, ip.
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

struct DriveCyclic : DriveBench {
    void ready(Mode mode, int period_ms = 1) {
        settings.axis[0].motor.endless();
        make();
        set(object::interpolation_period, period_ms, 0, 1);
        enable(mode);
    }
    std::int32_t demand() { return get<std::int32_t>(object::position_demand); }
};

TEST_F(DriveCyclic, Position_follows_a_sine_without_lag) {
    ready(Mode::cyclic_position);
    std::int32_t worst = 0;
    for (int n = 0; n < 2000; ++n) {
        const double t = n * 0.001;
        set(object::target_position, std::lround(20000 * (1 - std::cos(2 * t))));
        run(1);
        EXPECT_TRUE(bit(status::follows_command));
        worst = std::max(worst, std::abs(get<std::int32_t>(object::following_error_actual)));
    }
    EXPECT_LT(worst, 40);
    EXPECT_NEAR(position(), 20000 * (1 - std::cos(4)), 100);
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveCyclic, Position_is_interpolated_between_set_points) {
    ready(Mode::cyclic_position, 10);
    for (int n = 1; n <= 50; ++n) {
        set(object::target_position, n * 100);
        for (int ms = 1; ms <= 10; ++ms) {
            run(1);
            EXPECT_NEAR(demand(), (n - 1) * 100 + ms * 10, 1);
        }
    }
    EXPECT_NEAR(velocity(), 10000, 200);
}
TEST_F(DriveCyclic, Position_waits_where_the_last_set_point_was) {
    ready(Mode::cyclic_position, 10);
    set(object::target_position, 500);
    run(300);
    EXPECT_EQ(demand(), 500);
    EXPECT_NEAR(position(), 500, 3);
}
TEST_F(DriveCyclic, Position_starts_where_it_is_and_not_where_an_old_target_was) {
    ready(Mode::cyclic_position);
    set(object::target_position, 700);
    run(100);
    control(0x06);
    run(100);
    set(object::target_position, 30000);  // while it is off
    control(0x0f);
    run(100);
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_NEAR(position(), 700, 10);
    EXPECT_FALSE(bit(status::follows_command));
}
TEST_F(DriveCyclic, Offsets_are_added) {
    ready(Mode::cyclic_position);
    set(object::position_offset, 50);
    set(object::target_position, 500);
    run(300);
    EXPECT_NEAR(position(), 550, 3);
    set_mode(Mode::cyclic_velocity);
    set(object::velocity_offset, 1000);
    run(1);
    set(object::target_velocity, 5000);
    run(200);
    EXPECT_NEAR(velocity(), 6000, 60);
    set_mode(Mode::cyclic_torque);
    set(object::torque_offset, 20);
    run(1);
    set(object::target_torque, 30);
    run(20);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 50);
}
TEST_F(DriveCyclic, Jump_beyond_reach_is_a_following_error) {
    ready(Mode::cyclic_position);
    set(object::target_position, 1000000);
    EXPECT_TRUE(until([&] { return state() == State::fault; }, 200));
    EXPECT_EQ(get<std::uint16_t>(object::error_code), 0x8611);
}
TEST_F(DriveCyclic, Position_crosses_the_end_of_32_bits) {
    settings.axis[0].motor.endless();
    make();
    set(object::homing_method, 37);
    set(object::home_offset, 0x7fffff00);
    enable(Mode::homing);
    control(0x1f);
    run(5);
    set_mode(Mode::cyclic_position);
    run(1);
    std::uint32_t target = 0x7fffff00;
    for (int n = 0; n < 100; ++n) {
        set(object::target_position, static_cast<std::int32_t>(target += 10));
        run(1);
    }
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_NEAR(position(), static_cast<std::int32_t>(target), 30);
    EXPECT_LT(position(), 0);
}
TEST_F(DriveCyclic, Limit_switch_holds_it_until_the_set_point_goes_back) {
    settings.axis[0].motor.positive_limit = 5000;
    settings.axis[0].motor.positive_stop = 9000;
    for (const auto mode : {Mode::cyclic_position, Mode::cyclic_velocity, Mode::cyclic_torque,
                            Mode::profile_velocity, Mode::profile_torque}) {
        make();
        enable(mode);
        const auto drive_to = [&](int sign) {
            for (int n = 0; n < 1500; ++n) {
                set(object::target_position, std::clamp(position() + sign * 25, -100000, 100000));
                set(object::target_velocity, sign * 25000);
                set(object::target_torque, sign * 25);
                run(1);
            }
        };
        if (mode == Mode::cyclic_position) {
            for (int n = 0; n <= 8000; n += 20) {
                set(object::target_position, n);
                run(1);
            }
            run(300);
        } else {
            drive_to(1);
        }
        EXPECT_GE(position(), 5000) << cia402::to_string(mode);
        EXPECT_LT(position(), 8000) << cia402::to_string(mode);
        EXPECT_NEAR(velocity(), 0, 200) << cia402::to_string(mode);
        EXPECT_TRUE(bit(status::internal_limit)) << cia402::to_string(mode);
        EXPECT_EQ(state(), State::operation_enabled) << cia402::to_string(mode);
        if (mode == Mode::cyclic_position) {
            for (int n = 8000; n >= 3000; n -= 20) {
                set(object::target_position, n);
                run(1);
            }
            run(300);
            EXPECT_NEAR(position(), 3000, 5);
        } else {
            set(object::target_velocity, -25000);
            set(object::target_torque, -25);
            run(800);
            EXPECT_LT(position(), 4000) << cia402::to_string(mode);
        }
    }
}
TEST_F(DriveCyclic, Software_limit_holds_every_mode) {
    for (const auto mode : {Mode::cyclic_position, Mode::cyclic_velocity, Mode::cyclic_torque}) {
        settings.axis[0].motor.endless();
        make();
        set(object::software_position_limit, -3000, 0, 1);
        set(object::software_position_limit, 3000, 0, 2);
        enable(mode);
        for (int n = 0; n < 600; ++n) {
            set(object::target_position, 20 * n);
            set(object::target_velocity, 20000);
            set(object::target_torque, 30);
            run(1);
        }
        EXPECT_NEAR(position(), 3000, 60) << cia402::to_string(mode);
        EXPECT_TRUE(bit(status::internal_limit)) << cia402::to_string(mode);
        EXPECT_EQ(state(), State::operation_enabled);
    }
}

TEST_F(DriveCyclic, Velocity_follows_without_a_ramp) {
    ready(Mode::cyclic_velocity, 20);
    set(object::target_velocity, 20000);
    run(10);
    EXPECT_NEAR(get<std::int32_t>(object::velocity_demand), 10000, 100);
    run(50);
    EXPECT_NEAR(velocity(), 20000, 200);
    EXPECT_TRUE(bit(status::follows_command));
    set(object::target_velocity, -20000);
    run(70);
    EXPECT_NEAR(velocity(), -20000, 200);
}
TEST_F(DriveCyclic, Torque_follows_at_once) {
    ready(Mode::cyclic_torque);
    set(object::target_torque, 250);
    run(6);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 250);
    EXPECT_EQ(get<std::int16_t>(object::current_actual), 250);
    EXPECT_NEAR(drive->status(0).torque, 0.075, 1e-3);
    EXPECT_NEAR(drive->status(0).current, 0.75, 1e-2);
}
TEST_F(DriveCyclic, Halt_is_for_the_master_to_do) {
    ready(Mode::cyclic_velocity);
    set(object::target_velocity, 20000);
    run(50);
    control(0x10f);
    run(50);
    EXPECT_NEAR(velocity(), 20000, 200);
}

// ip.

TEST_F(DriveCyclic, Interpolation_takes_one_record_per_period) {
    ready(Mode::interpolated_position, 10);
    EXPECT_FALSE(bit(status::interpolation_active));
    for (int n = 1; n <= 20; ++n) {
        set(object::interpolation_data, n * 100, 0, 1);
    }
    run(20);
    EXPECT_EQ(demand(), 0);
    set(object::controlword, 0x1f);
    for (int ms = 1; ms <= 200; ++ms) {
        run(1);
        EXPECT_NEAR(demand(), ms * 10, 1);
        EXPECT_TRUE(bit(status::interpolation_active));
        EXPECT_EQ(bit(status::target_reached), ms == 200);
    }
    run(300);
    EXPECT_NEAR(position(), 2000, 3);
}
TEST_F(DriveCyclic, Interpolation_period_has_an_exponent) {
    ready(Mode::interpolated_position);
    set(object::interpolation_period, 2, 0, 1);
    set(object::interpolation_period, -2, 0, 2);  // 20 ms
    set(object::interpolation_data, 200, 0, 1);
    set(object::controlword, 0x1f);
    run(10);
    EXPECT_NEAR(demand(), 100, 1);
    EXPECT_EQ(write(object::interpolation_period, 2, 1), Abort::too_high);
}
TEST_F(DriveCyclic, Interpolation_buffer_refuses_what_it_has_no_room_for) {
    ready(Mode::interpolated_position);
    set(object::interpolation_configuration, 4, 0, 2);
    for (int n = 0; n < 4; ++n) {
        set(object::interpolation_data, n, 0, 1);
    }
    EXPECT_EQ(write(object::interpolation_data, 1, 5), Abort::no_resource);
    run(1);
    EXPECT_EQ(get<std::uint16_t>(object::interpolation_configuration, 0, 4), 4);
    set(object::interpolation_configuration, 0, 0, 6);
    run(1);
    EXPECT_EQ(get<std::uint16_t>(object::interpolation_configuration, 0, 4), 0);
    EXPECT_EQ(write(object::interpolation_data, 1, 5), Abort::none);
}
TEST_F(DriveCyclic, Interpolation_halts_and_goes_on) {
    ready(Mode::interpolated_position, 10);
    for (int n = 1; n <= 20; ++n) {
        set(object::interpolation_data, n * 100, 0, 1);
    }
    control(0x1f);
    run(50);
    control(0x11f);
    run(100);
    EXPECT_NEAR(velocity(), 0, 10);
    EXPECT_TRUE(bit(status::target_reached));
    control(0x1f);
    run(400);
    EXPECT_NEAR(position(), 2000, 3);
}

// Changing modes.

TEST_F(DriveCyclic, Mode_changes_while_moving_keep_it_under_control) {
    ready(Mode::profile_velocity);
    set(object::target_velocity, 20000);
    run(300);
    set_mode(Mode::profile_position);
    run(1);
    EXPECT_EQ(get<std::int8_t>(object::modes_of_operation_display), 1);
    EXPECT_NEAR(velocity(), 20000, 1000);
    run(300);
    EXPECT_NEAR(velocity(), 0, 10);
    EXPECT_TRUE(bit(status::target_reached));
    set_mode(Mode::cyclic_velocity);
    run(1);
    set(object::target_velocity, 10000);
    run(100);
    set_mode(Mode::cyclic_position);
    run(1);
    for (int n = 0; n < 200; ++n) {
        set(object::target_position, position());
        run(1);
    }
    set_mode(Mode::none);
    run(300);
    EXPECT_NEAR(velocity(), 0, 10);
    EXPECT_EQ(state(), State::operation_enabled);
}

}  // namespace
}  // namespace hal::canopen::test
