// SPDX-License-Identifier: MIT
#include "tests/unit/ethercat/master_world.hpp"

#include <random>

namespace {

using namespace master_world;

struct EthercatFaults : testing::Test {
    World w;
    void start(unsigned count, bool ring = false) {
        for (unsigned n = 0; n < count; ++n) {
            w.add(0x100 + n);
        }
        if (ring) {
            w.line.close_ring(count - 1, 1);
        }
        w.begin(drives(count), ring);
        ASSERT_TRUE(w.operational()) << w.log.text();
        for (std::size_t n = 0; n < count; ++n) {
            w.master->data(n, 0)[0] = static_cast<std::uint8_t>(n + 1);
        }
        w.run(4);
    }
};

TEST_F(EthercatFaults, A_power_cycled_slave_at_the_end_comes_back_while_the_others_stay_in_op) {
    start(3);
    w.line.set_power(2, false, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::slave_lost) == 1; }, 100)) << w.log.text();
    EXPECT_EQ(w.log.last(Event::slave_lost)->slave, 2U);
    EXPECT_EQ(w.log.count(Event::wkc_incomplete), 1U);
    w.run(20);
    EXPECT_EQ(w.master->domain(0).state, WkcState::complete) << "of those that are left";
    EXPECT_EQ(w.master->slave_status(0).state, State::op);
    w.line.set_power(2, true, w.now_ns);
    const auto cycles = w.cycles;
    ASSERT_TRUE(w.operational()) << w.log.text();
    EXPECT_LT(w.cycles - cycles, 500U);
    w.run(4);
    EXPECT_EQ(w.master->data(2, 1)[0], 4);
    EXPECT_EQ(w.log.count(Event::slave_lost), 1U) << w.log.text();
    EXPECT_EQ(w.log.count(Event::fell_back), 0U);
}

TEST_F(EthercatFaults, A_power_cycled_slave_in_the_middle_takes_those_behind_along) {
    start(4);
    w.line.set_power(1, false, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::slave_lost) == 3; }, 200)) << w.log.text();
    w.run(50);
    EXPECT_EQ(w.master->slave_status(0).state, State::op);
    w.line.set_power(1, true, w.now_ns);
    ASSERT_TRUE(w.operational()) << w.log.text();
    w.run(4);
    for (std::size_t n = 0; n < 4; ++n) {
        EXPECT_EQ(w.master->data(n, 1)[0], n + 2) << n;
    }
}

TEST_F(EthercatFaults, An_unplugged_slave_with_power_comes_back) {
    start(3);
    w.line.set_cable(2, 0, false);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::slave_lost) == 1; }, 200)) << w.log.text();
    w.run(200);
    w.line.set_cable(2, 0, true);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::slave_returned) == 1; }, 500))
        << w.log.text();
    ASSERT_TRUE(w.operational()) << w.log.text();
}

TEST_F(EthercatFaults, A_slave_that_falls_back_is_reported_with_its_code_and_brought_up_again) {
    start(2);
    w.line.controller(1).set_al_status(0x14, 0x1b);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::fell_back) == 1; }, 100)) << w.log.text();
    EXPECT_EQ(w.log.last(Event::fell_back)->slave, 1U);
    EXPECT_EQ(w.log.last(Event::fell_back)->second, 0x1b);
    EXPECT_TRUE(w.until([&] { return w.log.count(Event::slave_operational) == 3; }))
        << w.log.text();
}

TEST_F(EthercatFaults, Lost_and_doubled_frames_are_counted_and_stop_nothing) {
    start(3);
    w.primary.lose_every = 7;
    w.run(70);
    EXPECT_GT(w.master->status().lost, 5U);
    w.primary.lose_every = 0;
    w.primary.double_every = 3;
    w.run(60);
    EXPECT_GT(w.master->status().duplicates, 10U);
    w.primary.double_every = 0;
    w.run(50);
    EXPECT_TRUE(w.master->status().operational);
    EXPECT_EQ(w.log.count(Event::slave_lost), 0U) << w.log.text();
    EXPECT_EQ(w.master->data(2, 1)[0], 4);
}

TEST_F(EthercatFaults, A_slave_in_OP_that_takes_no_part_in_the_process_data_is_not_operational) {
    start(2);
    const auto set_fmmus = [&](std::uint8_t active) {
        for (const std::uint16_t fmmu : {std::uint16_t{0x60c}, std::uint16_t{0x61c}}) {
            std::array<std::uint8_t, max_frame_bytes> bytes{};
            FrameWriter frame(bytes, {2, 0, 0, 0, 0, 9});
            put(frame.add(Command::fpwr, 0, at_station(0x1002, fmmu), 1), active);
            std::vector<std::uint8_t> sent(frame.finish().size());
            std::copy_n(bytes.begin(), sent.size(), sent.begin());
            w.line.process(sent, esc::End::primary, w.now_ns);
        }
    };
    set_fmmus(0);
    w.run(25);
    EXPECT_TRUE(w.master->status().operational) << "a few cycles are tolerated";
    w.run(15);
    EXPECT_FALSE(w.master->status().operational);
    EXPECT_EQ(w.master->slave_status(1).state, State::op);
    EXPECT_FALSE(w.master->slave_status(1).operational);
    EXPECT_FALSE(w.master->slave_status(0).operational) << "the counter is that of both";
    ASSERT_EQ(w.log.count(Event::data_stale), 2U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::data_stale)->first, static_cast<int>(Staleness::counter));
    set_fmmus(1);
    w.run(40);
    EXPECT_TRUE(w.master->status().operational);
    EXPECT_TRUE(w.master->slave_status(1).operational);
    EXPECT_EQ(w.log.count(Event::data_fresh), 2U) << w.log.text();
}

