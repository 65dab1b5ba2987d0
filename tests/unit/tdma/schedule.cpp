// SPDX-License-Identifier: MIT
// Schedules: parsing, checks, timing.
#include <gtest/gtest.h>

#include "components/fieldbus/tdma/config/schedule_plan.hpp"

namespace {

using namespace hal::tdma;

constexpr const char* rtnet = R"(# as RTnet's documentation has them
master:
ip 10.0.0.1
cycle 5000
slot 0 0
slot 1 1000

backup-master:
ip 10.0.0.2
backup-offset 200
slot 0 400

slave:
ip 10.0.0.3
mac 00:AA:BB:CC:DD:EE
slot 0 2000
slot 1 2200 1/2
slot 3 2200 2/2 100
stage2 /etc/station.conf
)";

std::string said(const config::ReadResult& r) { return config::to_string(r, "f"); }

TEST(Schedule_of_rtnet, is_read) {
    const auto r = config::read(rtnet);
    ASSERT_TRUE(r.good()) << said(r);
    EXPECT_EQ(5'000'000, r.schedule.cycle);
    ASSERT_EQ(3U, r.schedule.stations.size());
    const auto& s = r.schedule.stations[2];
    EXPECT_EQ("slave-1", s.name);
    EXPECT_EQ("/etc/station.conf", s.stage_2);
    ASSERT_EQ(3U, s.slots.size());
    EXPECT_EQ(2U, s.slots[1].setup.period);
    EXPECT_EQ(0U, s.slots[1].setup.phasing);
    EXPECT_EQ(1U, s.slots[2].setup.phasing);
    EXPECT_EQ(1500U, s.slots[1].setup.size) << "as long as a frame can be";
    EXPECT_EQ(100U, s.slots[2].setup.size);
    EXPECT_EQ(1U, *config::find(r.schedule, "10.0.0.2"));
    EXPECT_EQ(2U, *config::find(r.schedule, "00:aa:bb:cc:dd:ee"));
    EXPECT_FALSE(config::find(r.schedule, "10.0.0.9"));
    EXPECT_EQ(Role::backup, config::setup_of(r.schedule, 1).role);
}

TEST(Schedule, gives_a_slot_without_a_size_what_fits_before_the_next) {
    const auto r = config::read("cycle 100\nmaster:\nslot 0 20\nslave:\nslot 0 50\n");
    ASSERT_TRUE(r.good()) << said(r);
    // (50 - 20 - 10 us) * 12.5 bytes/us = 250 on the wire, less 24 of preamble, check sequence and
    // gap, less 14 of the header.
    EXPECT_EQ(212U, r.schedule.stations[0].slots[0].setup.size);
    EXPECT_EQ(462U, r.schedule.stations[1].slots[0].setup.size);
}

TEST(Schedule_block, is_read_again_as_it_was) {
    const auto r = config::read(rtnet);
    for (std::size_t i = 0; i < r.schedule.stations.size(); ++i) {
        const auto back = config::read(config::block_of(r.schedule, i));
        ASSERT_TRUE(back.good()) << said(back) << config::block_of(r.schedule, i);
        const auto a = config::setup_of(r.schedule, i);
        const auto b = config::setup_of(back.schedule, 0);
        ASSERT_EQ(a.slots.size(), b.slots.size());
        for (std::size_t k = 0; k < a.slots.size(); ++k) {
            EXPECT_EQ(a.slots[k].offset, b.slots[k].offset);
            EXPECT_EQ(a.slots[k].size, b.slots[k].size);
            EXPECT_EQ(a.slots[k].phasing, b.slots[k].phasing);
        }
        EXPECT_EQ(a.role, b.role);
        EXPECT_EQ(a.backup_offset, b.backup_offset);
    }
}

