// SPDX-License-Identifier: MIT
// Sync, calibration, clocks, slots.
#include <gtest/gtest.h>

#include <cstdlib>

#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;

/// An empty broadcast frame.
std::vector<std::uint8_t> some_frame(int from, std::size_t length = 60, std::uint8_t content = 0) {
    std::vector<std::uint8_t> frame(length, content);
    std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
    const Address a = mac(from);
    std::copy(a.begin(), a.end(), frame.begin() + 6);
    frame[12] = 0x90;
    frame[13] = 0x23;
    return frame;
}

TEST(Clock_estimate, ignores_delayed_syncs_and_follows_a_clock_step) {
    constexpr Time way = 5'000;
    ClockEstimate clock;
    Time sent = 0;
    Time jump = 0;
    // this clock is 200 ppm fast
    const auto local = [&] { return sent + sent / 5000 + jump + way; };
    const auto error = [&] { return std::abs(clock.global(local()) - sent - way); };
    const auto sync = [&](Time late) {
        sent += ms;
        return clock.accept(sent, local() + late, way);
    };
    for (int i = 0; i < 300; ++i) {
        sync(i % 3 * 300);
    }
    for (int i = 0; i < 90; ++i) {
        EXPECT_FALSE(sync(400'000 + i)) << i;
    }
    EXPECT_LT(error(), 1'000) << "90 cycles later";
    EXPECT_TRUE(sync(300)) << "and the first that is in time counts";
    jump = 50'000;
    for (int i = 0; i < 140; ++i) {
        sync(i % 3 * 300);
    }
    EXPECT_LT(error(), 1'000) << "later for good: it is this clock that jumped";
    jump = -50'000;
    for (int i = 0; i < 40; ++i) {
        sync(i % 3 * 300);
    }
    EXPECT_LT(error(), 1'000)
        << "no sync arrives early, so a step in this direction is accepted sooner";
}

TEST(Master, sends_syncs_when_no_other_station_does) {
    Bed bed;
    Machine& m = bed.add(1, master());
    bed.run(3 * ms);
    EXPECT_EQ(0, m.events[Event::leading]) << "it listens for three cycles";
    bed.run(5 * ms);
    EXPECT_EQ(1, m.events[Event::leading]);
    EXPECT_TRUE(m.status().synchronous && m.status().calibrated && m.status().leading &&
                m.station.ready());
    EXPECT_GE(m.status().count.syncs_sent, 3U);
}

TEST(Station, synchronises_and_calibrates_with_clocks_that_differ_by_200_ppm) {
    for (const double skew : {-200e-6, 0.0, 200e-6}) {
        Bed bed;
        bed.wire.noise_ns = 300;
        Machine& m = bed.add(1, master());
        Machine& s = bed.add(2, slave(300'000), {skew, 77'000'000'000});
        bed.run(600 * ms);
        ASSERT_EQ(State::running, s.status().state) << skew;
        EXPECT_EQ(1, s.events[Event::calibrated]);
        EXPECT_NEAR(static_cast<double>(Wire::path), static_cast<double>(s.status().delay), 200)
            << skew;
        EXPECT_NEAR(-skew, s.status().drift, 2e-6);
        // Global time is the master's clock: both machines at the same instant.
        const Time t = bed.now;
        EXPECT_NEAR(static_cast<double>(m.station.global(m.port.clock().local(t))),
                    static_cast<double>(s.station.global(s.port.clock().local(t))), 300);
        EXPECT_LT(std::abs(s.status().error), 2'000) << "its thread is in step with the master's";
        EXPECT_EQ(100U, s.status().count.replies);
    }
}

TEST(Station, sends_in_its_slot_with_less_jitter_than_the_stamps) {
    for (const double skew : {-200e-6, 200e-6}) {
        Bed bed;
        bed.wire.noise_ns = 1'500;  // noise of kernel time stamps
        bed.add(1, master());
        Machine& s = bed.add(2, slave(300'000), {skew, 1'000'000'000});
        bed.run(800 * ms);
        ASSERT_EQ(State::running, s.status().state);
        s.in_cycle = [](Machine& machine) { machine.station.send(some_frame(2), 0, 0); };
        bed.wire.watching = true;
        bed.run(2000 * ms);
        std::vector<double> errors;
        Time sync = 0;
        for (const Wire::Frame& f : bed.wire.seen) {
            if (f.from == 1) {
                sync = f.left;
            } else if (sync != 0) {
                errors.push_back(static_cast<double>(f.left - sync - 300'000));
            }
        }
        ASSERT_GT(errors.size(), 1900U);
        const double mean =
            std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
        for (double& e : errors) {
            e -= mean;
        }
        std::sort(errors.begin(), errors.end(),
                  [](double a, double b) { return std::abs(a) < std::abs(b); });
        errors.resize(errors.size() * 99 / 100);
        const double rms =
            std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) /
                      static_cast<double>(errors.size()));
        RecordProperty("slot_jitter_rms_ns", static_cast<int>(rms));
        EXPECT_LT(rms, 1'400.0) << "1 %-trimmed rms, ns";
        EXPECT_LT(std::abs(mean), 1'000.0);
    }
}

TEST(Station, passes_a_frame_to_the_port_just_before_its_slot) {
    for (const Time cycle : {1'000'000, 5'000'000, 20'000'000}) {
        Bed bed;
        bed.add(1, master(cycle));
        StationSetup setup = slave(500'000, cycle);
        setup.phase = 400'000;
        Machine& s = bed.add(2, setup, {200e-6, 0});
        bed.run(400 * cycle);
        ASSERT_TRUE(s.station.ready()) << cycle;
        s.port.farthest = 0;
        s.in_cycle = [](Machine& machine) { machine.station.send(some_frame(2), 0, 0); };
        bed.run(100 * cycle);
        EXPECT_GT(s.status().count.sent, 95U);
        EXPECT_LT(s.port.farthest, 150'000)
            << cycle << ": a port without a pacer rejects frames that are not due within 200 us";
    }
}

TEST(Station, repeats_a_calibration_round_when_a_request_or_a_reply_is_lost) {
    for (const int lost : {0x10, 0x11}) {
        Bed bed;
        bed.add(1, master());
        Machine& s = bed.add(2, slave(300'000));
        int n = 0;
        bed.wire.fault = [&](Wire::Frame& f) {
            return f.bytes[21] != lost || f.bytes[12] != 0x90 || ++n % 5 != 0;
        };
        bed.run(1000 * ms);
        EXPECT_EQ(State::running, s.status().state);
        EXPECT_GE(s.status().count.unanswered, 20U);
        EXPECT_EQ(100U, s.status().count.replies);
    }
}

TEST(Station, reports_calibration_requests_without_a_reply) {
    Bed bed;
    bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    bed.wire.fault = [&](Wire::Frame& f) { return f.bytes[21] != 0x11; };
    bed.run(1000 * ms);
    EXPECT_EQ(State::calibrating, s.status().state);
    EXPECT_EQ(1, s.events[Event::uncalibrated]);
    EXPECT_FALSE(s.station.ready());
    bed.wire.fault = nullptr;
    bed.run(1000 * ms);
    EXPECT_TRUE(s.station.ready());
}

TEST(Station, stays_synchronous_when_the_cycle_number_wraps) {
    Bed bed;
    Machine& s = bed.add(2, slave(300'000));
    const auto sync = [&](std::uint32_t cycle, Time at) {
        const auto f = encode(mac(1), Sync{cycle, at, at});
        bed.wire.inject({f.begin(), f.end()}, 1, at);
    };
    std::uint32_t cycle = 0xffffffc0;
    for (Time at = 2 * ms; at < 200 * ms; at += ms) {
        sync(cycle++, at);
    }
    bed.run(150 * ms);
    EXPECT_EQ(0, s.events[Event::sync_lost]);
    EXPECT_TRUE(s.status().synchronous);
    EXPECT_LT(s.status().cycle, 200U);
    EXPECT_GT(s.status().cycle, 50U);
}

TEST(Station, uses_a_slot_only_in_the_cycles_of_its_phasing) {
    Bed bed;
    StationSetup setup = slave(300'000);
    setup.slots.push_back({.id = 3, .offset = 500'000, .period = 4, .phasing = 2, .size = 60});
    bed.add(1, master());
    Machine& s = bed.add(2, setup);
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    s.in_cycle = [](Machine& m) { m.station.send(some_frame(2), 3, 0); };
    bed.wire.watching = true;
    bed.run(400 * ms);
    std::uint32_t cycle = 0;
    int frames = 0;
    for (const Wire::Frame& f : bed.wire.seen) {
        if (f.from == 1 && f.bytes[13] == 0x21) {
            cycle = decode(f.bytes).sync.cycle;
        }
        if (f.from != 2) continue;
        EXPECT_EQ(2U, cycle % 4);
        ++frames;
    }
    EXPECT_NEAR(100, frames, 2);
}

TEST(Station, fills_a_slot_with_several_frames_in_order_of_priority) {
    Bed bed;
    StationSetup setup = slave(300'000);
    // 238 bytes on the line: two frames of 84, not three
    setup.slots = {{.id = 0, .offset = 300'000, .size = 200}};
    bed.add(1, master());
    Machine& s = bed.add(2, setup);
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    int turn = 0;
    s.in_cycle = [&turn](Machine& m) {
        if (turn++ != 0) return;
        m.station.send(some_frame(2, 60, 1), 0, 7);
        m.station.send(some_frame(2, 60, 2), 0, 7);
        m.station.send(some_frame(2, 60, 3), 0, 0);
        EXPECT_EQ(ethernet::Sent::rejected, m.station.send(some_frame(2, 215, 4), 0, 0))
            << "longer than the slot";
        EXPECT_EQ(ethernet::Sent::rejected, m.station.send(some_frame(2, 60, 4), 5, 0))
            << "there is no such slot";
    };
    bed.wire.watching = true;
    bed.run(10 * ms);
    std::vector<int> order;
    std::vector<Time> times;
    for (const Wire::Frame& f : bed.wire.seen) {
        if (f.from == 2) {
            order.push_back(f.bytes[20]);
            times.push_back(f.left);
        }
    }
    ASSERT_EQ((std::vector<int>{3, 1, 2}), order);
    EXPECT_NEAR(6'720, static_cast<double>(times[1] - times[0]), 5)
        << "one behind the other on the line";
    EXPECT_NEAR(ms, static_cast<double>(times[2] - times[0]), 2'000)
        << "the third in the next cycle";
}

TEST(Station, catches_up_a_few_cycles_after_a_missed_slot) {
    Bed bed;
    bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    std::vector<Time> begun;
    s.in_cycle = [&](Machine& m) {
        m.station.send(some_frame(2, 60, static_cast<std::uint8_t>(begun.size())), 0, 8);
        begun.push_back(bed.now);
    };
    bed.run(5 * ms);
    s.next += 400'000;  // its thread is delayed beyond the slot
    bed.run(4 * ms);
    bed.wire.watching = true;
    bed.run(10 * ms);
    int frames = 0;
    for (const Wire::Frame& f : bed.wire.seen) {
        if (f.from != 2) continue;
        EXPECT_NEAR(300'000, static_cast<double>(f.left - begun.at(f.bytes[20])), 5'000) << frames;
        ++frames;
    }
    EXPECT_NEAR(10, frames, 1);
    EXPECT_EQ(0U, s.station.waiting(0));
}

TEST(Station, drops_frames_without_space_or_sync) {
    Bed bed;
    StationSetup setup = slave(300'000);
    setup.queue = 4;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, setup);
    EXPECT_EQ(ethernet::Sent::down, s.station.send(some_frame(2), 0, 0));
    bed.run(600 * ms);
    int full = 0;
    s.in_cycle = [&full](Machine& machine) {
        for (int i = 0; i < 3; ++i) {
            full += machine.station.send(some_frame(2), 0, 0) == ethernet::Sent::full;
        }
    };
    bed.run(10 * ms);
    EXPECT_GT(full, 10);
    m.off = true;
    bed.run(20 * ms);
    EXPECT_EQ(0U, s.station.waiting(0))
        << "what waited for a cycle long past is not sent when the sync is back";
}

}  // namespace
}  // namespace tdma_tests
