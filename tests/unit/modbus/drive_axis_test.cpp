// SPDX-License-Identifier: MIT
// The spindle pins of a drive: when `run` starts it.
#include <gtest/gtest.h>

#include "modbus/master/drive_axis.hpp"

namespace hal::modbus::test {
namespace {

struct SpindlePins : testing::Test {
    std::uint32_t step(bool run) {
        last = axis.step({.run = run, .speed_rpm = speed}, seen, ++now);
        return last.command;
    }
    bool is_at_speed(bool run, double rpm) {
        seen.speed_rpm = rpm;
        step(run);
        return last.at_speed;
    }
    void start() {
        step(false);
        step(true);
    }

    DriveAxis axis{24000, 0.05, 1'000'000'000};
    DriveAxis::Feedback seen{.is_online = true, .has_speed = true, .is_current = true};
    DriveAxis::Outputs last;
    double speed = 1000;
    std::int64_t now = 0;
};

TEST_F(SpindlePins, an_edge_before_the_first_reading_of_the_speed_waits_for_it) {
    seen.has_speed = false;
    EXPECT_EQ(drive_stop, step(false));
    EXPECT_EQ(drive_stop, step(true));
    seen.has_speed = true;
    EXPECT_EQ(drive_forward, step(true));
}

TEST_F(SpindlePins, a_speed_that_is_lost_needs_another_edge) {
    step(false);
    EXPECT_EQ(drive_forward, step(true));
    seen.has_speed = false;
    EXPECT_EQ(drive_stop, step(true));
    seen.has_speed = true;
    EXPECT_EQ(drive_stop, step(true));
    step(false);
    EXPECT_EQ(drive_forward, step(true));
}

TEST_F(SpindlePins, run_that_was_true_while_offline_needs_an_edge) {
    seen.is_online = false;
    step(false);
    step(true);
    seen.is_online = true;
    EXPECT_EQ(drive_stop, step(true));
    step(false);
    EXPECT_EQ(drive_forward, step(true));
}

TEST_F(SpindlePins, at_speed_is_the_commanded_speed_within_the_tolerance) {
    start();
    EXPECT_FALSE(is_at_speed(true, 0));
    EXPECT_FALSE(is_at_speed(true, 940));
    EXPECT_TRUE(is_at_speed(true, 960));
    EXPECT_TRUE(is_at_speed(true, 1040));
    EXPECT_FALSE(is_at_speed(true, 1060));
}

TEST_F(SpindlePins, a_drive_that_is_not_started_is_never_at_speed) {
    EXPECT_FALSE(is_at_speed(false, 0));
    EXPECT_FALSE(is_at_speed(false, 1000));
    EXPECT_FALSE(is_at_speed(true, 0)) << "the cycle of the edge";
    speed = 0;
    EXPECT_FALSE(is_at_speed(true, 0)) << "a ramp begins at 0";
}

TEST_F(SpindlePins, a_drive_that_waits_for_an_edge_is_not_at_speed) {
    const auto interrupt = [&](bool DriveAxis::Feedback::* flag, bool value) {
        start();
        EXPECT_TRUE(is_at_speed(true, 1000));
        seen.*flag = value;
        EXPECT_FALSE(is_at_speed(true, 1000));
        EXPECT_FALSE(is_at_speed(true, 0));
        seen.*flag = !value;
        EXPECT_FALSE(is_at_speed(true, 0)) << "waits for an edge";
    };
    interrupt(&DriveAxis::Feedback::is_faulty, true);
    interrupt(&DriveAxis::Feedback::is_online, false);
    start();
    axis.require_edge();
    EXPECT_FALSE(is_at_speed(true, 0));
    start();
    EXPECT_TRUE(is_at_speed(true, 1000));
}

TEST_F(SpindlePins, a_reset_of_a_drive_whose_trip_is_not_read_needs_an_edge) {
    const auto resets = [&](bool reads_fault) {
        seen.reads_fault = reads_fault;
        start();
        EXPECT_TRUE(is_at_speed(true, 1000));
        last = axis.step({true, speed, true}, seen, 0);
        return last.command;
    };
    EXPECT_EQ(resets(false), drive_stop | drive_reset);
    EXPECT_FALSE(is_at_speed(true, 0)) << "waits for an edge";
    EXPECT_EQ(resets(true), drive_forward | drive_reset) << "it has not tripped";
}

TEST_F(SpindlePins, an_old_reading_of_the_speed_is_not_at_speed) {
    start();
    EXPECT_TRUE(is_at_speed(true, 1000));
    seen.is_current = false;
    EXPECT_FALSE(is_at_speed(true, 1000));
    seen.is_current = true;
    EXPECT_TRUE(is_at_speed(true, 1000));
}

TEST_F(SpindlePins, a_reversal_is_at_speed_in_the_new_direction_only) {
    start();
    EXPECT_TRUE(is_at_speed(true, 1000));
    speed = -1000;
    EXPECT_FALSE(is_at_speed(true, 1000)) << "stops first";
    EXPECT_EQ(drive_stop, last.command);
    EXPECT_FALSE(is_at_speed(true, 0));
    EXPECT_EQ(drive_reverse, last.command);
    EXPECT_TRUE(is_at_speed(true, 1000));
}

TEST_F(SpindlePins, a_command_beyond_the_maximum_is_at_speed_at_the_maximum) {
    speed = 1e6;
    start();
    EXPECT_FALSE(is_at_speed(true, 12000));
    EXPECT_TRUE(is_at_speed(true, 24000));
}

}  // namespace
}  // namespace hal::modbus::test
