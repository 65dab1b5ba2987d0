// SPDX-License-Identifier: MIT
// The link scocan:NODE, and the exchange with the node behind it.
#include <gtest/gtest.h>

#include "drivers/discipline/slot_exchange.hpp"
#include "drivers/link/can.hpp"

namespace {

using namespace hal::can;

Description at_500_kbit() {
    Description description;
    description.bit_rate = 500'000;
    return description;
}

TEST(Scocan_link, needs_a_node_of_this_process) {
    EXPECT_EQ(
        "scocan:nobody: no node 'nobody' in this process; load it before: loadrt scocan "
        "config=FILE.scocan node=nobody",
        open("scocan:nobody").problem);
    const auto exchange = offer_slots("motor", at_500_kbit());
    EXPECT_EQ("scocan:moter: no node 'moter' in this process; nodes are motor",
              open("scocan:moter").problem);
    EXPECT_EQ(
        "scocan:motor?slot=x: invalid slot 'x'; write the number of a private slot of motor, as in "
        "scocan:motor?slot=3",
        open("scocan:motor?slot=x").problem);
    EXPECT_EQ(nullptr, offer_slots("motor", {})) << "each node once";
    withdraw_slots(*exchange);
    EXPECT_EQ(nullptr, slots_of("motor"));
}

TEST(Scocan_link, passes_frames_to_the_node_and_back) {
    const auto exchange = offer_slots("motor", at_500_kbit());
    auto link = open("scocan:motor?slot=3").link;
    ASSERT_NE(nullptr, link);
    EXPECT_EQ(500'000U, link->description().bit_rate);
    EXPECT_EQ(Sent::down, link->send({0x181, {1}}, 0)) << "the node does not send yet";
    exchange->state.store(State::active);
    EXPECT_EQ(Sent::queued, link->send({0x000, {1, 5}}, 0));
    EXPECT_EQ(Sent::rejected, link->send({0x12345, {1}}, 0)) << "base frames only";
    int users = 0;
    exchange->each([&](SlotUser& user) {
        ++users;
        SlotFrame frame;
        ASSERT_TRUE(user.outgoing.pop(frame));
        EXPECT_EQ(3U, frame.slot);
        EXPECT_EQ(0x77aU, frame.frame.id) << "NMT has another identifier than the SYNC";
        user.incoming.push(Frame{0x77b, {4}});
        user.incoming.push(Frame{0x581, {5}});
    });
    EXPECT_EQ(1, users);
    Frame frame;
    ASSERT_TRUE(link->receive(frame, 0));
    EXPECT_EQ(0x7e4U, frame.id);
    ASSERT_TRUE(link->receive(frame, 0));
    EXPECT_EQ(0x581U, frame.id);
    EXPECT_FALSE(link->receive(frame, 0));
    link.reset();
    users = 0;
    exchange->each([&](SlotUser&) { ++users; });
    EXPECT_EQ(0, users);
    withdraw_slots(*exchange);
}

}  // namespace
