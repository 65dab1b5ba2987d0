// SPDX-License-Identifier: MIT
// A stop on an interface that does not send at once: what is reported, and that nothing is left out.
#include <memory>
#include <string>
#include <vector>

#include "fake_link.hpp"
#include "fieldbus/guardian/stop_transmitter.hpp"

namespace hal::guardian {
namespace {

constexpr std::int64_t step_ns = 1'000'000;

/// A transmitter on an interface, in steps of 1 ms.
class FailedAttempt : public testing::Test {
protected:
    void open(const std::string& frames, StopSchedule schedule = {.rounds = 1}) {
        StopFrames parsed;
        ASSERT_EQ(parse(frames, "", parsed), "");
        transmitter_ = std::make_unique<StopTransmitter>(parsed, schedule);
        ASSERT_EQ(transmitter_->attach(std::make_unique<FakeLink>(link_)), "");
    }
    void begin() { transmitter_->begin(now_); }
    void advance(int steps) {
        for (; steps > 0; --steps) {
            now_ += step_ns;
            transmitter_->work(now_);
        }
    }
    std::string unsent() const {
        std::string text;
        append_unsent(text, transmitter_->frames(), transmitter_->unsent(),
                      transmitter_->failure());
        return text;
    }
    Outcome outcome() const { return transmitter_->outcome(); }

    FakeLink::State link_;
    std::unique_ptr<StopTransmitter> transmitter_;
    std::int64_t now_ = 1000 * step_ns;
};

TEST_F(FailedAttempt, Is_not_sent_before_the_echo) {
    open("201#0000,000#0200");
    begin();
    advance(50);
    EXPECT_EQ(outcome(), Outcome::sending);
    EXPECT_EQ(transmitter_->rounds_sent(), 0U);
    link_.transmit(1);
    advance(1);
    EXPECT_EQ(transmitter_->rounds_sent(), 0U) << "of one frame only";
    link_.transmit(1);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
    EXPECT_TRUE(transmitter_->sees_bus());
}

TEST_F(FailedAttempt, Is_reported_with_the_frames_that_nobody_acknowledges) {
    open("201#0000,000#0200,080#");
    begin();
    link_.transmit(1);
    advance(101);
    EXPECT_EQ(outcome(), Outcome::delayed);
    EXPECT_EQ(unsent(), "000#0200 and 1 more: no other node acknowledges it");
}

TEST_F(FailedAttempt, Is_handed_to_the_driver_without_an_echo) {
    link_.has_echo = false;
    open("201#0000");
    begin();
    EXPECT_EQ(outcome(), Outcome::sent);
    EXPECT_FALSE(transmitter_->sees_bus());
    EXPECT_STREQ(sent_text(transmitter_->sees_bus()), "handed to the driver");
}

TEST_F(FailedAttempt, Does_not_count_what_the_full_interface_has_not_accepted) {
    for (const bool has_echo : {false, true}) {
        link_ = {};
        link_.has_echo = has_echo;
        link_.is_full = true;
        open("201#0000,000#0200", {.rounds = 2});
        begin();
        advance(101);
        EXPECT_EQ(transmitter_->rounds_sent(), 0U);
        EXPECT_EQ(outcome(), Outcome::delayed);
        EXPECT_EQ(unsent(), "201#0000 and 1 more: the transmit queue is full");
        EXPECT_LE(link_.queue.size(), 2U) << "an attempt discards what the one before has left";
        link_.is_full = false;
        for (int n = 0; n < 200; ++n) {
            advance(1);
            link_.transmit(100);
        }
        EXPECT_EQ(outcome(), Outcome::sent) << "no round is left out";
        EXPECT_EQ(transmitter_->rounds_sent(), 2U);
        EXPECT_EQ(link_.on_bus.size(), 4U);
    }
}

TEST_F(FailedAttempt, Continues_at_once_when_the_interface_accepts_frames_again) {
    link_.is_full = true;
    open("201#0000");
    begin();
    advance(20);
    link_.is_full = false;
    advance(1);
    EXPECT_EQ(link_.waiting.size(), 1U);
    link_.transmit(1);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, Is_repeated_until_the_interface_is_up) {
    link_.answer = can::Sent::down;
    link_.controller = can::State::down;
    open("201#0000", {.rounds = 1, .every_ns = 1000 * step_ns});
    EXPECT_FALSE(transmitter_->is_ready());
    begin();
    EXPECT_EQ(outcome(), Outcome::delayed);
    EXPECT_EQ(unsent(), "201#0000: the interface is down");
    advance(500);
    link_.answer = can::Sent::queued;
    link_.controller = can::State::active;
    EXPECT_TRUE(transmitter_->is_ready());
    advance(20);
    link_.transmit(1);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, Sends_the_other_frames_when_one_is_rejected) {
    open("201#0000,000#0200");
    link_.is_rejected = true;
    begin();
    EXPECT_EQ(outcome(), Outcome::delayed);
    EXPECT_EQ(transmitter_->failure(), Failure::rejected);
    link_.is_rejected = false;
    advance(11);
    link_.transmit(2);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, Overtakes_what_waits_and_follows_it) {
    link_.has_priorities = true;
    link_.waiting.assign(20, {0x201, {0x10, 0x27}});  // commands of the machine
    open("201#0000");
    begin();
    advance(101);
    EXPECT_EQ(outcome(), Outcome::delayed);
    link_.transmit(1);
    advance(1);
    EXPECT_TRUE(link_.on_bus.back().same({0x201, {0, 0}})) << "it has overtaken the commands";
    EXPECT_NE(outcome(), Outcome::sent) << "they would undo it";
    link_.transmit(100);
    advance(1);
    EXPECT_TRUE(link_.on_bus.back().same({0x201, {0, 0}})) << "and follows them";
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, Is_made_less_often_on_a_slow_bus) {
    link_.has_priorities = true;
    open("201#0000");
    begin();
    advance(10'000);
    EXPECT_LE(link_.waiting.size(), 20U);
    link_.transmit(100);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, Is_made_again_at_once_when_the_controller_has_lost_its_frames) {
    open("201#0000");
    begin();
    advance(500);
    link_.controller = can::State::bus_off;
    link_.answer = can::Sent::bus_off;
    link_.waiting.clear();
    advance(1);
    EXPECT_EQ(unsent(), "201#0000: the controller is bus off");
    advance(100);
    link_.controller = can::State::active;
    link_.answer = can::Sent::queued;
    advance(11);
    EXPECT_EQ(link_.waiting.size(), 1U);
    link_.transmit(1);
    advance(1);
    EXPECT_EQ(outcome(), Outcome::sent);
}

TEST_F(FailedAttempt, On_a_listen_only_link_is_an_error_at_the_start) {
    StopFrames parsed;
    ASSERT_EQ(parse("201#0000", "", parsed), "");
    StopTransmitter transmitter(parsed, {});
    EXPECT_EQ(transmitter.attach(std::make_unique<FakeLink>(link_, true)),
              "can:fake0 is listen-only, so no stop frame is sent; remove `listen` from the "
              "address");
    EXPECT_TRUE(StopTransmitter(parsed, {})
                    .open("sim:listens?listen")
                    .starts_with("sim:listens is listen-only"));
}

TEST(Schedule, Has_the_time_of_all_rounds) {
    EXPECT_EQ((StopSchedule{.rounds = 60, .every_ns = 1'000'000'000}.duration_ns()),
              max_duration_ns);
}

}  // namespace
}  // namespace hal::guardian
