// SPDX-License-Identifier: MIT
// Messages found in a recording.
#include <gtest/gtest.h>

#include "fieldbus/can_timing/recorded.hpp"

namespace hal::can_timing {
namespace {

constexpr std::int64_t us = 1000;
constexpr std::int64_t ms = 1'000'000;

can::Frame at(std::int64_t time, std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
    can::Frame f(id, bytes);
    f.time_ns = time;
    return f;
}

TEST(CanRecorded, Periodic_message_has_its_period_and_its_jitter) {
    std::vector<can::Frame> frames;
    for (int i = 0; i < 100; ++i) {
        frames.push_back(
            at(5000 * ms + i * 10 * ms + (i % 4 == 3 ? 400 * us : 0), 0x181, {1, 2, 3}));
    }
    frames[7].length = 8;
    const auto found = recorded(frames);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_TRUE(found[0].periodic);
    EXPECT_EQ(found[0].frames, 100U);
    EXPECT_EQ(found[0].message.bytes, 8);
    EXPECT_NEAR(static_cast<double>(found[0].message.period), 10e6, 1e3);
    EXPECT_NEAR(static_cast<double>(found[0].message.jitter), 400e3, 20e3);
}

TEST(CanRecorded, Irregular_message_has_its_shortest_distance) {
    std::vector<can::Frame> frames;
    for (const std::int64_t time : {0, 3, 40, 41, 90, 200}) {
        frames.push_back(at(time * ms, 0x80, {}));
    }
    const auto found = recorded(frames);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_FALSE(found[0].periodic);
    EXPECT_EQ(found[0].message.period, ms);
    EXPECT_EQ(found[0].message.jitter, 0);
}

TEST(CanRecorded, Formats_are_separate_and_in_order_of_priority) {
    can::Frame error = at(0, 0x20, {});
    error.error = true;
    can::Frame extended = at(ms, 0x100, {});
    extended.extended = true;
    const auto found = recorded(std::vector{error, at(2 * ms, 0x701, {5}), extended,
                                            at(3 * ms, 0x100, {}), can::Frame::request(0x100, 8)});
    ASSERT_EQ(found.size(), 4U);
    EXPECT_TRUE(found[0].message.extended);  // 100h in 29 bits begins with eleven zeros
    EXPECT_FALSE(found[1].message.remote);
    EXPECT_TRUE(found[2].message.remote);
    EXPECT_EQ(found[3].message.id, 0x701U);
    EXPECT_EQ(found[3].message.period, 0);
    EXPECT_TRUE(recorded({}).empty());
}

}  // namespace
}  // namespace hal::can_timing
