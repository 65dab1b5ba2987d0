// SPDX-License-Identifier: MIT
// The Ethernet segment in memory with a device in line.
#include "segment_world.hpp"

namespace hal::ethernet {
namespace {

using namespace segment_world;

/// Sends every frame back by its port, `delay_ns` after its first bit, with 1 added to the first
/// byte.
struct Echo : Responder {
    Port* port = nullptr;
    std::int64_t delay_ns = 0;
    std::int64_t first_bit_ns = 0;
    int calls = 0;
    void arrived(std::span<std::uint8_t> bytes, std::int64_t at_ns) noexcept override {
        ++calls;
        first_bit_ns = at_ns;
        ++bytes[14];
        port->send(bytes, {.at_ns = at_ns + delay_ns}, at_ns);
    }
};

TEST(SegmentResponder,
     a_responder_makes_it_a_cable_on_which_a_reply_leaves_while_the_frame_arrives) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    Echo echo;
    echo.port = b.get();
    echo.delay_ns = us;
    ASSERT_TRUE(b->segment()->respond(&echo));
    EXPECT_EQ(a->send(frame_to(broadcast, *a, 0x88b5, {7}), {}, ms), Sent::queued);
    EXPECT_TRUE(all(*a, ms + us + minimum_ns - 1).empty());
    const auto got = all(*a, ms + us + minimum_ns + 1);
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].time_ns, ms + us + minimum_ns);
    EXPECT_EQ(got[0].first(), 8);
    EXPECT_EQ(echo.first_bit_ns, ms);
    EXPECT_TRUE(all(*b, 2 * ms).empty()) << "the responder took it";
}

TEST(SegmentResponder, frames_in_a_row_come_back_in_order_within_one_call) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    Echo echo;
    echo.port = b.get();
    ASSERT_TRUE(b->segment()->respond(&echo));
    for (std::uint8_t i = 0; i < 8; ++i) {
        EXPECT_EQ(a->send(frame_to(broadcast, *a, 0x88b5, {i}), {}, ms), Sent::queued);
    }
    EXPECT_EQ(firsts(all(*a, 2 * ms)), "12345678");
}

TEST(SegmentResponder, has_one_responder_and_is_a_switch_again_without_it) {
    const auto net = fresh();
    auto a = open_or_fail(net);
    auto b = open_or_fail(net);
    Echo first, second;
    first.port = b.get();
    second.port = a.get();
    EXPECT_TRUE(b->segment()->respond(&first));
    EXPECT_FALSE(a->segment()->respond(&second));
    EXPECT_TRUE(b->segment()->respond(nullptr));
    EXPECT_TRUE(a->segment()->respond(&second));
    a.reset();
    a = open_or_fail(net);
    EXPECT_EQ(a->send(frame_to(broadcast, *a, 0x88b5, {7}), {}, 3 * ms), Sent::queued);
    EXPECT_TRUE(all(*b, 3 * ms + one_way_ns - 1).empty());
    EXPECT_EQ(all(*b, 3 * ms + one_way_ns).size(), 1U);
    EXPECT_EQ(first.calls + second.calls, 0);
}

}  // namespace
}  // namespace hal::ethernet
