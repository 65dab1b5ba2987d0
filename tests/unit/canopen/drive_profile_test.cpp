// SPDX-License-Identifier: MIT
// Profile position: the drive makes its own set-points, after a handshake.
#include "drive_profile_bench.hpp"
namespace hal::canopen::test {
namespace {

// Up in 0.4 s over 8000, down in 0.2 s over 4000, at 40 000 per s in between.

TEST_F(DriveProfile, Position_takes_the_time_of_its_trapezoid) {
    ready(Mode::profile_position);
    go(32000);
    EXPECT_FALSE(reached());
    run(398);
    EXPECT_NEAR(demand(), 8000, 100);
    EXPECT_NEAR(demanded_velocity(), 40000, 200);
    EXPECT_NEAR(velocity(), 40000, 400);
    run(500);
    EXPECT_NEAR(demand(), 28000, 100);
    run(198);
    EXPECT_NEAR(demand(), 32000, 5);
    EXPECT_TRUE(until([&] { return reached(); }, 40));
    EXPECT_NEAR(position(), 32000, 10);
    EXPECT_EQ(demand(), 32000);
}
TEST_F(DriveProfile, Position_without_cruising_peaks_where_the_ramps_meet) {
    ready(Mode::profile_position);
    go(-3000);  // the peak is sqrt(2·3000 / (1/1e5 + 1/2e5)) = 20 000
    std::int32_t peak = 0;
    ASSERT_TRUE(until([&] {
        peak = std::min(peak, demanded_velocity());
        return reached();
    }, 1000));
    EXPECT_NEAR(peak, -20000, 300);
    EXPECT_NEAR(position(), -3000, 10);
}
TEST_F(DriveProfile, Handshake_answers_each_edge_of_bit_4_once) {
    ready(Mode::profile_position);
    EXPECT_FALSE(acknowledged());
    set(object::target_position, 10000);
    control(0x1f);
    EXPECT_TRUE(acknowledged());
    set(object::target_position, 20000);  // without an edge it is nothing
    run(5);
    EXPECT_TRUE(acknowledged());
    control(0x0f);
    EXPECT_FALSE(acknowledged());
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 10000, 10);
    control(0x1f);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 20000, 10);
}
TEST_F(DriveProfile, Set_of_set_points_goes_to_one_after_the_other_and_stops_at_each) {
    ready(Mode::profile_position);
    const std::int32_t targets[] = {8000, 2000, 12000};
    for (const auto t : targets) {
        go(t);
    }
    for (const auto t : targets) {
        ASSERT_TRUE(until([&] { return demand() == t && demanded_velocity() == 0; }));
        run(2);
        EXPECT_EQ(demand(), t);
        EXPECT_NEAR(velocity(), 0, 300);
        EXPECT_FALSE(reached());  // of a set the last counts, and it takes its time in the window
    }
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 12000, 10);
}
TEST_F(DriveProfile, Full_buffer_keeps_the_acknowledge_until_there_is_room) {
    ready(Mode::profile_position);
    for (int n = 1; n <= 4; ++n) {
        go(1000 * n);
    }
    set(object::target_position, 5000);
    control(0x1f);
    control(0x0f);  // one under way, four behind it
    EXPECT_TRUE(acknowledged());
    set(object::target_position, 99000);
    control(0x1f);  // not taken
    control(0x0f);
    ASSERT_TRUE(until([&] { return !acknowledged(); }));
    EXPECT_NEAR(position(), 1000, 20);
    ASSERT_TRUE(until([&] { return position() > 4990; }));
    run(500);
    EXPECT_NEAR(position(), 5000, 10);
    EXPECT_TRUE(reached());
}
TEST_F(DriveProfile, Change_immediately_turns_round_at_once) {
    ready(Mode::profile_position);
    go(32000);
    go(20000);  // would come after it
    run(600);
    const auto was = position();
    go(0, control::change_immediately);
    run(150);
    EXPECT_LT(velocity(), 20000);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 0, 10);
    EXPECT_GT(was, 10000);
    run(100);
    EXPECT_NEAR(position(), 0, 10);  // what waited is dropped
}
TEST_F(DriveProfile, Change_on_set_point_passes_it_without_a_stop) {
    ready(Mode::profile_position);
    go(16000);
    go(40000, control::change_on_set_point);
    ASSERT_TRUE(until([&] { return demand() >= 15990; }));
    EXPECT_NEAR(demanded_velocity(), 40000, 200);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 40000, 10);
    // 0.4 s up, 0.2 s down, the rest at full speed
    go(0, control::change_on_set_point);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 0, 10);
}
TEST_F(DriveProfile, Change_on_set_point_slows_down_for_a_near_next_one) {
    ready(Mode::profile_position);
    go(16000);
    // 1000 at 200 000 per s²: at most 20 000 per s at the first
    go(17000, control::change_on_set_point);
    ASSERT_TRUE(until([&] { return demand() >= 16000; }));
    EXPECT_NEAR(demanded_velocity(), 20000, 600);
    std::int32_t highest = 0;
    ASSERT_TRUE(until([&] {
        highest = std::max(highest, demand());
        return reached();
    }));
    EXPECT_EQ(highest, 17000);
}
TEST_F(DriveProfile, End_velocity_is_kept_beyond_the_target) {
    ready(Mode::profile_position);
    set(object::end_velocity, 5000);
    go(10000);
    ASSERT_TRUE(until([&] { return reached(); }));
    run(1000);
    EXPECT_NEAR(velocity(), 5000, 200);
    EXPECT_NEAR(position(), 15000, 100);
}
TEST_F(DriveProfile, Relative_counts_from_target_demand_or_actual_position) {
    ready(Mode::profile_position);
    go(10000);
    go(5000, control::relative);
    ASSERT_TRUE(until([&] { return position() > 14990 && reached(); }));
    EXPECT_NEAR(position(), 15000, 10);
    go(-5000, control::relative | control::change_immediately);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 10000, 10);
    for (const int option : {1, 2}) {
        set(object::positioning_option, option);
        go(20000, control::relative | control::change_immediately);
        run(400);
        const auto here = demand();
        go(1000, control::relative | control::change_immediately);
        ASSERT_TRUE(until([&] { return reached(); }));
        EXPECT_NEAR(position(), here + 1000, 100);
    }
}
TEST_F(DriveProfile, Halt_stops_and_lets_it_go_on) {
    ready(Mode::profile_position);
    go(32000);
    run(600);
    control(0x10f);
    ASSERT_TRUE(until([&] { return reached(); }, 300));
    EXPECT_NEAR(velocity(), 0, 300);
    const auto here = position();
    run(200);
    EXPECT_NEAR(position(), here, 30);
    control(0x0f);
    EXPECT_FALSE(reached());
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 32000, 10);
}
TEST_F(DriveProfile, Limits_of_velocity_and_acceleration_hold) {
    ready(Mode::profile_position);
    set(object::max_profile_velocity, 20000);
    set(object::max_acceleration, 50000);
    set(object::max_deceleration, 50000);
    go(40000);
    run(395);
    EXPECT_NEAR(demanded_velocity(), 20000, 300);
    run(400);
    EXPECT_NEAR(velocity(), 20000, 200);
    ASSERT_TRUE(until([&] { return reached(); }));
    set(object::max_profile_velocity, 0);
    set(object::max_motor_speed, 60);  // r/min: 4096 per s
    go(0);
    run(1000);
    EXPECT_NEAR(velocity(), -4096, 100);
}
TEST_F(DriveProfile, Software_limit_cuts_the_target) {
    ready(Mode::profile_position);
    set(object::software_position_limit, -5000, 0, 1);
    set(object::software_position_limit, 5000, 0, 2);
    set(object::target_position, 20000);
    control(0x1f);
    EXPECT_TRUE(bit(status::internal_limit));
    control(0x0f);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 5000, 10);
}
TEST_F(DriveProfile, Limit_switch_stops_it_and_lets_it_back) {
    settings.axis[0].motor.positive_limit = 20000;
    settings.axis[0].motor.positive_stop = 30000;
    make();
    set(object::quick_stop_deceleration, 400000);
    enable(Mode::profile_position);
    set(object::target_position, 40000);
    control(0x1f);
    control(0x0f);
    ASSERT_TRUE(until(
        [&] { return (get<std::uint32_t>(object::digital_inputs) & input::positive_limit) != 0; }));
    run(300);
    EXPECT_NEAR(velocity(), 0, 10);
    EXPECT_LT(position(), 23000);
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_TRUE(bit(status::warning));
    const auto here = position();
    go(41000);
    run(300);
    EXPECT_NEAR(position(), here, 30);
    go(10000);
    ASSERT_TRUE(until([&] { return position() < 10010; }));
    EXPECT_FALSE(bit(status::warning));
}
TEST_F(DriveProfile, Gear_feed_and_polarity_make_the_unit) {
    settings.axis[0].motor.endless();
    make();
    set(object::gear_ratio, 5, 0, 1);
    set(object::feed_constant, 1000, 0, 1);  // 5 turns are 1000 units: 20.48 increments each
    set(object::polarity, 0x80);
    set(object::profile_velocity, 2000);
    set(object::profile_acceleration, 10000);
    set(object::profile_deceleration, 10000);
    set(object::max_acceleration, 0);
    set(object::max_deceleration, 0);
    enable(Mode::profile_position);
    go(1000);
    run(450);
    EXPECT_NEAR(drive->status(0).speed, -600, 10);
    EXPECT_NEAR(velocity(), -2000, 40);  // of bit 6, not of bit 7
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(drive->status(0).place, -20480, 220);
    run(100);
    EXPECT_NEAR(position(), 1000, 1);
    EXPECT_NEAR(get<std::int32_t>(object::position_actual_internal), -20480, 3);
}
TEST_F(DriveProfile, Units_cannot_change_while_it_follows_them) {
    ready(Mode::profile_position);
    EXPECT_EQ(write(object::gear_ratio, 1, 2), Abort::device_state);
    EXPECT_EQ(write(object::polarity, 0, 0x80), Abort::device_state);
    control(0x06);
    EXPECT_EQ(write(object::gear_ratio, 1, 2), Abort::none);
}
TEST_F(DriveProfile, Rotary_axis_goes_round) {
    ready(Mode::profile_position);
    set(object::position_range_limit, 0, 0, 1);
    set(object::position_range_limit, 4095, 0, 2);
    const auto turns = [&] { return std::lround((drive->status(0).place - position()) / 4096); };
    go(4000);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 4000, 10);
    EXPECT_EQ(turns(), 0);
    set(object::positioning_option, 3 << 6);  // the shortest way
    go(100);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 100, 10);
    EXPECT_EQ(turns(), 1);
    set(object::positioning_option, 2 << 6);  // forwards only
    go(50);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 50, 10);
    EXPECT_EQ(turns(), 2);
    set(object::positioning_option, 1 << 6);  // backwards only
    go(3000);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 3000, 10);
    EXPECT_EQ(turns(), 1);
    set(object::positioning_option, 0);
    go(5000, control::relative);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_NEAR(position(), 8000 - 4096, 10);
}
TEST_F(DriveProfile, Endless_axis_passes_the_end_of_32_bits) {
    settings.axis[0].motor.endless();
    settings.axis[0].motor.resolution = 1 << 24;
    make();
    enable(Mode::profile_velocity);
    set(object::profile_acceleration, 0xffffffff);
    set(object::max_acceleration, 0);
    set(object::target_velocity, 1 << 30);
    run(2300);
    EXPECT_LT(position(), 0);  // 2.4e9 − 2³²
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveProfile, Position_window_off_means_reached_with_the_trajectory) {
    ready(Mode::profile_position);
    set(object::position_window, 0xffffffff);
    set(object::position_window_time, 0);
    go(3000);
    ASSERT_TRUE(until([&] { return reached(); }));
    EXPECT_EQ(demand(), 3000);
}

}  // namespace
}  // namespace hal::canopen::test
