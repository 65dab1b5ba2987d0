// SPDX-License-Identifier: MIT
// Response-time analysis: the worked example of the paper, and a bus played frame by frame that never does worse than predicted.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "canopen/master/plan/response_time.hpp"

namespace hal::canopen::plan {
namespace {

constexpr std::int64_t us = 1000, ms = 1'000'000;

Message message(std::uint32_t id, unsigned bytes, std::int64_t period, std::int64_t deadline = 0, std::int64_t jitter = 0) {
    Message m;
    m.id = id, m.bytes = static_cast<std::uint8_t>(bytes), m.period = period, m.deadline = deadline, m.jitter = jitter;
    m.extended = id > 0x7ff;
    return m;
}

TEST(Plan, finds_the_late_instance_of_the_papers_example) {
    // Davis et al. 2007, section 3: 7 bytes at 125 kbit/s take 1 ms; the analysis of 1994 answers 2, 3 and 3 ms and calls it good.
    const std::vector<Message> m = {message(1, 7, 2500 * us, 2500 * us), message(2, 7, 3500 * us, 3250 * us),
                                    message(3, 7, 3500 * us, 3250 * us)};
    const Analysis a = analyse(m, {125'000, 0});
    EXPECT_EQ(125U, a.responses[0].bits);
    EXPECT_EQ(2 * ms, a.responses[0].worst);
    EXPECT_EQ(3 * ms, a.responses[1].worst);
    EXPECT_EQ(3500 * us, a.responses[2].worst);
    EXPECT_EQ(1, a.responses[2].instance);
    EXPECT_TRUE(a.responses[0].in_time && a.responses[1].in_time);
    EXPECT_FALSE(a.responses[2].in_time || a.fits);
    EXPECT_NEAR(1 / 2.5 + 2 / 3.5, a.load, 1e-9);
    EXPECT_EQ(250'000U, sufficient_bit_rate(m, {125'000, 0}));
}

TEST(Plan, one_message_alone_needs_its_frame_and_its_jitter) {
    const Analysis a = analyse(std::vector{message(0x181, 8, 10 * ms, 0, 100 * us)}, {1'000'000, 0});
    EXPECT_EQ(135 * us + 100 * us, a.responses[0].worst);
    EXPECT_FALSE(a.responses[0].blocker);
}

TEST(Plan, the_most_important_waits_for_the_longest_below_it) {
    const std::vector<Message> m = {message(1, 1, 10 * ms), message(2, 2, 10 * ms), message(3, 8, 10 * ms), message(4, 4, 10 * ms)};
    const Analysis a = analyse(m, {1'000'000, 0});
    ASSERT_TRUE(a.responses[0].blocker);
    EXPECT_EQ(2U, *a.responses[0].blocker);
    EXPECT_EQ(135 * us + 65 * us, a.responses[0].worst);
    EXPECT_EQ(0, a.responses[3].blocking);
}

TEST(Plan, a_standard_identifier_goes_before_an_extended_one_with_the_same_beginning) {
    EXPECT_TRUE(before(message(0x100, 8, ms), message(0x100 << 18, 8, ms)));
    EXPECT_FALSE(before(message(0x101, 8, ms), message(0x100 << 18, 8, ms)));
}

TEST(Plan, a_full_bus_has_no_answer_but_says_so) {
    const std::vector<Message> m = {message(1, 8, 135 * us), message(2, 8, 135 * us)};
    const Analysis a = analyse(m, {1'000'000, 0});
    EXPECT_EQ(-1, a.responses[1].worst);
    EXPECT_FALSE(a.fits);
    EXPECT_FALSE(sufficient_bit_rate(m, {1'000'000, 0}));
    EXPECT_TRUE(sufficient_order(m, {1'000'000, 0}).empty());
}

TEST(Plan, nonsense_is_survived) {
    EXPECT_TRUE(analyse({}, {1'000'000, 0}).fits);
    EXPECT_FALSE(analyse(std::vector{message(1, 8, ms)}, {0, 0}).fits);
    EXPECT_FALSE(analyse(std::vector{message(1, 8, 0), message(1, 255, -5, -5, INT64_MAX)}, {1, 1}).fits);
    EXPECT_EQ(-1,
              analyse(std::vector{message(1, 8, INT64_MAX, INT64_MAX, INT64_MAX), message(2, 8, 1)}, {1'000'000, 0}).responses[1].worst);
}

TEST(Plan, an_order_is_found_when_there_is_one) {
    // The urgent message has the worst identifier.
    const std::vector<Message> m = {message(1, 8, 20 * ms), message(2, 8, 20 * ms), message(3, 8, 20 * ms),
                                    message(4, 1, 2 * ms, 250 * us)};
    const Bus bus{1'000'000, 0};
    EXPECT_FALSE(analyse(m, bus).fits);
    const auto order = sufficient_order(m, bus);
    ASSERT_EQ(4U, order.size());
    EXPECT_EQ(3U, order.front());
    std::vector<Message> sorted;
    for (std::size_t i = 0; i < order.size(); ++i) sorted.push_back(m[order[i]]), sorted.back().id = static_cast<std::uint32_t>(i + 1);
    EXPECT_TRUE(analyse(sorted, bus).fits);
}

/// A bus played from the moment when everything is queued at once behind the longest frame of `blocker`: the worst responses seen.
std::vector<std::int64_t> played(const std::vector<Message>& m, const Analysis& a, std::int64_t blocking, std::int64_t until) {
    std::vector<std::int64_t> next(m.size(), 0), worst(m.size(), 0);
    std::vector<std::vector<std::int64_t>> queues(m.size());
    std::int64_t now = blocking;  // a frame that began just before 0
    while (now < until) {
        for (std::size_t i = 0; i < m.size(); ++i)
            for (; next[i] <= now; next[i] += m[i].period) queues[i].push_back(next[i]);
        std::size_t winner = m.size();
        for (std::size_t i = 0; i < m.size() && winner == m.size(); ++i)
            if (!queues[i].empty()) winner = i;
        if (winner == m.size()) {
            now = *std::min_element(next.begin(), next.end());
            continue;
        }
        now += a.responses[winner].frame;
        worst[winner] = std::max(worst[winner], now - queues[winner].front());
        queues[winner].erase(queues[winner].begin());
    }
    return worst;
}

TEST(Plan, no_bus_does_worse_than_predicted) {
    std::mt19937 generator(7);
    const auto random = [&] { return static_cast<unsigned>(generator()); };
    unsigned met = 0, checked = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<Message> m;
        const unsigned count = 2 + random() % 7;
        for (unsigned i = 0; i < count; ++i)
            m.push_back(message(i + 1, random() % 9, static_cast<std::int64_t>(4 + random() % 60) * 250 * us));
        const Analysis a = analyse(m, {125'000, 0});
        if (a.load >= 0.98) continue;
        for (std::size_t i = 0; i < m.size(); ++i) {
            const std::int64_t seen = played(m, a, a.responses[i].blocking, 200 * ms)[i];
            EXPECT_LE(seen, a.responses[i].worst) << "round " << round << " message " << i;
            met += seen == a.responses[i].worst;
            ++checked;
        }
    }
    EXPECT_GT(checked, 300U);
    EXPECT_GT(met, checked * 9 / 10);  // and the predicted bound is tight
}

}  // namespace
}  // namespace hal::canopen::plan
