// SPDX-License-Identifier: MIT
// Response-time analysis: the worked example of the paper, and a bus played frame by frame that
// never does worse than predicted.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "fieldbus/can_timing/response_time.hpp"

namespace hal::can_timing {
namespace {

constexpr std::int64_t us = 1000;
constexpr std::int64_t ms = 1'000'000;

Message message(std::uint32_t id, unsigned bytes, std::int64_t period, std::int64_t deadline = 0,
                std::int64_t jitter = 0) {
    Message m;
    m.id = id;
    m.bytes = static_cast<std::uint8_t>(bytes);
    m.period = period;
    m.deadline = deadline;

    m.jitter = jitter;
    m.extended = id > 0x7ff;
    return m;
}

TEST(CanResponseTime, finds_the_late_instance_of_the_papers_example) {
    // Davis et al. 2007, section 3: 7 bytes at 125 kbit/s take 1 ms; the analysis of 1994 answers
    // 2, 3 and 3 ms and calls it good.
    const std::vector<Message> m = {message(1, 7, 2500 * us, 2500 * us),
                                    message(2, 7, 3500 * us, 3250 * us),
                                    message(3, 7, 3500 * us, 3250 * us)};
    const Analysis a = analyse(m, {125'000, 0, {}});
    EXPECT_EQ(125U, a.responses[0].bits);
    EXPECT_EQ(2 * ms, a.responses[0].worst);
    EXPECT_EQ(3 * ms, a.responses[1].worst);
    EXPECT_EQ(3500 * us, a.responses[2].worst);
    EXPECT_EQ(1, a.responses[2].instance);
    EXPECT_TRUE(a.responses[0].in_time && a.responses[1].in_time);
    EXPECT_FALSE(a.responses[2].in_time || a.fits);
    EXPECT_NEAR(1 / 2.5 + 2 / 3.5, a.load, 1e-9);
    EXPECT_EQ(250'000U, sufficient_bit_rate(m, {125'000, 0, {}}));
}

/// 17 messages like those of the SAE benchmark for cars (Tindell, Burns 1994).
std::vector<Message> car() {
    struct Row {
        unsigned bytes;
        std::int64_t period_ms, deadline_ms, jitter_us;
    };
    constexpr Row rows[] = {{1, 50, 5, 100},      {2, 5, 5, 100},      {1, 5, 5, 100},
                            {2, 5, 5, 100},       {1, 5, 5, 100},      {2, 5, 5, 100},
                            {6, 10, 10, 200},     {1, 10, 10, 200},    {2, 10, 10, 200},
                            {2, 10, 10, 200},     {1, 50, 20, 200},    {4, 100, 100, 300},
                            {1, 100, 100, 300},   {1, 100, 100, 200},  {3, 1000, 1000, 400},
                            {1, 1000, 1000, 300}, {1, 1000, 1000, 300}};
    std::vector<Message> all;
    for (const Row& r : rows) {
        all.push_back(message(static_cast<std::uint32_t>(all.size() + 1), r.bytes, r.period_ms * ms,
                              r.deadline_ms * ms, r.jitter_us * us));
    }
    return all;
}

std::vector<std::int64_t> worst_us(const std::vector<Message>& m, const Bus& bus) {
    std::vector<std::int64_t> worst;
    for (const Response& r : analyse(m, bus).responses) {
        worst.push_back(r.worst / us);
    }
    return worst;
}

TEST(CanResponseTime, Car_at_four_bit_rates) {
    using Expected = std::vector<std::int64_t>;
    EXPECT_EQ(worst_us(car(), {125'000, 0, {}}),
              (Expected{1540, 2140, 2660, 3260, 3780, 4380, 5240, 8600, 9200, 9800, 10320, 19420,
                        19940, 20360, 29400, 29820, 29820}));
    EXPECT_EQ(worst_us(car(), {250'000, 0, {}}),
              (Expected{820, 1120, 1380, 1680, 1940, 2240, 2720, 2980, 3280, 3580, 3840, 4280, 4540,
                        4700, 5160, 5320, 5320}));
    EXPECT_EQ(worst_us(car(), {500'000, 0, {}}),
              (Expected{460, 610, 740, 890, 1020, 1170, 1460, 1590, 1740, 1890, 2020, 2290, 2420,
                        2450, 2780, 2810, 2810}));
    EXPECT_EQ(worst_us(car(), {1'000'000, 0, {}}),
              (Expected{280, 355, 420, 495, 560, 635, 830, 895, 970, 1045, 1110, 1295, 1360, 1325,
                        1590, 1555, 1555}));
    EXPECT_TRUE(analyse(car(), {125'000, 0, {}}).fits);
}

TEST(CanResponseTime, Car_with_errors) {
    using Expected = std::vector<std::int64_t>;
    EXPECT_EQ(worst_us(car(), {250'000, 0, {1, 10 * ms}}),
              (Expected{1204, 1544, 1804, 2104, 2364, 2664, 3304, 3564, 3864, 4164, 4424, 4864,
                        5124, 5284, 7164, 7324, 7324}));
    const auto late = [](const Analysis& a) {
        std::vector<std::size_t> ids;
        for (std::size_t i = 0; i < a.responses.size(); ++i) {
            if (!a.responses[i].in_time) {
                ids.push_back(i + 1);
            }
        }
        return ids;
    };
    EXPECT_EQ(late(analyse(car(), {125'000, 0, {1, 100 * ms}})),
              (std::vector<std::size_t>{6, 9, 10}));
    EXPECT_EQ(late(analyse(car(), {125'000, 0, {1, 10 * ms}})),
              (std::vector<std::size_t>{6, 9, 10, 11}));
}

/// The robot YAIR on plain CAN, its ultrasound as 32 frames every 25.6 ms.
std::vector<Message> robot(std::uint32_t fifo) {
    std::vector<Message> all{message(0x010, 1, 50 * ms)};
    for (std::uint32_t id = 0x100; id < 0x104; ++id) {
        all.push_back(message(id, 8, 10 * ms, 0, 100 * us));
    }
    all.push_back(message(0x10a, 8, 10 * ms, 0, 100 * us));
    all.push_back(message(0x10b, 4, 20 * ms, 0, ms));
    all.push_back(message(0x300, 1, 100 * ms, 0, ms));
    all.push_back(message(0x301, 1, 100 * ms, 0, ms));
    all.push_back(message(0x302, 4, 100 * ms, 0, ms));
    for (std::uint32_t n = 0; n < 32; ++n) {
        all.push_back(message(0x310 + n, 8, 25'600 * us, 0, 100 * us));
        all.back().fifo = fifo;
    }
    return all;
}

TEST(CanResponseTime, Burst_of_one_node_in_order_of_arrival) {
    const auto by_priority = worst_us(robot(0), {500'000, 0, {}});

    const auto by_arrival = worst_us(robot(1), {500'000, 0, {}});
    EXPECT_EQ(std::vector<std::int64_t>(by_priority.begin(), by_priority.begin() + 11),
              (std::vector<std::int64_t>{400, 770, 1040, 1310, 1580, 1850, 2940, 3070, 3200, 3390,
                                         2760}));
    EXPECT_EQ(by_priority.back(), 12210);
    EXPECT_EQ(worst_us(robot(0), {1'000'000, 0, {1, 10 * ms}}).back(), 5646);
    for (std::size_t i = 10; i < by_arrival.size(); ++i) {
        EXPECT_EQ(by_arrival[i], 12480) << i;
    }
    EXPECT_EQ(std::vector<std::int64_t>(by_arrival.begin(), by_arrival.begin() + 10),
              std::vector<std::int64_t>(by_priority.begin(), by_priority.begin() + 10));
}

TEST(CanResponseTime, one_message_alone_needs_its_frame_and_its_jitter) {
    const Analysis a =
        analyse(std::vector{message(0x181, 8, 10 * ms, 0, 100 * us)}, {1'000'000, 0, {}});
    EXPECT_EQ(135 * us + 100 * us, a.responses[0].worst);
    EXPECT_FALSE(a.responses[0].blocker);
}

TEST(CanResponseTime, the_most_important_waits_for_the_longest_below_it) {
    const std::vector<Message> m = {message(1, 1, 10 * ms), message(2, 2, 10 * ms),
                                    message(3, 8, 10 * ms), message(4, 4, 10 * ms)};
    const Analysis a = analyse(m, {1'000'000, 0, {}});
    ASSERT_TRUE(a.responses[0].blocker);
    EXPECT_EQ(2U, *a.responses[0].blocker);
    EXPECT_EQ(135 * us + 65 * us, a.responses[0].worst);
    EXPECT_EQ(0, a.responses[3].blocking);
}

TEST(CanResponseTime, a_standard_identifier_goes_before_an_extended_one_with_the_same_beginning) {
    EXPECT_TRUE(before(message(0x100, 8, ms), message(0x100 << 18, 8, ms)));
    EXPECT_FALSE(before(message(0x101, 8, ms), message(0x100 << 18, 8, ms)));
}

TEST(CanResponseTime, a_full_bus_has_no_answer_but_says_so) {
    const std::vector<Message> m = {message(1, 8, 135 * us), message(2, 8, 135 * us)};
    const Analysis a = analyse(m, {1'000'000, 0, {}});
    EXPECT_EQ(-1, a.responses[1].worst);
    EXPECT_FALSE(a.fits);
    EXPECT_FALSE(sufficient_bit_rate(m, {1'000'000, 0, {}}));
    EXPECT_TRUE(sufficient_order(m, {1'000'000, 0, {}}).empty());
}

TEST(CanResponseTime, nonsense_is_survived) {
    EXPECT_TRUE(analyse({}, {1'000'000, 0, {}}).fits);
    EXPECT_FALSE(analyse(std::vector{message(1, 8, ms)}, {0, 0, {}}).fits);
    EXPECT_FALSE(
        analyse(std::vector{message(1, 8, 0), message(1, 255, -5, -5, INT64_MAX)}, {1, 1, {}})
            .fits);
    EXPECT_EQ(-1,
              analyse(std::vector{message(1, 8, INT64_MAX, INT64_MAX, INT64_MAX), message(2, 8, 1)},
                      {1'000'000, 0, {}})
                  .responses[1]
                  .worst);
}

TEST(CanResponseTime, an_order_is_found_when_there_is_one) {
    // The urgent message has the worst identifier.
    const std::vector<Message> m = {message(1, 8, 20 * ms), message(2, 8, 20 * ms),
                                    message(3, 8, 20 * ms), message(4, 1, 2 * ms, 250 * us)};
    const Bus bus{1'000'000, 0, {}};
    EXPECT_FALSE(analyse(m, bus).fits);
    const auto order = sufficient_order(m, bus);
    ASSERT_EQ(4U, order.size());
    EXPECT_EQ(3U, order.front());
    std::vector<Message> sorted;
    for (std::size_t i = 0; i < order.size(); ++i) {
        sorted.push_back(m[order[i]]);
        sorted.back().id = static_cast<std::uint32_t>(i + 1);
    }
    EXPECT_TRUE(analyse(sorted, bus).fits);
}

/// A bus played from the moment when everything is queued at once behind the longest frame of
/// `blocker`: the worst responses seen.
std::vector<std::int64_t> played(const std::vector<Message>& m, const Analysis& a,
                                 std::int64_t blocking, std::int64_t until) {
    std::vector<std::int64_t> next(m.size(), 0), worst(m.size(), 0);
    std::vector<std::vector<std::int64_t>> queues(m.size());
    std::int64_t now = blocking;  // a frame that began just before 0
    while (now < until) {
        for (std::size_t i = 0; i < m.size(); ++i) {
            for (; next[i] <= now; next[i] += m[i].period) {
                queues[i].push_back(next[i]);
            }
        }
        std::size_t winner = m.size();
        for (std::size_t i = 0; i < m.size() && winner == m.size(); ++i) {
            if (!queues[i].empty()) {
                winner = i;
            }
        }
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

TEST(CanResponseTime, no_bus_does_worse_than_predicted) {
    std::mt19937 generator(7);
    const auto random = [&] { return static_cast<unsigned>(generator()); };
    unsigned met = 0;
    unsigned checked = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<Message> m;
        const unsigned count = 2 + random() % 7;
        for (unsigned i = 0; i < count; ++i) {
            m.push_back(message(i + 1, random() % 9,
                                static_cast<std::int64_t>(4 + random() % 60) * 250 * us));
        }
        const Analysis a = analyse(m, {125'000, 0, {}});
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
}  // namespace hal::can_timing
