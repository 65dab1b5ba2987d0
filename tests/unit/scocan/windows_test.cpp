// SPDX-License-Identifier: MIT
// Transmit windows of the bus in memory, which the slots rely on.
#include <gtest/gtest.h>

#include "drivers/link/can.hpp"
#include "drivers/link/simulation.hpp"
#include "drivers/link/timing.hpp"

namespace {

using namespace hal::can;

struct Pair {
    Pair() : a(open("sim:windows", {.own_frames = true}).link), b(open("sim:windows").link) {
        a->flush(0);
        b->flush(0);
    }
    /// Returns the begins of the frames that b has received, in us.
    std::vector<double> begins(std::int64_t until) {
        std::vector<double> all;
        a->flush(until);
        for (Frame f; b->receive(f, until);) {
            all.push_back(
                static_cast<double>(
                    f.time_ns -
                    duration_ns({frame_bits(f).nominal - intermission_bits, 0}, 1'000'000)) /
                1e3);
        }
        return all;
    }
    std::unique_ptr<Link> a, b;
};

TEST(Window, starts_a_frame_at_its_instant) {
    Pair bus;
    ASSERT_TRUE(bus.a->description().has_windows);
    EXPECT_EQ(
        Sent::queued,
        bus.a->send_within({0x100, {1}}, {.not_before_ns = 500'250, .last_start_ns = 510'000}, 0));
    EXPECT_EQ(std::vector{500.25}, bus.begins(2'000'000));
}

TEST(Window, that_has_passed_discards_the_frame) {
    Pair bus;
    bus.b->send({0x300, {1, 2, 3, 4, 5, 6, 7, 8}}, 495'000);
    bus.a->send_within({0x100, {1}}, {.not_before_ns = 500'000, .last_start_ns = 510'000}, 0);
    bus.a->send_within({0x101, {1}}, {.not_before_ns = 900'000}, 0);
    EXPECT_EQ(std::vector{900.0}, bus.begins(2'000'000));
    EXPECT_EQ(1U, bus.a->statistics().dropped);
    std::size_t echoes = 0;
    for (Frame f; bus.a->receive(f, 2'000'000);) {
        echoes += f.own;
    }
    EXPECT_EQ(1U, echoes) << "only what was sent has an echo";
}

TEST(Window, can_require_an_idle_bus) {
    Pair bus;
    bus.b->send({0x300, {1}}, 405'000);
    bus.a->send_within(
        {0x100, {1}}, {.not_before_ns = 500'000, .idle_from_ns = 400'000, .idle_until_ns = 450'000},
        0);
    bus.a->send_within(
        {0x101, {1}}, {.not_before_ns = 900'000, .idle_from_ns = 800'000, .idle_until_ns = 850'000},
        0);
    EXPECT_EQ(std::vector{900.0}, bus.begins(2'000'000));
}

TEST(Window, with_single_shot_does_not_repeat_a_disturbed_frame) {
    Pair bus;
    bus.b->simulation()->disturb(
        {.fault = Fault::error, .every = 1, .id = 0x100, .mask = 0x7ff, .count = 1});
    bus.a->send_within({0x100, {1}}, {.not_before_ns = 500'000, .single_shot = true}, 0);
    bus.a->send_within({0x101, {1}}, {.not_before_ns = 900'000, .single_shot = true}, 0);
    EXPECT_EQ(std::vector{900.0}, bus.begins(2'000'000));
}

TEST(Window, is_rejected_where_frames_take_no_time) {
    auto link = open("sim:untimed", {.bit_rate = unlimited}).link;
    EXPECT_FALSE(link->description().has_windows);
    EXPECT_EQ(Sent::rejected, link->send_within({0x100, {1}}, {}, 0));
}

}  // namespace