TEST(Schedule_that_cannot_work, is_refused_with_the_arithmetic) {
    const auto refusal = [](const char* text) { return said(config::read(text)); };
    EXPECT_EQ(
        "f:5:1: error: slot 0 of slave-1 begins at 35 us, before the end of slot 0 of master: 60 "
        "bytes take 6.72 us at 100 Mbit/s: "
        "30 us + 6.72 us + guard 10 us = 46.72 us; its earliest offset is 46.72 us",
        refusal("cycle 100\nmaster:\nslot 0 30 1/1 46\nslave:\nslot 0 35 1/1 46\n"));
    EXPECT_NE(std::string::npos,
              refusal("cycle 100\nmaster:\nslot 0 90 1/1 200\n")
                  .find("extends into the next cycle: 90 us + 214 bytes take 19.04 us"));
    EXPECT_NE(std::string::npos,
              refusal("cycle 1000\nmaster:\nbackup-master:\nbackup-offset 20\nslot 0 300\n")
                  .find("the smallest backup-offset that works is 50.88 us"));
    EXPECT_NE(std::string::npos, refusal("cycle 1000\nmaster:\nbackup-master:\nbackup-offset 200\n")
                                     .find("has no slot for the calibration"));
    EXPECT_NE(std::string::npos, refusal("cycle 1000\nmaster:\nslot 1 100 1/1 60\n")
                                     .find("60 bytes are too few: IP needs 68"));
    EXPECT_NE(std::string::npos, refusal("cycle 1000\nmaster:\nphase 600\nlead 400\n")
                                     .find("phase + lead must be less than the cycle"));
    EXPECT_EQ("", refusal("cycle 100\nmaster:\nslot 0 30 1/2\nslave:\nslot 0 30 2/2\n"))
        << "never in the same cycle";
}

TEST(Plan, adds_up_load_and_latency) {
    const auto r = config::read(
        "cycle 1000\nmaster:\nslot 0 100 1/1 46\nslave:\nname x\nslot 0 200 1/1 46\nslave:\nname "
        "y\nphase 150\nslot 0 300 1/2 46\n");
    ASSERT_TRUE(r.good()) << said(r);
    const auto p = plan::plan_of(r.schedule);
    EXPECT_NEAR(3.5 * 6.72e-3, p.load, 1e-9) << "sync, two slots, and one of every second cycle";
    ASSERT_EQ(2U, p.trips.size());
    EXPECT_EQ(0, p.trips[0].read);
    EXPECT_EQ(200'000, p.trips[0].up);
    EXPECT_EQ(1'000'000, p.trips[0].master);
    EXPECT_EQ(1'100'000, p.trips[0].down);
    EXPECT_EQ(2'000'000, p.trips[0].output);
    EXPECT_EQ(2U, p.trips[0].cycles);
    EXPECT_EQ(3'000'000, p.trips[0].worst);
    EXPECT_EQ(1'300'000, p.trips[1].up) << "its slot may just have been missed";
    EXPECT_EQ(2'150'000, p.trips[1].output);
}

TEST(Plan, goes_by_way_of_the_backup_when_the_master_keeps_the_time_alone) {
    const auto r = config::read(
        "cycle 1000\nmaster:\nbackup-master:\nphase 80\nbackup-offset 140\nslot 0 220 1/1 46\n"
        "slave:\nname x\nphase 300\nslot 0 420 1/1 46\n");
    ASSERT_TRUE(r.good()) << said(r);
    const auto p = plan::plan_of(r.schedule);
    EXPECT_EQ(1U, p.by_way_of);
    ASSERT_EQ(1U, p.trips.size());
    EXPECT_EQ(2U, p.trips[0].station) << "x";
    EXPECT_EQ(1'080'000, p.trips[0].master);
    EXPECT_EQ(1'220'000, p.trips[0].down);
    EXPECT_EQ(2'000'000, p.trips[0].worst);
    EXPECT_EQ(std::nullopt,
              plan::plan_of(config::read("cycle 1000\nmaster:\nslave:\nslot 0 400\n").schedule)
                  .by_way_of);
}

TEST(Ways, are_what_the_schedule_leaves) {
    const auto r = config::read(
        "cycle 1000\nmaster:\nphase 80\nslot 0 220 1/1 400\nslot 2 900 1/1 46\nslave:\nname "
        "x\nphase 300\nslot 0 420 1/1 250\n"
        "slave:\nname y\nslot 0 500 1/1 250\nslave:\nname silent\n");
    ASSERT_TRUE(r.good()) << said(r);
    const auto ways = plan::ways_of(r.schedule, 0, 0);
    ASSERT_EQ(2U, ways.size()) << "a station without a slot answers nobody";
    EXPECT_EQ(1U, ways[0].other);
    EXPECT_EQ(220'000, ways[0].there)
        << "from the thread at 80 to x's at 300, where the frame is at 292";
    EXPECT_EQ(0U, ways[0].there_cycles);
    EXPECT_EQ(1'780'000, ways[0].back) << "changed just after 300, read at 1300, here at 2080";
    EXPECT_EQ(1U, ways[0].back_cycles);
    EXPECT_EQ(2U, ways[0].round_trip);
    EXPECT_EQ(920'000, ways[1].there)
        << "y's thread begins before the frame comes: in the next cycle";
    EXPECT_EQ(3U, ways[1].round_trip);
    EXPECT_EQ(1'220'000, plan::ways_of(r.schedule, 0, 1)[0].there) << "by the later slot";
}

}  // namespace
