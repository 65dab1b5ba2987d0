// SPDX-License-Identifier: MIT
// The spindle pins of a drive: when `run` starts it.
#include <gtest/gtest.h>

#include "modbus/master/drive_axis.hpp"

namespace hal::modbus::test {
namespace {

struct SpindlePins : testing::Test {
    std::uint32_t step(bool run) {
        return axis.step({.run = run, .speed_rpm = 1000}, seen, ++now).command;
    }

    DriveAxis axis{24000, 0.05, 1'000'000'000};
    DriveAxis::Feedback seen{.is_online = true, .has_speed = true};
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

}  // namespace
}  // namespace hal::modbus::test
