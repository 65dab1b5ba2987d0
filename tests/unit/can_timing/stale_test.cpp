// SPDX-License-Identifier: MIT
#include "link/stale.hpp"

#include <gtest/gtest.h>

namespace hal::can {
namespace {

constexpr std::int64_t ms = 1'000'000;

bool is_stale_after(std::int64_t wait_ns, std::int64_t period_ns) {
    Frame frame;
    frame.time_ns = 5'000 * ms;
    return is_stale(frame, frame.time_ns + wait_ns, period_ns);
}

TEST(Stale, Frame_is_stale_after_a_tenth_of_a_second) {
    EXPECT_FALSE(is_stale_after(0, ms));
    EXPECT_FALSE(is_stale_after(-ms, ms)) << "received within this cycle";
    EXPECT_FALSE(is_stale_after(100 * ms, ms));
    EXPECT_TRUE(is_stale_after(100 * ms + 1, ms));
}

TEST(Stale, Frame_is_stale_after_two_cycles_of_a_slow_thread) {
    EXPECT_FALSE(is_stale_after(160 * ms, 80 * ms));
    EXPECT_TRUE(is_stale_after(160 * ms + 1, 80 * ms));
    EXPECT_FALSE(is_stale_after(100 * ms, 50 * ms));
    EXPECT_TRUE(is_stale_after(100 * ms + 1, 50 * ms));
}

TEST(Stale, Frame_without_a_time_stamp_is_not_stale) {
    EXPECT_FALSE(is_stale(Frame{}, 1'000'000 * ms, ms));
}

}  // namespace
}  // namespace hal::can
