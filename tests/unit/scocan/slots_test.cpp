// SPDX-License-Identifier: MIT
// Slots: private ones to the nanosecond, shared and recycled ones within their bounds.
#include <cmath>
#include <random>

#include "bus.hpp"

namespace {

using namespace hal::scocan;
using namespace hal::scocan::test;
using hal::can::Frame;

TEST(Node, sends_at_the_begin_of_its_private_slot) {
    Bus bus;
    Member& clock = bus.add("clock");
    Member& motor = bus.add("motor");
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {1, 2, 3}}, true); });
    EXPECT_TRUE(clock.station.leading());
    EXPECT_EQ(State::running, motor.station.state());
    ASSERT_GT(motor.sent.size(), 10U);
    Time sync = 0;
    std::size_t checked = 0;
    for (const Seen& s : bus.wire) {
        if (s.frame.id == 0) {
            sync = s.begin;
        }
        if (s.frame.id != 0x10A) continue;
        EXPECT_NEAR(static_cast<double>(sync + 1000 * us), static_cast<double>(s.begin), 2.0);
        ++checked;
    }
    EXPECT_GE(checked, 10U);
    EXPECT_EQ(0U, motor.station.count().missed);
    EXPECT_EQ(0U, clock.station.count().foreign);
}

/// Steps the SYNC node every 500 us and the motor in a thread of `period`. Returns the turns of the
/// motor's slot from 200 ms on, within 1 s.
std::size_t turns_in_a_slow_thread(Bus& bus, Member& clock, Member& motor, Time period) {
    std::size_t before = 0;
    for (const Time begin = bus.now; bus.now < begin + 1200 * ms; bus.now += 500 * us) {
        clock.station.receive(bus.now);
        clock.station.transmit(bus.now, 500 * us);
        if ((bus.now - begin) % period == 0) {
            if (before == 0 && bus.now >= begin + 200 * ms) {
                before = clock.count(0x10A);
            }
            motor.station.receive(bus.now);
            motor.station.send({0x10A, {static_cast<std::uint8_t>(bus.now / period)}}, true);
            motor.station.transmit(bus.now, period);
        }
    }
    return clock.count(0x10A) - before;
}

TEST(Node_in_a_slow_thread, sends_its_newest_value_in_each_turn) {
    for (const Time period : {5 * ms, 7 * ms, 10 * ms, 20 * ms, 50 * ms}) {  // the cycle is 5 ms
        Bus bus;
        Member& clock = bus.add("clock");
        Member& motor = bus.add("motor");
        EXPECT_NEAR(200, static_cast<double>(turns_in_a_slow_thread(bus, clock, motor, period)), 11)
            << period;
        EXPECT_EQ(0U, motor.station.count().missed);
        EXPECT_EQ(0U, motor.station.count().late + clock.station.count().foreign);
        for (std::size_t i = 1; i < clock.received.size(); ++i) {
            const Time between = clock.received[i].begin - clock.received[i - 1].begin;
            if (clock.received[i].begin > clock.received.front().begin + 200 * ms) {
                EXPECT_NEAR(5e6, static_cast<double>(between), 1000) << period;
            }
            EXPECT_LE(
                (clock.received[i].frame.data[0] - clock.received[i - 1].frame.data[0] + 256) % 256,
                2)
                << "an old value";
        }
    }
}

TEST(Node_in_a_slow_thread, without_windows_counts_and_reports_the_turns_that_it_misses) {
    for (const Time period : {500 * us, 10 * ms, 20 * ms, 50 * ms}) {
        Bus bus;
        Member& clock = bus.add("clock");
        Member& motor = bus.add("motor", {.windows = false});
        const std::size_t sent = turns_in_a_slow_thread(bus, clock, motor, period);
        const auto missed = motor.station.count().missed;
        EXPECT_NEAR(235, static_cast<double>(clock.count(0x10A) + missed), 25)
            << period << ": " << sent << " sent, " << missed << " missed";
        if (period == 500 * us) {
            EXPECT_EQ(0U, missed);
            EXPECT_EQ(0U, motor.times(Event::slot_missed));
            continue;
        }
        EXPECT_EQ(missed, motor.times(Event::slot_missed));
        ASSERT_GT(missed, 100U);
        for (const test::EventRecord& h : motor.events) {
            if (h.event == Event::slot_missed) {
                EXPECT_TRUE(h.id == 0x10A && h.value == period);
            }
        }
    }
}

