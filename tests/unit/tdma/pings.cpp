// SPDX-License-Identifier: MIT
// Pings between stations; request and answer use their senders' slots.
#include <gtest/gtest.h>

#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;

/// The same segment as each of its stations sees it.
StationSetup with(StationSetup setup, std::vector<Other> others) {
    setup.others = std::move(others);
    return setup;
}

struct Pair {
    Bed bed;
    Machine &m, &s;
    explicit Pair(Clock clock = {}, std::size_t size = 46)
        : m(bed.add(
              1, with(sized(master(), size), {{mac(2), Role::slave, {slave(300'000).slots[0]}}}))),
          s(bed.add(
              2, with(sized(slave(300'000), size), {{mac(1), Role::master, {master().slots[0]}}}),
              clock)) {
        bed.run(600 * ms);
    }
    static StationSetup sized(StationSetup setup, std::size_t size) {
        setup.slots[0].size = static_cast<std::uint32_t>(size);
        return setup;
    }
};

TEST(Ping, is_answered_in_the_next_slot_and_gives_the_path_delay) {
    for (const double skew : {-200e-6, 0.0, 200e-6}) {
        Pair p({skew, 77'000'000'000});
        ASSERT_TRUE(p.m.station.ready() && p.s.station.ready());
        p.bed.wire.watching = true;
        p.m.station.ping(0, 7);
        p.bed.run(10 * ms);
        const Pings::Asked& asked = p.m.station.pings()[0];
        ASSERT_EQ(Outcome::answered, asked.outcome);
        EXPECT_EQ(7U, asked.done);
        EXPECT_NEAR(static_cast<double>(2 * Wire::path),
                    static_cast<double>(asked.round_trip - asked.held), 1'000)
            << skew;
        EXPECT_LE(asked.round_trip, 3 * ms);
        int pings = 0;
        int echoes = 0;
        for (const Wire::Frame& f : p.bed.wire.seen) {
            const Decoded d = decode(f.bytes);
            pings += d.kind == Kind::ping;
            echoes += d.kind == Kind::echo;
            if (d.kind == Kind::echo) {
                EXPECT_NEAR(
                    300'000.0,
                    static_cast<double>(
                        p.m.station.global(p.m.port.clock().local(f.left)) % ms -
                        p.m.station.global(p.m.station.cycle_start(p.m.status().cycle)) % ms),
                    2'000);
            }
        }
        EXPECT_EQ(1, pings);
        EXPECT_EQ(1, echoes);
        EXPECT_EQ(0U, p.m.station.roster()[0].late) << "in its slot";
        EXPECT_EQ(0U, p.m.status().count.intruders + p.s.status().count.intruders);
    }
}

TEST(Ping, goes_from_a_slave_too_and_gives_the_drift_of_the_other_clock) {
    Pair p({200e-6, 5'000'000});
    for (std::uint32_t n = 1; n <= 3; ++n) {
        p.s.station.ping(0, n);
        p.bed.run(200 * ms);
        ASSERT_EQ(Outcome::answered, p.s.station.pings()[0].outcome);
    }
    EXPECT_NEAR(0.0, p.s.station.roster()[0].drift, 3e-6) << "the master's clock is the segment's";
    for (std::uint32_t n = 1; n <= 3; ++n) {
        p.m.station.ping(0, n);
        p.bed.run(200 * ms);
    }
    EXPECT_NEAR(200e-6, p.m.station.roster()[0].drift, 3e-6);
}

TEST(Ping, without_an_answer_times_out_after_a_second) {
    Pair p;
    p.bed.wire.fault = [](Wire::Frame& f) { return decode(f.bytes).kind != Kind::echo; };
    p.m.station.ping(0, 3);
    p.bed.run(900 * ms);
    EXPECT_EQ(Outcome::none, p.m.station.pings()[0].outcome);
    p.bed.run(200 * ms);
    EXPECT_EQ(Outcome::unanswered, p.m.station.pings()[0].outcome);
    EXPECT_EQ(3U, p.m.station.pings()[0].done);
    p.bed.wire.fault = {};
    p.m.station.ping(0, 4);
    p.bed.run(10 * ms);
    EXPECT_EQ(Outcome::answered, p.m.station.pings()[0].outcome);
}

TEST(Ping, uses_only_time_that_frames_leave) {
    Pair p;
    bool full = true;
    p.m.in_cycle = [&](Machine& m) {
        if (!full) return;
        std::vector<std::uint8_t> frame(60, 0);
        std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
        std::copy(m.port.address().begin(), m.port.address().end(), frame.begin() + 6);
        frame[12] = 0x90;
        frame[13] = 0x23;
        EXPECT_EQ(ethernet::Sent::queued, m.station.send(frame, 0, 5))
            << "its room is not taken by a ping";
    };
    p.bed.run(5 * ms);
    p.m.station.ping(0, 1);
    p.bed.run(1'100 * ms);
    EXPECT_EQ(Outcome::no_room, p.m.station.pings()[0].outcome);
    full = false;
    p.m.station.ping(0, 2);
    p.bed.run(10 * ms);
    EXPECT_EQ(Outcome::answered, p.m.station.pings()[0].outcome);
}

TEST(Ping, of_a_station_without_a_known_address_is_not_sent) {
    Bed bed;
    Machine& m = bed.add(1, with(master(), {{{}, Role::slave, {slave(300'000).slots[0]}}}));
    bed.run(100 * ms);
    m.station.ping(0, 1);
    bed.run(5 * ms);
    EXPECT_EQ(Outcome::no_address, m.station.pings()[0].outcome);
}

TEST(Ping, ignores_forged_answers) {
    Pair p;
    p.bed.wire.fault = [](Wire::Frame& f) { return decode(f.bytes).kind != Kind::echo; };
    p.m.station.ping(0, 9);
    p.bed.run(5 * ms);
    const auto send = [&](const Echo& e, int from) {
        const auto frame = encode(mac(1), mac(from), e);
        p.bed.wire.fault = {};
        p.bed.wire.inject({frame.begin(), frame.end()}, from, p.bed.now + 400'000);
        p.bed.run(3 * ms);
    };
    const Time now = p.m.port.clock().local(p.bed.now);

    const Time foreign = static_cast<Time>(p.m.status().count.foreign);
    send({now - 3 * ms, 10, 20, 8}, 2);                  // of another ping
    send({now - 3 * ms, 10, 20, 9}, 3);                  // of another station
    send({now + 3000 * ms, 10, 20, 9}, 2);               // of the future
    send({now - 500 * ms, 10, 20, 9}, 2);                // before it was sent
    send({now, 20, 10, 9}, 2);                           // sent before it was received
    send({now, INT64_MIN, INT64_MAX, 9}, 2);
    EXPECT_EQ(Outcome::none, p.m.station.pings()[0].outcome);
    EXPECT_EQ(foreign + 6, static_cast<Time>(p.m.status().count.foreign));
}

TEST(Ping, is_answered_once_per_sender) {
    Pair p;
    p.bed.wire.watching = true;
    for (int n = 0; n < 500; ++n) {
        const auto frame = encode(mac(2), mac(40 + n % 30), Ping{1, static_cast<std::uint32_t>(n)});
        p.bed.wire.inject({frame.begin(), frame.end()}, 40, p.bed.now + 400'000 + n);
    }
    p.bed.run(100 * ms);
    int echoes = 0;
    for (const Wire::Frame& f : p.bed.wire.seen) {
        echoes += decode(f.bytes).kind == Kind::echo;
    }
    EXPECT_EQ(16, echoes);
}

}  // namespace
}  // namespace tdma_tests
