// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "machine/report/cycle_guard.hpp"

namespace {

struct CycleTimeLimitTest : testing::Test {
    using CycleTimeLimit = hal::CycleTimeLimit;
    using Action = CycleTimeLimit::Action;
    static constexpr std::int64_t s = 1'000'000'000;
    const hal::Core* core = reinterpret_cast<const hal::Core*>(0x1000);  // only compared
    CycleTimeLimit time_limit;
    std::vector<std::int64_t> reports;
    /// The cycle is in this function from `from` to `until`, looked at every second.
    Action run(std::uint64_t cycle, std::uint32_t function, std::int64_t from, std::int64_t until) {
        for (std::int64_t t = from; t <= until; ++t) {
            const Action action = time_limit.check({core, cycle, function}, t * s);
            if (action == Action::report) {
                reports.push_back(t);
            }
            if (action == Action::end) return action;
        }
        return Action::none;
    }
};

TEST_F(CycleTimeLimitTest, Endless_cycle_is_reported_after_10_s_and_then_ever_more_rarely) {
    run(0, 1, 100, 2000);
    EXPECT_EQ(reports, (std::vector<std::int64_t>{110, 120, 140, 180, 260, 420, 740, 1340, 1940}));
    EXPECT_TRUE(time_limit.one_function());
    EXPECT_EQ(time_limit.slow_cycles(), 1u);
}

TEST_F(CycleTimeLimitTest, Fast_cycles_are_not_reported) {
    for (std::uint64_t cycle = 0; cycle < 1000; ++cycle) {
        run(cycle, 1, static_cast<std::int64_t>(9 * cycle),
            static_cast<std::int64_t>(9 * cycle + 8));
    }
    EXPECT_TRUE(reports.empty());
}

TEST_F(CycleTimeLimitTest, Slow_cycles_share_the_limit_of_reports_and_are_counted) {
    for (std::uint64_t cycle = 0; cycle < 100; ++cycle) {
        run(cycle, 1, static_cast<std::int64_t>(12 * cycle),
            static_cast<std::int64_t>(12 * cycle + 11));
    }
    EXPECT_EQ(time_limit.slow_cycles(), 100u);
    EXPECT_LE(reports.size(), 9u);
    EXPECT_EQ(reports.front(), 10);
}

TEST_F(CycleTimeLimitTest, Cycle_that_went_from_function_to_function_does_not_blame_the_last_one) {
    run(0, 1, 0, 6);
    run(0, 2, 7, 11);
    EXPECT_EQ(reports, (std::vector<std::int64_t>{10}));
    EXPECT_FALSE(time_limit.one_function());
}

TEST_F(CycleTimeLimitTest, Limit_ends_only_a_cycle_that_is_longer) {
    time_limit.limit_ns = 5 * s;
    EXPECT_EQ(run(0, 1, 0, 4), Action::none);
    EXPECT_EQ(run(1, 1, 5, 9), Action::none);
    EXPECT_EQ(run(2, 1, 10, 15), Action::end);
}

TEST_F(CycleTimeLimitTest, Time_between_cycles_does_not_count) {
    run(0, 1, 0, 5);
    for (std::int64_t t = 6; t < 100; ++t) {
        EXPECT_EQ(time_limit.check({}, t * s), Action::none);
    }
    EXPECT_FALSE(time_limit.in_cycle());
    run(1, 1, 100, 105);
    EXPECT_TRUE(reports.empty());
}

}  // namespace
