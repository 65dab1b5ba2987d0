// SPDX-License-Identifier: MIT
// The SYNC: lost, late, doubled, sent by two; backups; mode changes.
#include "bus.hpp"
#include "components/fieldbus/scocan/plugins/event_texts.hpp"

namespace {

using namespace hal::scocan;
using namespace hal::scocan::test;
using hal::can::Disturbance;
using hal::can::Fault;
using hal::can::Frame;

TEST(Backup, replaces_the_sync_node_within_one_cycle) {
    Bus bus;
    Member& clock = bus.add("clock");
    Member& spare = bus.add("spare");
    Member& motor = bus.add("motor");
    const auto send = [&] { motor.station.send({0x10A, {7}}, true); };
    bus.run(100 * ms, 500 * us, send);
    EXPECT_TRUE(clock.station.leading());
    EXPECT_FALSE(spare.station.leading());
    clock.station.detach();
    const Time lost_at = bus.now;
    bus.run(100 * ms, 500 * us, send);
    EXPECT_TRUE(spare.station.leading());
    std::vector<Seen> syncs;
    for (const Seen& s : bus.wire) {
        if (s.frame.id == 0) {
            syncs.push_back(s);
        }
    }
    for (std::size_t i = 1; i < syncs.size(); ++i) {
        EXPECT_LE(syncs[i].begin - syncs[i - 1].begin, 5 * ms + 100 * us)
            << "no cycle without a SYNC";
    }
    EXPECT_GE(syncs.back().begin, lost_at + 90 * ms);
    EXPECT_EQ(0U, motor.station.count().syncs_lost);
    EXPECT_EQ(0U, motor.station.count().missed);
    EXPECT_EQ(0U, motor.station.count().foreign + spare.station.count().foreign);
    // The primary returns: it listens, and takes over at a counter that is a multiple of 8.
    clock.station.attach(*clock.link);
    bus.run(200 * ms, 500 * us, send);
    EXPECT_TRUE(clock.station.leading());
    EXPECT_FALSE(spare.station.leading());
    EXPECT_EQ(0U, motor.station.count().syncs_lost);
    Time last = 0;
    for (const Seen& s : bus.wire) {
        if (s.frame.id != 0x10A) continue;
        if (last != 0) {
            EXPECT_NEAR(5e6, static_cast<double>(s.begin - last), 10)
                << "private slots keep their times";
        }
        last = s.begin;
    }
}

TEST(Sync, lost_for_too_long_silences_a_node_that_recovers) {
    Bus bus;
    bus.add("clock");
    Member& motor = bus.add("motor");
    const auto send = [&] { motor.station.send({0x10A, {7}}, true); };
    bus.run(100 * ms, 500 * us, send);
    bus.faults().disturb(
        {.fault = Fault::error, .every = 1, .id = 0, .mask = 0x7ff, .until_ns = bus.now + 25 * ms});
    const auto sent = motor.station.count().sent_private;
    bus.run(25 * ms, 500 * us, send);
    EXPECT_EQ(State::running, motor.station.state()) << "coasting";
    EXPECT_GE(motor.station.count().sent_private, sent + 4);
    EXPECT_GE(motor.station.count().syncs_lost, 4U);
    bus.run(25 * ms, 500 * us, send);
    EXPECT_EQ(0U, motor.station.lost());
    bus.faults().disturb({.fault = Fault::error,
                          .every = 1,
                          .id = 0,
                          .mask = 0x7ff,
                          .until_ns = bus.now + 120 * ms});
    bus.run(100 * ms, 500 * us, send);
    EXPECT_EQ(State::silent, motor.station.state());
    EXPECT_EQ(1U, motor.times(Event::sync_lost));
    bus.run(5 * ms, 500 * us, send);  // what was on its way
    const auto before = motor.station.count().sent_private;
    bus.run(10 * ms, 500 * us, send);
    EXPECT_EQ(before, motor.station.count().sent_private);
    bus.run(200 * ms, 500 * us, send);
    EXPECT_EQ(State::running, motor.station.state());
    EXPECT_GT(motor.station.count().sent_private, before);
}

TEST(Backup, in_a_slow_thread_does_not_report_its_own_sync_as_doubled) {
    Bus bus;
    bus.add("clock");
    Member& spare = bus.add("spare");
    bus.run(1000 * ms, 100 * ms);  // both have begun to lead before either could hear the other
    EXPECT_EQ(1U, spare.times(Event::standby));
    EXPECT_EQ(0U, spare.times(Event::sync_doubled));
    EXPECT_EQ(State::running, spare.station.state());
}

TEST(Sync, with_any_phase_ends_silence_at_once) {
    Bus bus;
    Member& clock = bus.add("clock");
    Member& motor = bus.add("motor");
    const auto send = [&] { motor.station.send({0x10A, {7}}, true); };
    bus.run(100 * ms, 500 * us, send);
    clock.station.detach();
    bus.run(200 * ms, 500 * us, send);
    ASSERT_EQ(State::silent, motor.station.state());
    bus.now += 1234567;  // the restarted node begins its cycles at any instant
    clock.station.attach(*clock.link);
    const auto syncs = motor.station.count().syncs;
    while (motor.station.count().syncs == syncs) {
        bus.run(500 * us, 500 * us, send);
    }
    EXPECT_EQ(State::running, motor.station.state()) << "at the first SYNC";
    bus.run(100 * ms, 500 * us, send);
    EXPECT_EQ(State::running, motor.station.state());
    EXPECT_EQ(0U, motor.times(Event::sync_late) + motor.times(Event::sync_doubled));
    EXPECT_EQ(1U, motor.times(Event::sync_jumped));
    EXPECT_EQ(0U, motor.station.count().syncs_ignored);
    EXPECT_EQ(0U, motor.station.count().late);
    EXPECT_NEAR(0, motor.station.clock().error(), 10);
}

TEST(Sync, at_a_rate_that_is_not_that_of_a_clock_is_reported) {
    for (const double ppm : {900.0, 1100.0, -1100.0, 5000.0, 300'000.0}) {
        Bus bus;
        bus.add("clock");
        Member& motor = bus.add("motor", {.crystal = {.ppm = ppm}});
        bus.run(1000 * ms);
        const auto& n = motor.station.count();
        if (ppm == 900.0) {
            EXPECT_EQ(State::running, motor.station.state());
            EXPECT_EQ(0U, n.syncs_ignored + motor.times(Event::sync_off_rate));
            continue;
        }
        EXPECT_EQ(State::listening, motor.station.state()) << ppm;
        EXPECT_GE(n.syncs_ignored, 190U);
        ASSERT_GE(motor.times(Event::sync_off_rate), 100U);
        EXPECT_EQ(Event::sync_off_rate, motor.events.back().event);
        EXPECT_NEAR(ppm, static_cast<double>(motor.events.back().value), 5);
    }
}

TEST(Sync, late_or_doubled_is_ignored) {
    Bus bus;
    bus.add("clock", {.single_shot = false});
    Member& motor = bus.add("motor");
    bus.run(200 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    bus.faults().disturb({.fault = Fault::delay,
                          .every = 1,
                          .id = 0,
                          .mask = 0x7ff,
                          .count = 1,
                          .delay_ns = 60 * us});
    bus.run(10 * ms);
    EXPECT_EQ(1U, motor.times(Event::sync_late));
    EXPECT_NEAR(60e3, static_cast<double>(motor.events.back().value), 10);
    bus.faults().disturb(
        {.fault = Fault::duplicate, .every = 1, .id = 0, .mask = 0x7ff, .count = 1});
    bus.run(10 * ms);
    EXPECT_EQ(1U, motor.times(Event::sync_doubled));
    EXPECT_EQ(State::running, motor.station.state());
    EXPECT_NEAR(0, motor.station.clock().error(), 10);
}

TEST(Second_sync_node, makes_one_of_them_yield) {
    Bus bus, other(table_text, "scocan-other");
    Member& first = bus.add("clock");
    Member& motor = bus.add("motor");
    bus.run(102 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    Member& second = bus.add("clock");  // was on a bus of its own, in another phase
    auto alone =
        hal::can::open("sim:scocan-other", {.bit_rate = 1'000'000, .own_frames = true}).link;
    second.station.attach(*alone);
    bus.run(53 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    ASSERT_TRUE(second.station.leading());
    // the wires are joined
    auto both = hal::can::open("sim:scocan-test", {.own_frames = true}).link;
    second.station.detach();
    EXPECT_TRUE(first.station.leading());
    second.station.attach(*both);
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    EXPECT_TRUE(first.station.leading());
    EXPECT_FALSE(second.station.leading()) << "it listens before it sends";
    EXPECT_EQ(State::running, motor.station.state());
}

TEST(Mode_change, takes_place_at_one_cycle_without_a_lost_or_double_message) {
    Bus bus;
    Member& clock = bus.add("clock");
    for (const char* name : {"spare", "us", "watch"}) {
        bus.add(name);
    }
    Member& ir = bus.add("ir");
    Member& motor = bus.add("motor");
    std::uint8_t number = 0;
    std::uint64_t cycle = 0;
    const auto send = [&] {
        if (motor.station.clock().cycle() == cycle) return;
        cycle = motor.station.clock().cycle();
        ++number;
        motor.station.send({0x10A, {number}}, false);
        ir.station.send({0x100, {number}}, false);
    };
    bus.run(100 * ms, 500 * us, send);
    EXPECT_FALSE(clock.station.change_mode(7)) << "an unknown mode";
    EXPECT_FALSE(motor.station.change_mode(1)) << "only the SYNC node";
    ASSERT_TRUE(clock.station.change_mode(1));
    bus.run(200 * ms, 500 * us, send);
    for (Member& n : bus.nodes) {
        EXPECT_EQ(1U, n.station.mode());
        EXPECT_EQ(1U, n.times(Event::mode_changed));
        EXPECT_EQ(0U, n.station.count().foreign);
    }
    int last[2] = {0, 0};
    Time sync = 0;
    bool swapped = false;
    for (const Seen& s : bus.wire) {
        if (s.frame.id == 0) {
            sync = s.begin;
            swapped = (s.frame.data[1] & 15) == 1;
        }
        if (s.frame.id != 0x10A && s.frame.id != 0x100) continue;
        const bool is_motor = s.frame.id == 0x10A;
        EXPECT_NEAR(static_cast<double>(sync + (is_motor == swapped ? 500 : 1000) * us),
                    static_cast<double>(s.begin), 2);
        int& number_of = last[is_motor ? 1 : 0];
        if (number_of != 0) {
            EXPECT_EQ(number_of + 1, s.frame.data[0]);
        }
        number_of = s.frame.data[0];
    }
    EXPECT_GT(last[1], 50);
}

TEST(Mode_change, is_refused_when_a_node_does_not_answer) {
    Bus bus;
    Member& clock = bus.add("clock");
    for (const char* name : {"spare", "us", "watch", "motor"}) {
        bus.add(name);
    }
    bus.run(100 * ms);
    ASSERT_TRUE(clock.station.change_mode(1));
    bus.run(200 * ms);
    ASSERT_EQ(1U, clock.times(Event::mode_refused));
    EXPECT_EQ(bus.table.find("ir").value(), clock.events.back().who);
    for (Member& n : bus.nodes) {
        EXPECT_EQ(0U, n.station.mode());
    }
}

TEST(Node_with_another_table, only_listens) {
    Bus bus,
        old(std::string(table_text).append("message extra 0x350 node us\n").c_str(), "scocan-test");
    bus.add("clock");
    Member& motor = old.add("motor");
    const auto send = [&] { motor.station.send({0x10A, {7}}, true); };
    for (int i = 0; i < 400; ++i) {
        bus.run(500 * us);
        old.now = bus.now - 500 * us;
        old.run(500 * us, 500 * us, send);
    }
    EXPECT_EQ(State::listen_only, motor.station.state());
    EXPECT_EQ(1U, motor.times(Event::other_table));
}

TEST(Sender_outside_of_its_slots, is_reported_and_silences_itself) {
    Bus bus;
    bus.add("clock");
    Member& ir = bus.add("ir");
    Member& motor = bus.add("motor");
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    ASSERT_EQ(State::running, motor.station.state());
    // A program on the motor's computer uses its controller past the table.
    Time next = bus.now;
    bus.run(100 * ms, 500 * us, [&] {
        motor.station.send({0x10A, {7}}, true);
        if (bus.now >= next) {
            motor.link->send({0x10A, {9}}, bus.now + 100 * us);
            next = bus.now + 10 * ms;
        }
    });
    EXPECT_GE(ir.station.count().foreign, 3U);
    EXPECT_EQ(ir.station.count().foreign, ir.station.foreign_of(0x10A));
    EXPECT_EQ(bus.table.find("motor").value(), ir.events.back().who);
    EXPECT_EQ(State::silenced, motor.station.state());
    motor.station.reset();
    bus.run(20 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    EXPECT_EQ(State::running, motor.station.state());
}

TEST(Babbler, is_reported_once_and_the_private_slots_survive) {
    Bus bus;
    bus.add("clock");
    Member& ir = bus.add("ir");
    Member& motor = bus.add("motor");
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    bus.faults().babble({0x150, {1}}, 300 * us);
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    EXPECT_GT(ir.station.count().foreign, 20U);
    EXPECT_GE(ir.times(Event::babbling), 0U);
    bus.faults().calm();
    const auto missed = motor.station.count().missed;
    bus.run(100 * ms, 500 * us, [&] { motor.station.send({0x10A, {7}}, true); });
    EXPECT_EQ(missed, motor.station.count().missed);
}

TEST(Foreign_frame, has_a_sender_only_where_the_table_knows_one) {
    Bus bus;
    Member& ir = bus.add("ir");
    const EventTexts texts(bus.table, static_cast<std::size_t>(ir.station.node()), "reset");
    EXPECT_EQ(texts.line({Event::foreign_frame, no_node, sync_id, 3}),
              "frame 0x000 in slot 3, outside of its own; a SYNC, of node clock or a backup");
    EXPECT_EQ(texts.line({Event::foreign_frame, no_node, announce_id, 3}),
              "frame 0x001 in slot 3, outside of its own; an idle slot announced by the monitor");
    EXPECT_EQ(texts.line({Event::foreign_frame, no_node, node_id, 3}),
              "frame 0x781 in slot 3, outside of its own; reserved for the bus itself");
    EXPECT_EQ(texts.line({Event::foreign_frame, no_node, 0x555, 3}),
              "frame 0x555 in slot 3, outside of its own; its sender is not in the table");
    EXPECT_EQ(texts.fault(Event::foreign_frame, sync_id)->text,
              "frame 0x000 in slot {}, outside of its own; a SYNC, of node clock or a backup");
    EXPECT_EQ(texts.fault(Event::foreign_frame, 0x555)->text,
              "frame with an unknown identifier in slot {}, outside of its own; its sender is not "
              "in the table");
}

TEST(Bus_off, is_reported_and_recovers) {
    Bus bus;
    bus.add("clock");
    Member& motor = bus.add("motor");
    const auto send = [&] { motor.station.send({0x10A, {7}}, true); };
    bus.run(100 * ms, 500 * us, send);
    bus.faults().set_counters(motor.link->simulation()->node(), 255, 0);
    bus.faults().disturb(
        {.fault = Fault::error, .every = 1, .id = 0x10A, .mask = 0x7ff, .count = 1});
    bus.run(20 * ms, 500 * us, send);
    EXPECT_EQ(State::down, motor.station.state());
    EXPECT_EQ(1U, motor.times(Event::bus_off));
    bus.run(300 * ms, 500 * us, send);
    EXPECT_EQ(State::running, motor.station.state());
    EXPECT_EQ(1U, motor.times(Event::bus_on));
}

}  // namespace
