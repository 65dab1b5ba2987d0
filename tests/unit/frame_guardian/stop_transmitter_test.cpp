// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/stop_transmitter.hpp"

#include <memory>
#include <string>
#include <vector>

#include "link/simulation.hpp"

namespace hal::guardian {
namespace {

constexpr std::int64_t millisecond = 1'000'000;

/// A transmitter and a device on a CAN bus in memory, in steps of 1 ms.
class StopTransmission : public testing::Test {
protected:
    void open(const std::string& frames, const std::string& confirmations,
              StopSchedule schedule = {}) {
        StopFrames parsed;
        ASSERT_EQ(parse(frames, confirmations, parsed), "");
        device_ = can::open("sim:stop?bitrate=500k").link;
        transmitter_ = std::make_unique<StopTransmitter>(parsed, schedule);
        ASSERT_EQ(transmitter_->open("sim:stop?bitrate=500k"), "");
    }
    void advance(int steps) {
        for (; steps > 0; --steps) {
            now_ += millisecond;
            transmitter_->work(now_);
            device_->flush(now_);
            for (can::Frame frame; device_->receive(frame, now_);) {
                received_.push_back(frame.id);
            }
        }
    }
    void answer(std::uint32_t id, std::uint8_t state) {
        device_->send({id, {state, 0}}, now_);
        device_->flush(now_);
    }

    std::unique_ptr<can::Link> device_;
    std::unique_ptr<StopTransmitter> transmitter_;
    std::vector<std::uint32_t> received_;
    std::int64_t now_ = 1000 * millisecond;
};

using Ids = std::vector<std::uint32_t>;

TEST_F(StopTransmission, Repeats_all_frames_in_their_order) {
    open("201#0000,000#0200", "");
    advance(100);
    EXPECT_EQ(transmitter_->outcome(), Outcome::none);
    EXPECT_TRUE(received_.empty());
    transmitter_->begin(now_);
    advance(100);
    EXPECT_EQ(transmitter_->outcome(), Outcome::sent);
    EXPECT_EQ(received_, (Ids{0x201, 0, 0x201, 0, 0x201, 0}));
    EXPECT_GE(transmitter_->elapsed_ns(), 20 * millisecond);
    EXPECT_LE(transmitter_->elapsed_ns(), 23 * millisecond);
}

TEST_F(StopTransmission, Waits_for_all_confirmations) {
    open("000#0200", "701#04,702#04", {.rounds = 100});
    answer(0x701, 4);  // before the stop: no confirmation of it
    answer(0x702, 4);
    advance(2);
    transmitter_->begin(now_);
    advance(50);
    EXPECT_EQ(transmitter_->outcome(), Outcome::sending);
    answer(0x701, 4);
    answer(0x702, 5);
    advance(50);
    EXPECT_EQ(transmitter_->outcome(), Outcome::sending);
    answer(0x702, 4);
    advance(2);
    EXPECT_EQ(transmitter_->outcome(), Outcome::confirmed);
    const std::size_t count = received_.size();
    advance(100);
    EXPECT_EQ(received_.size(), count);
}

TEST_F(StopTransmission, Ends_without_confirmation_after_its_rounds) {
    open("000#0200", "701#04", {.rounds = 2});
    transmitter_->begin(now_);
    advance(12);
    EXPECT_EQ(transmitter_->outcome(), Outcome::sending);
    advance(20);
    EXPECT_EQ(transmitter_->outcome(), Outcome::unconfirmed);
    EXPECT_TRUE(transmitter_->is_over());
    EXPECT_EQ(received_, (Ids{0, 0}));
}

TEST_F(StopTransmission, Is_delayed_while_nobody_acknowledges) {
    open("000#0200", "", {.rounds = 1});
    device_->simulation()->cut(1, true);  // the second link that was opened
    transmitter_->begin(now_);
    advance(250);
    EXPECT_EQ(transmitter_->outcome(), Outcome::delayed);
    EXPECT_FALSE(transmitter_->is_over());
    EXPECT_EQ(transmitter_->rounds_sent(), 0U);
    device_->simulation()->cut(1, false);
    advance(250);
    EXPECT_EQ(transmitter_->outcome(), Outcome::sent);
    EXPECT_FALSE(received_.empty());
}

TEST_F(StopTransmission, Begins_again_with_each_stop) {
    open("000#0200", "");
    transmitter_->begin(now_);
    advance(12);
    transmitter_->begin(now_);
    advance(100);
    EXPECT_EQ(received_.size(), 5U);
    EXPECT_EQ(transmitter_->rounds_sent(), 3U);
}

TEST(StopTransmissionOnEthernet, Hands_whole_frames_to_the_segment) {
    auto opened = ethernet::open("sim:stop-segment");
    ASSERT_TRUE(opened) << opened.problem;
    StopFrames frames;
    ASSERT_EQ(parse("FFFFFFFFFFFF.020000000001.88B5.4242", "", frames), "");
    StopTransmitter transmitter(frames, {.rounds = 2});
    ASSERT_EQ(transmitter.open("sim:stop-segment"), "");
    std::int64_t now = millisecond;
    transmitter.begin(now);
    int received = 0;
    for (int n = 0; n < 50; ++n) {
        now += millisecond;
        transmitter.work(now);
        while (auto arrival = opened.port->receive(now)) {
            EXPECT_EQ(arrival->bytes[14], 0x42);
            ++received;
        }
    }
    EXPECT_EQ(received, 2);
    EXPECT_EQ(transmitter.outcome(), Outcome::sent);
}

}  // namespace
}  // namespace hal::guardian
