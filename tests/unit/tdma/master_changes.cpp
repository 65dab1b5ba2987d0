// SPDX-License-Identifier: MIT
// Global time when masters change: holdover of the estimated clock by the new master.
#include <gtest/gtest.h>

#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;
constexpr double ppm = 1e-6;

struct Trio : Bed {
    Machine& first;
    Machine& second;
    Machine& station;
    explicit Trio(double noise_ns, double skew = 0.0)
        : first(add(1, master())),
          second(add(2, backup(100'000, 200'000), {skew, 5'000'000'000})),
          station(add(3, slave(600'000), {-skew, -3'000'000'000})) {
        wire.noise_ns = noise_ns;
        run(3000 * ms);
    }
    void go(bool is_there) {
        first.off = first.port.cut = !is_there;
        if (!is_there) return;
        first.station.attach(first.port);  // restarted
        first.next = first.port.clock().local(now);
    }
    /// Cycles of `wire.seen` with more than one sync.
    int doubled() const {
        std::map<std::uint32_t, int> syncs;
        for (const Wire::Frame& f : wire.seen) {
            if (const auto d = decode(f.bytes); d.kind == Kind::sync) {
                ++syncs[d.sync.cycle];
            }
        }
        return static_cast<int>(
            std::count_if(syncs.begin(), syncs.end(), [](const auto& s) { return s.second > 1; }));
    }
};

class Twenty_changes_of_master : public testing::TestWithParam<int> {};
TEST_P(Twenty_changes_of_master, keep_the_rate_of_the_crystals) {
    Trio t(GetParam());
    ASSERT_TRUE(t.first.station.ready() && t.second.station.ready() && t.station.station.ready());
    double worst = 0.0;
    int doubled = 0;
    t.wire.watching = true;
    for (int n = 0; n < 20; ++n) {
        t.wire.seen.clear();
        t.go(n % 2 != 0);
        t.run(2000 * ms);
        const bool back = n % 2 != 0;
        ASSERT_EQ(back, t.first.status().leading && !t.first.off) << n;
        ASSERT_EQ(!back, t.second.status().leading) << n;
        for (const Machine* m : {&t.first, &t.second, &t.station}) {
            if (!m->off) {
                EXPECT_LT(std::abs(m->status().drift), 5 * ppm)
                    << n << ", station " << int{m->station.address()[5]};
                worst = std::max(worst, std::abs(m->status().drift));
            }
        }
        EXPECT_LE(t.doubled(), 1) << n << ": only the cycle in which the master returns";
        doubled += t.doubled();
        EXPECT_TRUE(t.station.station.ready()) << n;
    }
    EXPECT_EQ(0, t.station.events[Event::sync_lost]);
    RecordProperty("worst_ppb", static_cast<int>(worst * 1e9));
    std::printf(
        "noise %d ns: |drift| at most %.2f ppm 2 s after a change, %d cycles with two syncs in 20 "
        "changes\n",
        GetParam(), worst * 1e6, doubled);
}
INSTANTIATE_TEST_SUITE_P(noise, Twenty_changes_of_master, testing::Values(0, 300, 2'000, 20'000));

TEST(Backup_as_master, starts_at_the_masters_rate_and_approaches_its_own) {
    Trio t(2'000, 40 * ppm);
    ASSERT_TRUE(t.second.station.ready());
    EXPECT_NEAR(-40, t.second.status().drift / ppm, 3);
    t.go(false);
    t.run(10 * ms);
    ASSERT_TRUE(t.second.status().leading);
    EXPECT_NEAR(-40, t.second.status().drift / ppm, 3) << "no step";
    t.run(1000 * ms);
    EXPECT_NEAR(-20, t.second.status().drift / ppm, 4) << "20 ppm a second";
    t.run(2000 * ms);
    EXPECT_EQ(0.0, t.second.status().drift) << "its own crystal";
    EXPECT_EQ(0, t.station.events[Event::sync_lost]);
    EXPECT_LT(std::abs(t.station.status().error), 5'000);
    // 80 ppm lie between the stations' crystals now.
    t.run(3000 * ms);
    EXPECT_NEAR(80, t.station.status().drift / ppm, 3);
}

TEST(Clock_estimate, holds_over_within_a_microsecond_for_a_tenth_of_a_second) {
    constexpr Time way = 5'000;
    std::mt19937_64 random{7};
    std::normal_distribution<double> noise(0.0, 2'000.0);
    double worst = 0.0;
    for (int run = 0; run < 50; ++run) {
        ClockEstimate clock;
        Time sent = 0;
        const auto local = [&] { return sent + sent / 20'000 + way; };  // 50 ppm fast
        for (int n = 0; n < 3000; ++n) {
            sent += ms;
            clock.accept(sent, local() + std::llround(noise(random)), way);
        }
        clock.lead(local());
        const Time begin = clock.global(local()) - sent - way;
        for (int n = 0; n < 100; ++n) {
            sent += ms;
            clock.decay(local());
        }
        worst = std::max(worst,
                         std::abs(static_cast<double>(clock.global(local()) - sent - way - begin)));
    }
    EXPECT_LT(worst, 1'000.0 + 0.5 * 20e-6 * 0.1 * 1e8);
    std::printf("holdover, 2 us noise: at most %.0f ns in 100 ms\n", worst);
}

TEST(Clock_estimate, leads_at_its_own_crystal_when_the_slope_is_not_known_yet) {
    std::mt19937_64 random{3};
    std::normal_distribution<double> noise(0.0, 20'000.0);
    ClockEstimate clock;
    Time sent = 0;
    for (int n = 0; n < 60; ++n) {
        sent += ms;
        clock.accept(sent, sent + 5'000 + std::llround(noise(random)), 5'000);
    }
    EXPECT_GT(clock.uncertainty(), 2 * ppm);
    clock.lead(sent);
    EXPECT_EQ(0.0, clock.drift());
}

/// Syncs of an unknown master in its own schedule, one every cycle.
void strange_syncs(Bed& bed, int from, int count) {
    for (int n = 0; n < count; ++n) {
        const Time at = bed.now + n * ms + 333'000;
        const auto f = encode(
            mac(from), Sync{static_cast<std::uint32_t>(4000 + n), at + 77 * ms, at + 77 * ms});
        bed.wire.inject({f.begin(), f.end()}, from, at);
    }
}

TEST(Master_with_followers, does_not_yield_to_a_smaller_address) {
    Bed bed;
    Machine& m = bed.add(5, master());
    Machine& s = bed.add(6, slave(300'000));
    bed.run(600 * ms);
    ASSERT_TRUE(m.status().leading && s.station.ready());
    strange_syncs(bed, 1, 999);
    bed.run(1100 * ms);
    EXPECT_TRUE(m.status().leading);
    EXPECT_TRUE(m.station.ready() && s.station.ready());
    EXPECT_EQ(0, m.events[Event::withdrew]);
    EXPECT_EQ(mac(1), m.last_who[Event::other_master]) << "the intruder is named";
    EXPECT_EQ(mac(1), s.last_who[Event::other_master]);
    EXPECT_EQ(0, s.events[Event::sync_lost]);
    EXPECT_EQ(0, m.events[Event::other_master_gone]);
    bed.run(1500 * ms);
    EXPECT_EQ(1, m.events[Event::other_master_gone]);
}

/// Sends `count` syncs from a strange address beside those of the master: the same numbers and
/// times, 20 us later on the wire.
void parallel_syncs(Bed& bed, const Machine& m, int from, int count) {
    for (int n = 1; n <= count; ++n) {
        const std::uint32_t cycle = m.status().cycle + static_cast<std::uint32_t>(n) + 1;
        const Time begins = m.station.cycle_start(cycle);
        const Time scheduled = m.station.global(begins);
        const auto f = encode(mac(from), Sync{cycle, scheduled, scheduled});
        bed.wire.inject({f.begin(), f.end()}, from, m.port.clock().real(begins) + 20'000);
    }
}

TEST(Station, stays_with_its_master_when_another_one_sends_syncs_of_the_same_times) {
    Bed bed;
    Machine& m = bed.add(5, master());
    Machine& s = bed.add(6, slave(300'000));
    bed.run(600 * ms);
    ASSERT_TRUE(m.status().leading && s.station.ready());
    int lost = 0;
    bed.wire.fault = [&](Wire::Frame& f) {  // one of fifty syncs of the master
        return f.from != 5 || decode(f.bytes).kind != Kind::sync || ++lost % 50 != 0;
    };
    parallel_syncs(bed, m, 1, 900);
    bed.run(1000 * ms);
    EXPECT_EQ(1, s.events[Event::other_master]);
    EXPECT_EQ(mac(1), s.last_who[Event::other_master]);
    EXPECT_EQ(mac(5), s.status().master);
    EXPECT_EQ(0, s.events[Event::master_changed]);
    EXPECT_EQ(0, s.events[Event::sync_lost]);
    EXPECT_TRUE(s.station.hears_second_master());
    bed.run(1500 * ms);
    EXPECT_EQ(1, s.events[Event::other_master_gone]);
    EXPECT_FALSE(s.station.hears_second_master());
}

TEST(Station, follows_the_second_master_when_its_own_is_lost) {
    Bed bed;
    Machine& m = bed.add(5, master());
    Machine& s = bed.add(6, slave(300'000));
    bed.run(600 * ms);
    ASSERT_TRUE(m.status().leading && s.station.ready());
    parallel_syncs(bed, m, 1, 900);
    bed.run(100 * ms);
    m.off = m.port.cut = true;
    bed.run(100 * ms);
    EXPECT_EQ(1, s.events[Event::sync_lost]);
    EXPECT_EQ(mac(5), s.last_who[Event::sync_lost]);
    EXPECT_EQ(mac(1), s.status().master);
}

TEST(Master_that_stepped_down, takes_over_when_the_other_is_lost) {
    Bed bed;
    Machine& m = bed.add(5, master());
    bed.run(100 * ms);
    ASSERT_TRUE(m.status().leading);
    strange_syncs(bed, 1, 999);
    bed.run(900 * ms);
    EXPECT_EQ(State::withdrawn, m.status().state)
        << "nobody follows it: the smaller address has it";
    bed.run(500 * ms);
    EXPECT_EQ(State::withdrawn, m.status().state);
    bed.run(1000 * ms);
    EXPECT_TRUE(m.status().leading) << "without a person";
    EXPECT_EQ(2, m.events[Event::leading]);
}

TEST(Master_that_found_another, takes_over_when_that_one_is_lost) {
    Bed bed;
    Machine& a = bed.add(1, master());
    bed.run(50 * ms);
    Machine& b = bed.add(2, master());
    b.next = b.port.clock().local(bed.now);
    bed.run(500 * ms);
    EXPECT_EQ(State::withdrawn, b.status().state);
    a.off = a.port.cut = true;
    bed.run(1500 * ms);
    EXPECT_TRUE(b.status().leading);
}

TEST(Station_with_a_list_of_masters, ignores_and_reports_syncs_of_others) {
    Bed bed;
    StationSetup lead = master();
    StationSetup follow = slave(300'000);
    lead.masters = follow.masters = {mac(5)};
    Machine& m = bed.add(5, lead);
    Machine& s = bed.add(6, follow);
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    // In the schedule, as a master that takes over would send them.
    for (int n = 0; n < 50; ++n) {
        const std::uint32_t cycle = m.status().cycle + 2 + static_cast<std::uint32_t>(n);
        const Time at = m.station.cycle_start(cycle);
        const auto f = encode(mac(1), Sync{cycle, at + 60'000, at});
        bed.wire.inject({f.begin(), f.end()}, 1, m.port.clock().real(at) + 500'000);
    }
    bed.run(100 * ms);
    EXPECT_EQ(mac(5), s.status().master);
    EXPECT_EQ(1, s.events[Event::unknown_master]);
    EXPECT_EQ(mac(1), s.last_who[Event::unknown_master]);
    EXPECT_EQ(0, s.events[Event::master_changed]);
}

}  // namespace
}  // namespace tdma_tests