/// Random messages of shared slots, so that the bus is always full.
struct Load {
    explicit Load(Member& sender, std::uint32_t identifier) : node(sender), id(identifier) {}
    void operator()() {
        while (node.station.state() == State::running && node.station.waiting() < 8) {
            node.station.send(
                {id, std::array<std::uint8_t, 8>{0x55, 0xaa, static_cast<std::uint8_t>(++number),
                                                 0x55, 0xaa, 0x55, 0xaa, 0x55}},
                false);
        }
    }
    Member& node;
    std::uint32_t id, number = 0;
};

TEST(Shared_frames, never_begin_in_a_used_private_slot) {
    Bus bus;
    bus.add("clock");
    Member& ir = bus.add("ir");
    Member& motor = bus.add("motor");
    Load load(ir, 0x300);
    bus.run(1000 * ms, 500 * us, [&] {
        motor.station.send({0x10A, {1, 2, 3, 4, 5, 6, 7, 8}}, true);
        ir.station.send({0x100, {1, 2, 3, 4, 5, 6, 7, 8}}, true);
        load();
    });
    Time sync = 0;
    std::size_t shared = 0;
    for (const Seen& s : bus.wire) {
        if (s.frame.id == 0) {
            sync = s.begin;
        }
        const Time at = s.begin - sync;
        if (s.frame.id != 0x300) continue;
        ++shared;
        EXPECT_GE(at, 1500 * us) << "slot 3 is recycled, 0 to 2 are used";
        const Time end = s.begin +
                         bus.table.bits(hal::can::frame_bits(s.frame).nominal + error_bits) +
                         bus.table.guard;
        EXPECT_LE(end, sync + (at / (500 * us) + 1) * 500 * us + 2) << "ends within its slot";
    }
    EXPECT_GT(shared, 190U * 6 * 3);
    EXPECT_EQ(0U, motor.station.count().missed);
    EXPECT_EQ(0U, motor.station.count().foreign);
    EXPECT_GT(ir.station.count().sent_recycled, 190U * 3) << "slot 3, idle in each of 200 cycles";
}

TEST(Idle_slots, are_all_recycled_by_type_a) {
    Bus bus;
    bus.add("clock");
    Member& motor = bus.add("motor");
    Load load(motor, 0x300);
    bus.run(500 * ms, 500 * us, [&] { load(); });
    std::size_t cycles = 0;
    std::size_t used[10] = {};
    Time sync = 0;
    for (const Seen& s : bus.wire) {
        if (s.frame.id == 0) {
            sync = s.begin;
            cycles += s.begin > 1'000'000'000 + 50 * ms;
        }
        if (s.frame.id == 0x300 && s.begin > 1'000'000'000 + 50 * ms) {
            ++used[(s.begin - sync) / (500 * us)];
        }
    }
    ASSERT_GT(cycles, 80U);
    for (const int slot : {1, 2, 3}) {
        EXPECT_GE(used[slot] + 3, 3 * cycles) << slot << ": three frames in each";
    }
}

TEST(Idle_slots, are_announced_to_type_b) {
    Bus bus;
    bus.add("clock");
    Member& us_node = bus.add("us");
    Load load(us_node, 0x310);
    bus.run(200 * ms, 50 * us, [&] { load(); });
    EXPECT_EQ(0U, us_node.station.count().sent_recycled) << "without a monitor it does not recycle";
    Member& watch = bus.add("watch");
    bus.run(300 * ms, 50 * us, [&] { load(); });
    EXPECT_GT(us_node.station.count().sent_recycled, 50U * 3);
    EXPECT_GT(watch.station.count().announced, 50U * 3);
    EXPECT_TRUE(us_node.station.monitored());
    watch.station.detach();
    bus.run(300 * ms, 50 * us, [&] { load(); });
    EXPECT_EQ(1U, us_node.times(Event::monitor_lost));
}

TEST(Slot_start, is_within_half_a_microsecond_with_a_drift_of_100_ppm) {
    for (const double ppm : {-100.0, 37.0, 100.0}) {
        Bus bus;
        bus.add("clock");
        Member& motor = bus.add("motor", {.crystal = {.ppm = ppm, .tick = 1000}});
        double worst = 0;
        // a thread out of step with the slots
        bus.run(3000 * ms, 330 * us, [&] { motor.station.send({0x10A, {1}}, true); });
        Time sync = 0;
        for (const Seen& s : bus.wire) {
            if (s.frame.id == 0) {
                sync = s.begin;
            }
            if (s.frame.id == 0x10A && s.begin > 1'000'000'000 + 1000 * ms) {
                worst = std::max(worst, std::abs(static_cast<double>(s.begin - sync - 1000 * us)));
            }
        }
        EXPECT_LE(worst, 500) << ppm;
        EXPECT_GT(worst, 0);
        EXPECT_NEAR(ppm, motor.station.clock().ppm(), 15);
    }
}

}  // namespace