TEST_F(EthercatFaults, Comes_up_although_every_fifth_frame_is_lost) {
    for (unsigned n = 0; n < 5; ++n) {
        w.add(0x100 + n);
    }
    w.primary.lose_every = 5;
    w.begin(drives(5));
    EXPECT_TRUE(w.operational(20000)) << w.log.text();
}

TEST_F(EthercatFaults, A_ring_works_closed_broken_and_closed_again) {
    start(4, true);
    w.run(20);
    EXPECT_FALSE(w.master->status().ring_broken) << w.log.text();
    const auto incomplete = w.master->domain(0).incomplete;
    w.line.set_cable(2, 0, false);
    for (unsigned n = 0; n < 100; ++n) {
        w.master->data(3, 0)[0] = w.master->data(0, 0)[0] = static_cast<std::uint8_t>(n);
        w.cycle();
        if (n < 4) continue;
        EXPECT_EQ(w.master->data(3, 1)[0], static_cast<std::uint8_t>(n - 1)) << "behind the break";
        EXPECT_EQ(w.master->data(0, 1)[0], static_cast<std::uint8_t>(n - 1));
    }
    EXPECT_EQ(w.master->domain(0).incomplete, incomplete) << "no cycle without data";
    EXPECT_TRUE(w.master->status().ring_broken);
    EXPECT_EQ(w.master->status().break_after, 1);
    ASSERT_EQ(w.log.count(Event::ring_broken), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::ring_broken)->slave, 1U);
    EXPECT_EQ(w.log.count(Event::slave_lost), 0U) << w.log.text();
    w.line.set_cable(2, 0, true);
    w.run(100);
    EXPECT_FALSE(w.master->status().ring_broken);
    EXPECT_TRUE(w.master->status().operational);
    EXPECT_EQ(w.log.count(Event::ring_closed), 1U);
}

TEST(EthercatSoak, Always_in_op_again_after_power_cables_and_frames_failed_at_random) {
    for (const unsigned seed : {1U, 2U, 3U, 4U}) {
        for (const bool ring : {false, true}) {
            World w;
            for (unsigned n = 0; n < 6; ++n) {
                w.add(0x100 + n, 0, false, {.drift_ppm = 10.0 * n});
            }
            if (ring) {
                w.line.close_ring(5, 1);
            }
            auto setup = drives(6);
            for (auto& s : setup.slaves) {
                s.dc = Dc{.assign_activate = 0x0300};
            }
            w.begin(setup, ring);
            std::mt19937 generator(seed);
            const auto random = [&] { return static_cast<unsigned>(generator()); };
            for (unsigned step = 0; step < 60; ++step) {
                const std::size_t slave = random() % 6;
                switch (random() % 5) {
                case 0: w.line.set_power(slave, false, w.now_ns); break;
                case 1: w.line.set_power(slave, true, w.now_ns); break;
                case 2: w.line.set_cable(slave, 0, random() % 2 == 0); break;
                case 3: w.primary.lose_every = random() % 3 == 0 ? 2 + random() % 9 : 0; break;
                default: w.primary.double_every = random() % 3 == 0 ? 2 + random() % 9 : 0; break;
                }
                w.run(random() % 150);
            }
            w.primary.lose_every = w.primary.double_every = 0;
            for (std::size_t n = 0; n < 6; ++n) {
                w.line.set_cable(n, 0, true);
                if (!w.line.controller(n).powered()) {
                    w.line.set_power(n, true, w.now_ns);
                }
            }
            w.run(300);  // a change of the last step is noticed
            ASSERT_TRUE(w.operational(30000))
                << "seed " << seed << (ring ? " ring " : " line ")
                << w.log.text().substr(w.log.text().size() -
                                       std::min<std::size_t>(2000, w.log.text().size()));
            for (std::size_t n = 0; n < 6; ++n) {
                w.master->data(n, 0)[0] = static_cast<std::uint8_t>(n + 50);
            }
            w.run(4);
            for (std::size_t n = 0; n < 6; ++n) {
                EXPECT_EQ(w.master->data(n, 1)[0], n + 51) << n;
            }
        }
    }
}

TEST_F(EthercatFaults, An_optional_slave_may_be_missing_and_join_later) {
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n);
    }
    auto setup = drives(3);
    setup.slaves[2].optional = true;
    w.begin(setup);
    w.line.set_power(2, false, 0);
    ASSERT_TRUE(w.operational()) << w.log.text();
    EXPECT_EQ(w.log.count(Event::slave_missing), 0U);
    w.line.set_power(2, true, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.master->slave_status(2).operational; })) << w.log.text();
}

}  // namespace
