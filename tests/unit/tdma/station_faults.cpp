// SPDX-License-Identifier: MIT
// Masters that fail and recover, stations that disturb each other, reports of faults.
#include <gtest/gtest.h>

#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;

bool is_sync(const Wire::Frame& f) { return decode(f.bytes).kind == Kind::sync; }

/// Master 1, backups 2 and 3, slave 4, all running.
struct Network : Bed {
    Machine& first = add(1, master());
    Machine& second = add(2, backup(100'000, 200'000), {150e-6, 5'000'000'000});
    Machine& third = add(3, backup(250'000, 400'000), {-150e-6, 9'000'000'000});
    Machine& station = add(4, slave(600'000), {80e-6, -3'000'000'000});
    Network() {
        wire.noise_ns = 300;
        run(800 * ms);
        wire.watching = true;
    }
    bool all_ready() {
        return first.station.ready() && second.station.ready() && third.station.ready() &&
               station.station.ready();
    }
};

TEST(Backup, takes_over_within_one_cycle_when_the_master_is_lost) {
    Network n;
    ASSERT_TRUE(n.all_ready());
    n.run(10 * ms);
    n.first.off = true;
    n.first.port.cut = true;
    n.run(100 * ms);
    Time last = 0;
    Time taken = 0;
    for (const Wire::Frame& f : n.wire.seen) {
        if (!is_sync(f)) continue;
        EXPECT_NE(3, f.from) << "the one with the smallest offset wins";
        if (f.from == 1) {
            last = f.left;
        } else if (taken == 0) {
            taken = f.left;
        }
    }
    EXPECT_LT(taken - (last + ms), ms) << "from the sync that did not come to the backup's first";
    EXPECT_NEAR(100'000, static_cast<double>(taken - last - ms), 3'000) << "at its offset";
    EXPECT_TRUE(n.second.status().leading);
    EXPECT_FALSE(n.third.status().leading);
    EXPECT_EQ(0, n.station.events[Event::sync_lost]);
    EXPECT_EQ(mac(2), n.station.status().master);
    EXPECT_TRUE(n.station.station.ready());
    EXPECT_LT(std::abs(n.station.status().error), 3'000) << "the schedule is the master's";
}

TEST(Backup, takes_over_when_the_first_backup_fails_too) {
    Network n;
    n.first.off = n.first.port.cut = true;
    n.run(50 * ms);
    n.second.off = n.second.port.cut = true;
    n.run(50 * ms);
    EXPECT_TRUE(n.third.status().leading);
    EXPECT_EQ(0, n.station.events[Event::sync_lost]);
    // its thread was suspended; it finds the third, and has the smaller offset
    n.second.off = n.second.port.cut = false;
    n.second.next = n.second.port.clock().local(n.now);
    n.run(600 * ms);
    EXPECT_TRUE(n.second.status().leading);
    EXPECT_FALSE(n.third.status().leading);
    EXPECT_EQ(0, n.station.events[Event::sync_lost]);
}

TEST(Backup, stops_sending_when_the_master_returns) {
    Network n;
    n.first.off = n.first.port.cut = true;
    n.run(50 * ms);
    ASSERT_TRUE(n.second.status().leading);
    n.first.off = n.first.port.cut = false;
    n.first.station.attach(n.first.port);  // restarted
    n.first.next = n.first.port.clock().local(n.now);
    n.run(800 * ms);
    EXPECT_TRUE(n.first.status().leading);
    EXPECT_FALSE(n.second.status().leading);
    EXPECT_EQ(1, n.second.events[Event::yielded]);
    EXPECT_EQ(0, n.station.events[Event::sync_lost]) << "the schedule went on all the time";
    EXPECT_EQ(mac(1), n.station.status().master);
    n.wire.seen.clear();
    n.run(50 * ms);
    for (const Wire::Frame& f : n.wire.seen) {
        if (is_sync(f)) {
            EXPECT_EQ(1, f.from);
        }
    }
}

TEST(Station, does_not_recalibrate_after_a_short_loss_of_the_master) {
    Network n;
    ASSERT_TRUE(n.all_ready());
    const auto before = n.station.status().count.requests;
    n.first.port.cut = true;
    n.run(3 * ms);
    EXPECT_EQ(mac(2), n.station.status().master);
    n.first.port.cut = false;
    n.run(900 * ms);
    EXPECT_EQ(mac(1), n.station.status().master);
    EXPECT_LE(n.station.status().count.requests - before, 2U)
        << "the station's slot is for its frames";
    EXPECT_EQ(1, n.station.events[Event::calibrated]);
    n.first.port.cut = true;
    n.run(200 * ms);
    n.first.port.cut = false;
    n.run(1700 * ms);
    EXPECT_EQ(mac(1), n.station.status().master);
    EXPECT_GE(n.station.status().count.requests - before, 100U)
        << "after a longer time its cable may be another";
}

TEST(Station, does_not_count_frames_that_were_rejected_before_it_was_attached) {
    Bed bed;
    Machine& m = bed.add(1, master());
    const std::vector<std::uint8_t> frame(60);
    EXPECT_NE(ethernet::Sent::queued, m.station.send(frame, 0, 0));
    m.station.attach(m.port);
    bed.run(5 * ms);
    EXPECT_EQ(0U, m.station.dropped(m.port.statistics()));
}

TEST(Station, counts_each_frame_that_does_not_leave_once) {
    Bed bed;
    Machine& m = bed.add(1, master());
    const auto dropped = [&m] { return m.station.dropped(m.port.statistics()); };
    const std::vector<std::uint8_t> frame(60);
    EXPECT_EQ(ethernet::Sent::down, m.station.send(frame, 0, 0));
    EXPECT_EQ(1U, dropped()) << "sent while the station may not send";
    bed.run(100 * ms);
    ASSERT_TRUE(m.station.ready());
    EXPECT_EQ(1U, dropped());
    m.station.count_dropped();
    EXPECT_EQ(2U, dropped()) << "dropped by the sender";
    const std::uint64_t before = m.status().count.syncs_sent;
    m.port.cut = true;
    bed.run(10 * ms);
    EXPECT_EQ(before, m.status().count.syncs_sent);
    EXPECT_EQ(12U, dropped()) << "a sync in each of ten cycles";
    EXPECT_EQ(0U, m.port.statistics().late);
}

TEST(Station, reports_the_new_schedule_of_a_master_that_restarted_at_once) {
    Bed bed;
    Machine& m = bed.add(1, master());
    StationSetup patient = slave(300'000);
    patient.lost_limit = 20;
    Machine& s = bed.add(2, patient, {100e-6, 0});
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    m.next += 333'333;
    m.station.attach(m.port);
    bed.run(600 * ms);
    EXPECT_EQ(1, s.events[Event::new_schedule]);
    EXPECT_EQ(0, s.events[Event::sync_lost]);
    EXPECT_TRUE(s.station.ready());
}

TEST(Station, synchronises_to_a_restarted_master_with_another_time) {
    Bed bed;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000), {100e-6, 0});
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    m.off = true;
    bed.run(50 * ms);
    EXPECT_EQ(1, s.events[Event::sync_lost]);
    EXPECT_EQ(State::listening, s.status().state);
    m.off = false;
    m.next += 50 * ms + 333'333;
    m.station.attach(m.port);
    bed.run(600 * ms);
    EXPECT_TRUE(s.station.ready());
    EXPECT_EQ(2, s.events[Event::calibrated]);
}

TEST(Station, is_safe_within_its_limit_when_the_sync_is_lost) {
    Bed bed;
    StationSetup setup = slave(300'000);
    setup.lost_limit = 4;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, setup);
    bed.run(600 * ms);
    m.off = true;
    const std::uint32_t at = s.status().cycle;
    int cycles = 0;
    while (s.status().synchronous && cycles < 100) {
        bed.run(ms);
        ++cycles;
    }
    EXPECT_LE(cycles, 7)
        << "four cycles, the one that is on its way, and the sync that was sent ahead; from cycle "
        << at;
    EXPECT_GE(cycles, 4);
}

TEST(Master, without_followers_steps_down_for_a_second_master_with_a_smaller_address) {
    Bed bed;
    Machine& a = bed.add(1, master());
    a.port.cut = true;
    Machine& b = bed.add(2, master());
    bed.run(50 * ms);
    ASSERT_TRUE(a.status().leading && b.status().leading);
    a.port.cut = false;  // two segments are joined
    bed.run(50 * ms);
    EXPECT_TRUE(a.status().leading);
    EXPECT_EQ(1, a.events[Event::other_master]);
    EXPECT_EQ(mac(2), a.last_who[Event::other_master]);
    EXPECT_EQ(State::withdrawn, b.status().state);
    EXPECT_EQ(1, b.events[Event::withdrew]);
    EXPECT_FALSE(b.station.ready());
    b.station.reset();  // it finds a master that is not its backup, and does not send
    bed.run(20 * ms);
    EXPECT_EQ(State::withdrawn, b.status().state);
    EXPECT_EQ(1, b.events[Event::master_there]);
    EXPECT_EQ(mac(1), b.last_who[Event::master_there]);
    EXPECT_EQ(1, a.events[Event::leading]);
}

TEST(Master, does_not_send_at_its_start_when_another_one_has_another_cycle) {
    Bed bed;
    Machine& a = bed.add(1, master(4'000'000));
    bed.run(50 * ms);
    Machine& b = bed.add(2, master());
    b.next = b.port.clock().local(bed.now);
    bed.wire.watching = true;
    bed.run(200 * ms);
    EXPECT_TRUE(a.status().leading);
    EXPECT_EQ(State::withdrawn, b.status().state);
    EXPECT_EQ(1, b.events[Event::master_there]);
    EXPECT_EQ(0, b.events[Event::leading]);
    for (const Wire::Frame& f : bed.wire.seen) {
        EXPECT_EQ(1, f.from);
    }
    a.off = true;
    b.station.reset();
    bed.run(200 * ms);
    EXPECT_TRUE(b.status().leading) << "when the other is gone";
}

TEST(Master, recognises_its_backup_when_the_guard_exceeds_the_backup_offset) {
    const auto cell = [](StationSetup s) {
        s.guard = 150'000;
        s.backup_from = 100'000;
        return s;
    };
    Bed bed;
    Machine& m = bed.add(1, cell(master()));
    Machine& b = bed.add(2, cell(backup(100'000, 500'000)));
    Machine& s = bed.add(3, cell(slave(300'000)));
    bed.run(800 * ms);
    ASSERT_TRUE(b.station.ready() && s.station.ready());
    m.off = m.port.cut = true;
    bed.run(50 * ms);
    ASSERT_TRUE(b.status().leading);
    m.off = m.port.cut = false;
    m.station.attach(m.port);
    m.next = m.port.clock().local(bed.now);
    bed.run(800 * ms);
    EXPECT_TRUE(m.status().leading);
    EXPECT_FALSE(b.status().leading);
    EXPECT_EQ(0, m.events[Event::master_there] + m.events[Event::other_master] +
                     s.events[Event::sync_lost]);
}

TEST(Station, without_a_sync_reports_it_once) {
    Bed bed;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    Machine& b = bed.add(3, backup(200'000, 500'000));
    m.off = true;
    bed.run(4'900 * ms);
    EXPECT_EQ(0, s.events[Event::unheard]);
    bed.run(20'000 * ms);
    EXPECT_EQ(1, s.events[Event::unheard]);
    EXPECT_EQ(1, b.events[Event::unheard]);
    // A received and lost sync is reported as a loss instead.
    m.off = false;
    m.next = m.port.clock().local(bed.now);
    b.off = true;
    bed.run(1000 * ms);
    ASSERT_TRUE(s.station.ready());
    m.off = true;
    bed.run(10'000 * ms);
    EXPECT_EQ(1, s.events[Event::sync_lost]);
    EXPECT_EQ(1, s.events[Event::unheard]);
}

TEST(Station, with_another_cycle_reports_it_once_and_does_not_synchronise) {
    Bed bed;
    bed.add(1, master(2'000'000));
    Machine& s = bed.add(2, slave(300'000));
    bed.run(3000 * ms);
    EXPECT_EQ(State::listening, s.status().state);
    EXPECT_EQ(1, s.events[Event::other_schedule]);
    EXPECT_EQ(mac(1), s.last_who[Event::other_schedule]);
    EXPECT_EQ(2'000'000, s.last_value[Event::other_schedule]);
    EXPECT_EQ(0, s.events[Event::sync_lost] + s.events[Event::running]);
    EXPECT_GT(s.status().count.foreign, 1000U);
}

TEST(Station, between_two_masters_follows_one_and_reports_the_other) {
    Bed bed;
    StationSetup stubborn = master();
    Machine& a = bed.add(1, stubborn);
    Machine& b = bed.add(5, stubborn);
    a.port.cut = b.port.cut = true;
    b.next += 400'000;
    bed.run(50 * ms);
    ASSERT_TRUE(a.status().leading && b.status().leading);
    a.port.cut = b.port.cut = false;
    bed.wire.deaf = {1, 5};  // neither receives the other
    Machine& s = bed.add(3, slave(300'000, 1'000'000), {50e-6, 0});
    s.next = s.port.clock().local(bed.now);
    bed.run(2000 * ms);
    EXPECT_TRUE(s.station.ready());
    EXPECT_GE(s.events[Event::other_master], 1);
    EXPECT_NE(s.status().master, s.last_who[Event::other_master]);
    EXPECT_EQ(0, s.events[Event::sync_lost]);
    EXPECT_LT(std::abs(s.status().error), 3'000);
}

TEST(Station, whose_thread_stays_out_of_phase_reports_it_once) {
    Bed bed;
    bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    s.stiff = true;
    s.next += 400'000;
    bed.run(12'000 * ms);
    EXPECT_EQ(State::synchronising, s.status().state);
    EXPECT_EQ(1, s.events[Event::out_of_step]);
    EXPECT_EQ(mac(1), s.last_who[Event::out_of_step]);
    EXPECT_GT(s.last_value[Event::out_of_step], 100'000);
}

TEST(Station, names_both_stations_that_were_given_one_block) {
    Bed bed;
    StationSetup setup = master();
    setup.others = {{.mac = {}, .role = Role::slave, .slots = slave(300'000).slots, .index = 1}};
    Machine& leader = bed.add(1, setup);
    Machine& a = bed.add(2, slave(300'000));
    const auto send = [](Machine& m) {
        const Frame f = encode(mac(9), m.port.address(), Request{});
        std::vector<std::uint8_t> frame(f.begin(), f.end());
        std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
        m.station.send(frame, 0, 0);
    };
    a.in_cycle = send;
    bed.run(600 * ms);
    ASSERT_TRUE(a.station.ready());
    EXPECT_EQ(0, leader.events[Event::duplicate_slot]);
    Machine& b = bed.add(3, slave(300'000));
    b.in_cycle = send;
    bed.run(900 * ms);
    EXPECT_EQ(1, leader.events[Event::duplicate_slot]);
    EXPECT_EQ(mac(3), leader.last_who[Event::duplicate_slot]);
    EXPECT_EQ(mac(2), duplicate_address(leader.last_value[Event::duplicate_slot]));
    EXPECT_EQ(1, duplicate_index(leader.last_value[Event::duplicate_slot]));
}

TEST(Station, reports_another_one_in_its_slot) {
    Bed bed;
    bed.add(1, master());
    Machine& a = bed.add(2, slave(300'000));
    Machine& b = bed.add(3, slave(600'000));
    bed.run(600 * ms);
    ASSERT_TRUE(a.station.ready() && b.station.ready());
    const auto send = [](Machine& m) {
        const Frame f = encode(mac(9), m.port.address(), Request{});
        std::vector<std::uint8_t> frame(f.begin(), f.end());
        std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
        m.station.send(frame, 0, 0);
    };
    a.in_cycle = b.in_cycle = send;
    bed.run(100 * ms);
    EXPECT_EQ(0U, a.status().count.intruders + b.status().count.intruders);
    StationSetup wrong = slave(300'000);
    ASSERT_TRUE(b.station.reconfigure(wrong));
    bed.run(600 * ms);
    EXPECT_EQ(1, a.events[Event::foreign_frame]);
    EXPECT_EQ(mac(3), a.last_who[Event::foreign_frame]);
    EXPECT_EQ(1, b.events[Event::foreign_frame]);
    EXPECT_EQ(mac(2), b.last_who[Event::foreign_frame]);
}

TEST(Station, reports_a_babbling_one) {
    Bed bed;
    bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    bed.run(600 * ms);
    const Frame f = encode(mac(2), mac(7), Request{});
    for (int i = 0; i < 5000; ++i) {
        bed.wire.inject({f.begin(), f.end()}, 7, bed.now + i * 7'000);
    }
    bed.run(30 * ms);
    EXPECT_EQ(1, s.events[Event::babbling]);
    EXPECT_EQ(mac(7), s.last_who[Event::babbling]);
    EXPECT_GT(s.last_value[Event::babbling], 100);
    EXPECT_TRUE(s.station.ready());
}

TEST(Station, reports_no_babbling_when_frames_waited_for_a_late_thread) {
    Bed bed;
    bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    s.off = true;  // its port is open, its thread does not run yet
    bed.run(300 * ms);
    s.off = false;
    s.next = s.port.clock().local(bed.now);
    bed.run(600 * ms);
    ASSERT_TRUE(s.station.ready());
    s.off = true;  // now its thread is delayed
    bed.run(200 * ms);
    s.off = false;
    s.next = s.port.clock().local(bed.now);
    bed.run(600 * ms);
    EXPECT_EQ(0, s.events[Event::babbling]);
    EXPECT_TRUE(s.station.ready());
}

}  // namespace
}  // namespace tdma_tests
