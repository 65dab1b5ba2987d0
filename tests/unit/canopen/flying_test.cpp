// SPDX-License-Identifier: MIT
// The flying master's protocol, several of them on one wire that loses nothing unless it is cut.
#include <gtest/gtest.h>

#include <deque>

#include "canopen/master/boot/flying_master.hpp"

namespace hal::canopen::test {
namespace {

using State = FlyingMaster::State;

struct Flyer {
    explicit Flyer(const FlyingSetup& s) : setup(s) {}
    FlyingSetup setup;
    FrameQueue out{64};
    FlyingMaster master{setup, out};
    bool alive = true;
    bool connected = true;
    std::vector<std::uint32_t> sent;
};

struct Wire : testing::Test {
    Flyer& add(std::uint8_t id, std::uint8_t priority) {
        FlyingSetup s{.enabled = true, .id = id, .priority = priority};
        s.timeout = 50 * millisecond;
        s.delay = 100 * millisecond;

        s.priority_slot = 300 * millisecond;
        s.device_slot = millisecond;
        s.detect_cycle = 500 * millisecond;
        s.silence = 50 * millisecond;
        return flyers.emplace_back(s);
    }
    void start() {
        for (auto& f : flyers) {
            f.master.start(now);
        }
    }
    void say(Flyer& from, const Frame& frame) {
        if (frame.id < 0x700) {
            from.sent.push_back(frame.id);
        }
        for (auto& to : flyers) {
            if (&to != &from && to.alive && to.connected && from.connected) {
                to.master.handle(frame, now);
            }
        }
    }
    void run(Time time) {
        for (const Time end = now + time; now < end; now += millisecond) {
            for (auto& f : flyers) {
                if (!f.alive) continue;
                f.master.poll(now);
                for (Frame frame; f.out.pop(frame);) {
                    say(f, frame);
                }
                if (f.master.active() && now % (20 * millisecond) == 0) {
                    say(f, make_frame(0x700U + f.setup.id, 1));
                }
            }
        }
    }
    int active() const {
        int count = 0;
        for (const auto& f : flyers) {
            count += f.alive && f.master.active() ? 1 : 0;
        }
        return count;
    }
    std::deque<Flyer> flyers;
    Time now = second;
};

TEST_F(Wire, One_alone_leads_when_its_slot_has_come) {
    auto& a = add(10, 1);
    start();
    run(a.setup.delay + a.setup.timeout + a.master.slot_delay() - 2 * millisecond);
    EXPECT_EQ(a.master.state(), State::negotiating);
    run(5 * millisecond);
    EXPECT_EQ(a.master.state(), State::active);
    EXPECT_EQ(a.sent, (std::vector<std::uint32_t>{0x73, 0x72, 0x71}));
}

TEST_F(Wire, Priority_counts_before_the_node_id) {
    add(1, 2);
    add(5, 1);
    add(90, 0);
    start();
    run(2 * second);
    EXPECT_EQ(active(), 1);
    for (auto& f : flyers) {
        EXPECT_EQ(f.master.master(), 90);
    }
}

TEST_F(Wire, Of_one_priority_the_lower_node_id_leads) {
    add(20, 1);
    add(7, 1);
    add(30, 1);
    start();
    run(2 * second);
    EXPECT_EQ(active(), 1);
    for (auto& f : flyers) {
        EXPECT_EQ(f.master.master(), 7);
    }
}

TEST_F(Wire, The_next_one_takes_over_within_the_time_that_is_said) {
    auto& a = add(5, 0);
    auto& b = add(6, 1);
    add(7, 2);
    start();
    run(2 * second);
    ASSERT_TRUE(a.master.active());
    a.alive = false;
    run(b.setup.silence + b.setup.timeout + b.master.slot_delay() + 5 * millisecond);
    EXPECT_TRUE(b.master.active());
    EXPECT_EQ(flyers[2].master.master(), 6);
    EXPECT_EQ(b.master.losses(), 1u);
}

TEST_F(Wire, A_better_priority_that_comes_later_has_it_negotiated) {
    add(6, 1);
    start();
    run(second);
    ASSERT_TRUE(flyers[0].master.active());
    auto& better = add(100, 0);
    better.master.start(now);
    run(second);
    EXPECT_TRUE(better.master.active());
    EXPECT_EQ(flyers[0].master.state(), State::passive);
    EXPECT_EQ(active(), 1);
}

TEST_F(Wire, A_lower_node_id_alone_does_not_disturb_a_master_that_leads) {
    add(6, 1);
    start();
    run(second);
    auto& late = add(5, 1);
    late.master.start(now);
    run(3 * second);
    EXPECT_EQ(late.master.state(), State::passive);
    EXPECT_EQ(late.master.master(), 6);
}

TEST_F(Wire, Two_active_masters_that_meet_negotiate) {
    add(5, 1);
    add(6, 1);
    flyers[1].connected = false;
    start();
    run(second);
    ASSERT_EQ(active(), 2);
    flyers[1].connected = true;
    run(2 * second);
    EXPECT_EQ(active(), 1);
    EXPECT_TRUE(flyers[0].master.active());
}

TEST_F(Wire, A_master_whose_heartbeat_alone_was_missed_stays) {
    add(5, 0);
    auto& b = add(6, 1);
    start();
    run(2 * second);
    ASSERT_EQ(b.master.state(), State::passive);
    flyers[0].connected = false;
    run(b.setup.silence + 2 * millisecond);
    EXPECT_EQ(b.master.state(), State::asking);
    flyers[0].connected = true;
    run(2 * second);
    EXPECT_EQ(active(), 1);
    EXPECT_TRUE(flyers[0].master.active());
}

TEST_F(Wire, It_says_that_it_could_be_the_master) {
    auto& a = add(5, 2);
    start();
    a.master.handle(make_frame(0x75, 0), now);
    Frame answer;
    ASSERT_TRUE(a.out.pop(answer));
    EXPECT_EQ(answer.id, 0x74u);
    EXPECT_EQ(answer.data[0], 2);
    EXPECT_EQ(answer.data[1], 5);
}

TEST_F(Wire, What_is_no_service_of_it_or_cut_is_left_alone) {
    auto& a = add(5, 0);
    start();
    run(second);
    ASSERT_TRUE(a.master.active());
    EXPECT_FALSE(a.master.handle(make_frame(0x70, 0), now));
    EXPECT_FALSE(a.master.handle(make_frame(0x77, 0), now));
    // the last from node 0
    for (std::uint8_t length = 0; length < 3; ++length) {
        a.master.handle(make_frame(0x71, length), now);
    }
    EXPECT_TRUE(a.master.active());
    EXPECT_FALSE(a.master.handle(Frame::request(0x76, 0), now));
    EXPECT_TRUE(a.master.active());
}

TEST_F(Wire, Is_negotiated_again_and_again_by_hostile_frames_and_leads_in_the_end) {
    add(5, 0);
    add(6, 1);
    start();
    std::uint32_t random = 1;
    for (int i = 0; i < 3000; ++i) {
        random = random * 1664525 + 1013904223;
        Frame f =
            make_frame(0x71 + (random >> 28) % 6, static_cast<std::uint8_t>(random >> 24 & 3));
        store(f.data.data(), random);
        for (auto& flyer : flyers) {
            flyer.master.handle(f, now);
        }
        run(millisecond);
    }
    run(5 * second);
    EXPECT_EQ(active(), 1);
    EXPECT_TRUE(flyers[0].master.active());
}

TEST(FlyingSetupTest, Names_what_cannot_be) {
    FlyingSetup s{.enabled = true};
    EXPECT_TRUE(problems_of(s).empty());
    s.priority_slot = 1270 * millisecond;
    ASSERT_EQ(problems_of(s).size(), 1u);
    EXPECT_NE(problems_of(s)[0].find("127 of its device slots"), std::string::npos);
    s.priority = 3;
    s.id = 0;
    EXPECT_EQ(problems_of(s).size(), 3u);
    s.enabled = false;
    EXPECT_TRUE(problems_of(s).empty());
}

}  // namespace
}  // namespace hal::canopen::test
