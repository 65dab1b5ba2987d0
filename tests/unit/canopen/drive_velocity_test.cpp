// SPDX-License-Identifier: MIT
// Modes of velocity and torque in which the drive makes its own set-points: pv, vl, tq.
#include "drive_profile_bench.hpp"
namespace hal::canopen::test {
namespace {

// pv.

TEST_F(DriveProfile, Velocity_ramps_reaches_and_says_when_it_stands) {
    ready(Mode::profile_velocity);
    run(10);
    EXPECT_TRUE(reached());
    EXPECT_TRUE(bit(status::speed_is_zero));
    set(object::target_velocity, 30000);
    run(150);
    EXPECT_NEAR(demanded_velocity(), 15000, 200);
    EXPECT_FALSE(reached());
    EXPECT_FALSE(bit(status::speed_is_zero));
    run(170);
    EXPECT_TRUE(reached());
    EXPECT_NEAR(velocity(), 30000, 300);
    set(object::target_velocity, -30000);
    run(150);  // down by 200 000 per s²
    EXPECT_NEAR(demanded_velocity(), 0, 250);
    run(300);  // up by 100 000
    EXPECT_NEAR(demanded_velocity(), -30000, 250);
    EXPECT_TRUE(until([&] { return reached(); }, 50));
    control(0x10f);
    run(200);
    EXPECT_TRUE(bit(status::speed_is_zero));
    control(0x0f);
    run(400);
    EXPECT_NEAR(velocity(), -30000, 300);
}
TEST_F(DriveProfile, Velocity_polarity_turns_it_round) {
    settings.axis[0].motor.endless();
    make();
    set(object::polarity, 0x40);
    enable(Mode::profile_velocity);
    set(object::target_velocity, 10000);
    run(300);
    EXPECT_NEAR(velocity(), 10000, 100);
    EXPECT_NEAR(drive->status(0).speed, -146.5, 2);
}
TEST_F(DriveProfile, Velocity_stops_at_the_software_limit) {
    ready(Mode::profile_velocity);
    set(object::software_position_limit, 20000, 0, 2);
    set(object::software_position_limit, -20000, 0, 1);
    for (const int sign : {1, -1, 1}) {
        set(object::target_velocity, sign * 40000);
        run(3000);
        EXPECT_NEAR(position(), sign * 20000, 100);
        EXPECT_NEAR(velocity(), 0, 10);
        EXPECT_TRUE(bit(status::internal_limit));
    }
}
TEST_F(DriveProfile, Velocity_slippage_is_seen_when_the_motor_cannot_follow) {
    ready(Mode::profile_velocity);
    set(object::max_slippage, 1000);
    set(object::max_torque, 100);
    drive->set_load_torque(0, -0.2);
    set(object::target_velocity, 20000);
    run(100);
    EXPECT_TRUE(bit(status::max_slippage));
    EXPECT_TRUE(bit(status::internal_limit));
    EXPECT_LT(velocity(), 0);
}

// vl, in r/min.

TEST_F(DriveProfile, Vl_follows_its_ramp_bits) {
    ready(Mode::velocity);
    set(object::vl_velocity_acceleration, 1000, 0, 1);
    set(object::vl_velocity_acceleration, 1, 0, 2);
    set(object::vl_target_velocity, 600);
    const auto actual = [&] { return get<std::int16_t>(object::vl_control_effort); };
    run(100);
    EXPECT_EQ(actual(), 0);
    control(0x7f);
    run(300);
    EXPECT_NEAR(actual(), 300, 10);
    control(0x5f);  // the ramp is locked
    run(300);
    EXPECT_NEAR(actual(), 300, 10);
    control(0x7f);
    run(400);
    EXPECT_NEAR(actual(), 600, 5);
    EXPECT_NEAR(drive->status(0).speed, 600, 5);
    control(0x3f);  // the ramp's input is 0
    run(300);
    EXPECT_NEAR(actual(), 300, 10);
    control(0x7f);
    run(1000);
    control(0x6f);  // the ramp is off: quick stop ramp, 5000 r/min per s
    run(150);
    EXPECT_NEAR(actual(), 0, 5);
}
TEST_F(DriveProfile, Vl_keeps_to_its_amounts_and_factors) {
    ready(Mode::velocity);
    set(object::vl_velocity_min_max, 100, 0, 1);
    set(object::vl_velocity_min_max, 400, 0, 2);
    control(0x7f);
    const auto settle = [&](int target) {
        set(object::vl_target_velocity, target);
        run(1200);
        return drive->status(0).speed;
    };
    EXPECT_NEAR(settle(50), 100, 2);
    EXPECT_NEAR(settle(-1000), -400, 2);
    EXPECT_NEAR(settle(0), 0, 2);
    set(object::vl_dimension_factor, 3, 0, 1);
    EXPECT_NEAR(settle(100), 300, 2);
    EXPECT_NEAR(get<std::int16_t>(object::vl_control_effort), 100, 1);
    set(object::vl_set_point_factor, 2, 0, 2);
    EXPECT_NEAR(settle(-200), -300, 2);
}

// tq.

TEST_F(DriveProfile, Torque_rises_by_its_slope_and_accelerates_by_inertia) {
    settings.axis[0].motor.coulomb_friction = 0;
    settings.axis[0].motor.viscous_friction = 0;
    ready(Mode::profile_torque);
    set(object::torque_slope, 1000);
    set(object::target_torque, 100);  // 0.03 N·m
    run(50);
    EXPECT_NEAR(get<std::int16_t>(object::torque_demand), 50, 2);
    EXPECT_FALSE(reached());
    run(60);
    EXPECT_EQ(get<std::int16_t>(object::torque_demand), 100);
    EXPECT_TRUE(reached());
    const double before = drive->status(0).speed;
    run(100);  // 0.03 / 5e-5 = 600 rad/s²
    EXPECT_NEAR((drive->status(0).speed - before) * std::acos(-1.0) / 30, 60, 0.6);
}
TEST_F(DriveProfile, Torque_keeps_to_the_highest_speed_and_the_torque_limits) {
    ready(Mode::profile_torque);
    set(object::max_motor_speed, 1000);
    set(object::target_torque, 500);
    run(1000);
    EXPECT_NEAR(drive->status(0).speed, 1000, 20);
    EXPECT_TRUE(bit(status::internal_limit));
    set(object::max_motor_speed, 6000);
    set(object::positive_torque_limit, 100);
    run(50);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 100);
    set(object::target_torque, -500);
    set(object::negative_torque_limit, 50);
    run(100);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), -50);
}

}  // namespace
}  // namespace hal::canopen::test
