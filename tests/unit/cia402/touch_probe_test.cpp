// SPDX-License-Identifier: MIT
#include "cia402/touch_probe.hpp"

#include <gtest/gtest.h>

namespace {

using namespace hal::cia402;

constexpr std::uint8_t enabled = 1;
constexpr std::uint8_t rising_stored = 2;
constexpr std::uint8_t falling_stored = 4;

/// A cycle: takes the feedback, and returns the byte of 60B8h.
std::uint8_t cycle(TouchProbe& probe, const TouchProbe::Feedback& feedback,
                   const TouchProbe::Command& command) {
    probe.observe(feedback);
    return probe.act(command);
}

TEST(TouchProbe, Function_has_edge_source_and_mode) {
    TouchProbe probe;
    EXPECT_EQ(cycle(probe, {}, {}), 0x00);
    EXPECT_EQ(cycle(probe, {}, {.enable = true}), 0x11);
    TouchProbe other;
    EXPECT_EQ(
        cycle(other, {}, {.enable = true, .falling = true, .continuous = true, .index = true}),
        0x27);
}

TEST(TouchProbe, Position_is_taken_one_cycle_after_the_edge_is_shown) {
    TouchProbe probe;
    const TouchProbe::Command armed{.enable = true};
    cycle(probe, {}, armed);
    EXPECT_FALSE(probe.armed()) << "the drive has not shown it yet";
    cycle(probe, {.status = enabled}, armed);
    EXPECT_TRUE(probe.armed());
    // the position comes with another PDO, a cycle later
    cycle(probe, {.status = enabled | rising_stored, .rising = 7}, armed);
    EXPECT_FALSE(probe.latched());
    cycle(probe, {.status = enabled | rising_stored, .rising = 4711}, armed);
    EXPECT_TRUE(probe.latched());
    EXPECT_EQ(probe.position(), 4711);
}

TEST(TouchProbe, Other_edge_does_not_count) {
    TouchProbe probe;
    const TouchProbe::Command falling{.enable = true, .falling = true};
    cycle(probe, {}, falling);
    for (int n = 0; n < 3; ++n) {
        cycle(probe, {.status = enabled | rising_stored, .rising = 1}, falling);
    }
    EXPECT_FALSE(probe.latched());
    for (int n = 0; n < 2; ++n) {
        cycle(probe, {.status = enabled | rising_stored | falling_stored, .falling = 2}, falling);
    }
    EXPECT_TRUE(probe.latched());
    EXPECT_EQ(probe.position(), 2);
}

TEST(TouchProbe, Edge_stored_before_does_not_count_when_it_is_armed_again) {
    TouchProbe probe;
    const TouchProbe::Command armed{.enable = true};
    const TouchProbe::Feedback stored{.status = enabled | rising_stored, .rising = 5};
    cycle(probe, {}, armed);
    cycle(probe, stored, armed);
    cycle(probe, stored, armed);
    ASSERT_TRUE(probe.latched());
    cycle(probe, stored, {});
    EXPECT_FALSE(probe.latched());
    for (int n = 0; n < 5; ++n) {  // the drive has not taken the release yet
        EXPECT_EQ(cycle(probe, stored, armed), 0);
        EXPECT_FALSE(probe.latched());
    }
    EXPECT_EQ(cycle(probe, {}, armed), 0x11);
    EXPECT_FALSE(probe.latched());
    EXPECT_EQ(probe.position(), 5) << "the last one stays";
}

TEST(TouchProbe, Lost_drive_releases_it_and_its_return_arms_it) {
    TouchProbe probe;
    const TouchProbe::Command armed{.enable = true};
    cycle(probe, {}, armed);
    cycle(probe, {.status = enabled}, armed);
    EXPECT_EQ(cycle(probe, {.operational = false, .status = enabled}, armed), 0);
    EXPECT_FALSE(probe.armed());
    EXPECT_EQ(cycle(probe, {.status = 0}, armed), 0x11);
}

}  // namespace
