// SPDX-License-Identifier: MIT
// What a driver concludes from the registers of a latch and of a bridge, also when datagrams are lost.
#include <gtest/gtest.h>

#include "mesa/driver/bridge_enable.hpp"
#include "mesa/driver/step_latch.hpp"

namespace hal::mesa {
namespace {

constexpr std::uint32_t settings = 1;
constexpr std::uint32_t armed = settings | stepgen::latch_on_index;
constexpr std::uint32_t event = settings | 0x12345600;

/// A latch that has armed the index, in a datagram that has no answer yet.
struct StepLatchTest : testing::Test {
    StepLatch latch;
    StepLatchTest() {
        latch.receive(settings, true, false);
        sent = latch.transmit(settings, LatchSource::index);
    }
    std::optional<std::uint32_t> sent;
};

TEST_F(StepLatchTest, Arms_once_and_finds_the_event) {
    EXPECT_EQ(sent, armed);
    EXPECT_EQ(latch.receive(armed, true, false), LatchSource::none);
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), std::nullopt);
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::index);
    EXPECT_EQ(latch.latched(), 0x12345600U);
    EXPECT_EQ(latch.transmit(settings, LatchSource::none), std::nullopt);
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::none);
}

TEST_F(StepLatchTest, Finds_an_event_in_the_first_cycle) {
    EXPECT_EQ(latch.receive(settings, true, false), LatchSource::index);
}

TEST_F(StepLatchTest, Arms_again_when_the_write_was_lost) {
    EXPECT_EQ(latch.receive(settings, false, false), LatchSource::none);
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), armed);
}

TEST_F(StepLatchTest, Does_not_write_on_suspicion) {
    latch.miss();
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), std::nullopt);
}

TEST_F(StepLatchTest, Finds_out_behind_a_missing_answer_what_became_of_the_write) {
    latch.miss();
    EXPECT_EQ(latch.receive(armed, true, false), LatchSource::none);
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), std::nullopt) << "it had arrived";
    latch.miss();
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::index) << "armed before the gap";

    EXPECT_EQ(latch.transmit(settings, LatchSource::index), armed);
    latch.miss();
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::none) << "the old event";
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), armed) << "it was lost";
    latch.miss();
    EXPECT_EQ(latch.receive(settings | 0x22222200, true, false), LatchSource::index);
}

TEST_F(StepLatchTest, Does_not_take_a_reset_of_the_card_for_an_event) {
    latch.receive(armed, true, false);
    EXPECT_EQ(latch.receive(0, true, true), LatchSource::none);
    EXPECT_EQ(latch.transmit(settings, LatchSource::index), armed);
}

TEST_F(StepLatchTest, Disarms_before_it_arms_for_another_source) {
    latch.receive(armed, true, false);
    EXPECT_EQ(latch.transmit(settings, LatchSource::probe), settings);
    latch.receive(settings, true, false);
    EXPECT_EQ(latch.transmit(settings, LatchSource::probe), settings | stepgen::latch_on_probe);
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::probe);
}

TEST_F(StepLatchTest, Withdrawn_command_disarms) {
    latch.receive(armed, true, false);
    EXPECT_EQ(latch.transmit(settings, LatchSource::none), settings);
    EXPECT_EQ(latch.receive(event, true, false), LatchSource::none);
}

TEST_F(StepLatchTest, Goes_on_with_a_latch_that_is_armed_before_a_reload) {
    StepLatch reloaded;
    EXPECT_EQ(reloaded.receive(armed, true, false), LatchSource::none);
    EXPECT_EQ(reloaded.transmit(settings, LatchSource::index), std::nullopt);
    EXPECT_EQ(reloaded.receive(event, true, false), LatchSource::index);
}

constexpr std::uint32_t on = three_phase_pwm::is_enabled;
constexpr std::uint32_t fault = three_phase_pwm::has_fault;

TEST(BridgeEnable, Writes_the_bit_when_the_card_shows_another_one) {
    BridgeEnable bridge;
    EXPECT_EQ(bridge.transmit(true, true), std::nullopt) << "nothing is known";
    bridge.receive(0, true);
    EXPECT_EQ(bridge.transmit(true, true), on);
    bridge.receive(on, true);
    EXPECT_EQ(bridge.transmit(true, true), std::nullopt);
    bridge.receive(on, true);
    EXPECT_EQ(bridge.transmit(false, true), 0U);
    EXPECT_EQ(bridge.transmit(false, true), 0U) << "an answer is missing";
    bridge.receive(0, true);
    EXPECT_EQ(bridge.transmit(false, true), std::nullopt);
}

TEST(BridgeEnable, Is_off_while_the_outputs_of_the_card_are) {
    BridgeEnable bridge;
    bridge.receive(on, true);
    EXPECT_EQ(bridge.transmit(true, false), 0U);
    bridge.receive(0, true);
    EXPECT_EQ(bridge.transmit(true, false), std::nullopt);
    bridge.receive(0, true);
    EXPECT_EQ(bridge.transmit(true, true), on);
}

TEST(BridgeEnable, Stays_off_after_a_fault_until_the_command_was_FALSE) {
    BridgeEnable bridge;
    bridge.receive(0, true);
    bridge.transmit(true, true);
    bridge.receive(on, true);
    bridge.transmit(true, true);
    bridge.receive(fault, true);
    EXPECT_TRUE(bridge.is_tripped());
    for (int cycle = 0; cycle < 3; ++cycle) {
        EXPECT_EQ(bridge.transmit(true, true), std::nullopt);
        bridge.receive(fault, true);
    }
    bridge.transmit(false, true);
    bridge.receive(fault, true);
    EXPECT_EQ(bridge.transmit(true, true), on);
    bridge.receive(fault, false);
    EXPECT_FALSE(bridge.is_tripped()) << "the write has not arrived";
    EXPECT_EQ(bridge.transmit(true, true), on);
    bridge.receive(fault, true);
    EXPECT_TRUE(bridge.is_tripped()) << "the fault input is still active";
}

TEST(BridgeEnable, Does_not_clear_a_fault_after_a_write_that_may_have_arrived) {
    BridgeEnable bridge;
    bridge.receive(0, true);
    EXPECT_EQ(bridge.transmit(true, true), on);
    EXPECT_EQ(bridge.transmit(true, true), std::nullopt) << "an answer is missing";
    bridge.receive(fault, true);
    EXPECT_EQ(bridge.transmit(true, true), std::nullopt);
    EXPECT_TRUE(bridge.is_tripped());
}

}  // namespace
}  // namespace hal::mesa
