// SPDX-License-Identifier: MIT
// The faults injected on a bus in memory.
#include "link/disturbances.hpp"

#include <gtest/gtest.h>

#include "link/simulation.hpp"

namespace {

using Disturbances = hal::link::Disturbances<hal::can::Disturbance>;

unsigned strikes(Disturbances& all, unsigned frames) {
    unsigned count = 0;
    for (unsigned n = 0; n < frames; ++n) {
        count += all.match(*all.begin()) ? 1 : 0;
    }
    return count;
}

TEST(Disturbances, Every_nth_matching_frame_is_struck) {
    Disturbances all;
    EXPECT_EQ(0, all.add({.every = 4}));
    EXPECT_EQ(25U, strikes(all, 100));
}

TEST(Disturbances, A_probability_strikes_the_same_frames_for_a_seed) {
    Disturbances first, second;
    for (Disturbances* const all : {&first, &second}) {
        all->add({.probability = 0.25});
        all->random.seed(7);
    }
    const unsigned struck = strikes(first, 4000);
    EXPECT_NEAR(1000.0, struck, 100.0);
    EXPECT_EQ(struck, strikes(second, 4000));
}

TEST(Disturbances, One_ends_with_its_time_and_its_count) {
    Disturbances all;
    all.add({.every = 1, .count = 2, .from_ns = 10, .until_ns = 20});
    auto& one = *all.begin();
    EXPECT_FALSE(one.is_active(9));
    EXPECT_TRUE(one.is_active(10));
    EXPECT_FALSE(one.is_active(20));
    one.hits = 2;
    EXPECT_FALSE(one.is_active(10));
}

TEST(Disturbances, Numbers_beyond_the_last_one_have_no_hits) {
    Disturbances all;
    for (int n = 0; n < 64; ++n) {
        EXPECT_EQ(n, all.add({}));
    }
    EXPECT_EQ(-1, all.add({}));
    EXPECT_EQ(0U, all.hits(-1));
    EXPECT_EQ(0U, all.hits(64));
    all.clear();
    EXPECT_EQ(0, all.add({}));
}

}  // namespace
