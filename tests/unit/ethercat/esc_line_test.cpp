// SPDX-License-Identifier: MIT
#include "tests/unit/ethercat/esc_world.hpp"

namespace {

using namespace esc_world;

struct Line : testing::Test {
    World w;
    std::array<Firmware, 6> firmware;
    /// Adds `count` slaves in a row.
    void row(std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            ASSERT_EQ(w.line.add({.sii = image(), .application = &firmware[i]}),
                      static_cast<int>(i));
        }
    }
    int count() { return w.send(Command::brd, 0, {0}); }
};

TEST_F(Line, Frame_takes_the_delays_of_cables_and_slaves) {
    row(2);
    w.line.power_on(0);
    EXPECT_EQ(count(), 2);
    EXPECT_EQ(w.out.end, esc::End::primary);
    EXPECT_EQ(w.out.first_bit_ns - w.now_ns, 50 + 640 + 50 + 640 + 50 + 600 + 50);
}

TEST_F(Line, Frame_runs_the_firmware_that_it_concerns_and_that_which_waits) {
    constexpr std::uint16_t alias = 7;
    row(3);
    ASSERT_EQ(w.line.add({.sii = image(alias), .application = &firmware[3]}), 3);
    firmware[2].waiting = firmware[3].waiting = false;
    w.line.power_on(0);
    for (unsigned i = 0; i < 4; ++i) {
        w.write<std::uint16_t>(i, registers::station_address,
                               static_cast<std::uint16_t>(0x1001 + i));
    }
    const auto runs_before = firmware;
    w.gap_ns = 300'000;
    EXPECT_EQ(w.send(Command::fprd, at_station(0x1003, registers::al_status), {0, 0}), 1);
    EXPECT_EQ(firmware[0].runs, runs_before[0].runs + 1) << "it waits, and did not run for 200 us";
    EXPECT_EQ(firmware[2].runs, runs_before[2].runs + 1) << "it is addressed";
    EXPECT_EQ(firmware[3].runs, runs_before[3].runs);
    w.write<std::uint8_t>(3, registers::dl_alias_enable, 1);
    EXPECT_EQ(w.send(Command::fprd, at_station(alias, registers::al_status), {0, 0}), 1);
}

TEST_F(Line, Dl_status_shows_links_and_closed_loops) {
    row(2);
    w.line.power_on(0);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::dl_status), 0x5000 | 0x0a00 | 0x0030 | 0x0007)
        << "ports 0 and 1 open";
    EXPECT_EQ(w.read<std::uint16_t>(1, registers::dl_status), 0x5400 | 0x0200 | 0x0010 | 0x0007)
        << "only port 0 open";
}

TEST_F(Line, Tree_is_walked_in_the_order_of_ports_0_3_1_2) {
    const std::array all{esc::PortKind::mii, esc::PortKind::mii, esc::PortKind::mii,
                         esc::PortKind::mii};
    ASSERT_EQ(w.line.add({.controller = {.port_kinds = all}, .sii = image()}), 0);
    ASSERT_EQ(w.line.add({.sii = image(), .parent = 0, .parent_port = 1}), 1);
    ASSERT_EQ(w.line.add({.sii = image(), .parent = 0, .parent_port = 2}), 2);
    ASSERT_EQ(w.line.add({.sii = image(), .parent = 0, .parent_port = 3}), 3);
    ASSERT_EQ(w.line.add({.sii = image(), .parent = 1, .parent_port = 1}), 4);
    EXPECT_EQ(w.line.add({.sii = image(), .parent = 0, .parent_port = 1}), -1) << "taken";
    w.line.power_on(0);
    EXPECT_EQ(count(), 5);
    for (unsigned i = 0; i < 5; ++i) {
        w.write<std::uint16_t>(i, registers::station_address, static_cast<std::uint16_t>(i));
    }
    const auto station = [&](std::size_t i) {
        return get<std::uint16_t>(w.line.controller(i).memory(registers::station_address));
    };
    EXPECT_EQ(station(0), 0);
    EXPECT_EQ(station(3), 1);
    EXPECT_EQ(station(1), 2);
    EXPECT_EQ(station(4), 3);
    EXPECT_EQ(station(2), 4);
}

TEST_F(Line, Receive_times_give_the_cable_delays) {
    const std::array all{esc::PortKind::mii, esc::PortKind::mii, esc::PortKind::mii,
                         esc::PortKind::none};
    const auto slave = [&](int parent, unsigned port, std::int64_t cable_ns) {
        return esc::SlaveOnLine{.controller = {.port_kinds = all,
                                               .processing_ns = 600,
                                               .clock_start_ns = 1000 * (parent + 2)},
                                .sii = image(),
                                .parent = parent,
                                .parent_port = port,
                                .cable_ns = cable_ns};
    };
    w.line.add(slave(-1, 0, 0));
    w.line.add(slave(0, 1, 500));
    w.line.add(slave(0, 2, 900));

    w.line.add(slave(1, 1, 200));
    w.line.power_on(0);
    EXPECT_EQ(w.send(Command::bwr, at_station(0, registers::dc_receive_time), {0, 0, 0, 0}), 4);
    const auto times = [&](unsigned position) {
        std::array<std::uint32_t, 4> t{};
        for (unsigned p = 0; p < 4; ++p) {
            t[p] = w.read<std::uint32_t>(
                position, static_cast<std::uint16_t>(registers::dc_receive_time + 4 * p));
        }
        return t;
    };
    // In order of the frame: 0, 1, 3, 2.
    const auto root = times(0);
    const auto first = times(1);
    const auto leaf = times(2);
    const auto second = times(3);
    EXPECT_EQ(root[1] - root[0], 600U + 500 + 600 + 200 + 600 + 200 + 600 + 500);
    EXPECT_EQ(root[2] - root[1], 600U + 900 + 600 + 900);
    EXPECT_EQ(first[1] - first[0], 600U + 200 + 600 + 200);
    EXPECT_EQ(leaf[1], 0U);
    EXPECT_EQ(((root[1] - root[0]) - (first[1] - first[0])) / 2, 600U + 500)
        << "the delay to the first slave";
    EXPECT_EQ((root[2] - root[1]) / 2, 600U + 900) << "the delay to the second";
    EXPECT_NE(second[0], 0U);
    EXPECT_EQ(static_cast<std::uint32_t>(w.read<std::uint64_t>(3, registers::dc_receive_time_unit)),
              second[0]);
}

TEST_F(Line, Broken_cable_closes_the_ports_and_the_rest_is_silent) {
    row(4);
    w.line.power_on(0);
    EXPECT_EQ(count(), 4);
    w.line.set_cable(1, 1, false);
    EXPECT_EQ(count(), 2);
    EXPECT_EQ(w.read<std::uint16_t>(1, registers::dl_status) & 0x0c20, 0x0400)
        << "no link, loop closed";
    EXPECT_EQ(w.read<std::uint8_t>(1, registers::lost_links + 1), 1);
    w.line.set_cable(2, 0, true);
    EXPECT_EQ(count(), 4);
    EXPECT_EQ(w.read<std::uint8_t>(2, registers::lost_links), 1);
    w.line.set_power(2, false, w.now_ns);
    EXPECT_EQ(count(), 2);
    w.line.set_power(2, true, w.now_ns);
    EXPECT_EQ(count(), 4);
    EXPECT_EQ(firmware[2].starts, 2);
    w.line.set_cable(esc::End::primary, false);
    EXPECT_EQ(count(), -1) << "the master's own cable";
}

TEST_F(Line, Ring_returns_at_the_other_end_and_survives_a_break) {
    row(4);
    ASSERT_TRUE(w.line.close_ring(3, 1));
    w.line.power_on(0);
    EXPECT_EQ(count(), 4);
    EXPECT_EQ(w.out.end, esc::End::secondary);
    w.end = esc::End::secondary;
    EXPECT_EQ(count(), 0) << "no processing unit on the way back";
    EXPECT_EQ(w.out.end, esc::End::primary);
    w.line.set_cable(2, 0, false);
    EXPECT_EQ(count(), 2);
    EXPECT_EQ(w.out.end, esc::End::secondary);
    EXPECT_NE(w.frame[16 + 7] & 0x40, 0) << "circulating";
    w.write<std::uint16_t>(0, registers::station_address, 7);
    EXPECT_EQ(get<std::uint16_t>(w.line.controller(2).memory(registers::station_address)), 7)
        << "positions count from the break";
    w.end = esc::End::primary;
    EXPECT_EQ(count(), 2);
    EXPECT_EQ(w.out.end, esc::End::primary);
    w.line.set_cable(2, 0, true);
    EXPECT_EQ(count(), 4);
}

TEST_F(Line, Circulating_frame_is_destroyed) {
    row(2);
    w.line.power_on(0);
    std::array<std::uint8_t, max_frame_bytes> buffer{};
    FrameWriter writer(buffer, {1, 2, 3, 4, 5, 6});
    writer.add(Command::brd, 0, 0, 1);
    const std::size_t length = writer.finish().size();
    buffer[16 + 7] |= 0x40;
    EXPECT_FALSE(w.line.process({buffer.data(), length}, esc::End::primary, 5'000'000).lost)
        << "port 0 is open";
    w.line.close_ring(1, 1);
    w.line.set_cable(esc::End::primary, false);
    EXPECT_TRUE(w.line.process({buffer.data(), length}, esc::End::secondary, 6'000'000).lost);
}

TEST_F(Line, Auto_close_keeps_a_port_closed_until_it_is_written) {
    row(2);
    w.line.power_on(0);
    w.write<std::uint8_t>(0, registers::loop_control, 0x04);
    w.line.set_cable(0, 1, false);
    w.line.set_cable(0, 1, true);
    EXPECT_EQ(count(), 1);
    w.write<std::uint8_t>(0, registers::loop_control, 0x04);
    EXPECT_EQ(count(), 2);
    w.write<std::uint8_t>(0, registers::loop_control, 0x0c);
    EXPECT_EQ(count(), 1) << "always closed";
    w.write<std::uint8_t>(0, registers::loop_control, 0x08);
    w.line.set_cable(0, 1, false);
    EXPECT_EQ(count(), -1) << "kept open without a cable";
}

TEST_F(Line, Corrupted_frame_is_counted_and_has_no_effect_behind_the_fault) {
    row(3);
    w.line.power_on(0);
    w.line.disturb({.fault = esc::LineFault::corruption, .slave = 1, .port = 0, .count = 1});
    EXPECT_EQ(w.send(Command::bwr, at_station(0, registers::station_address), {5, 0}), -1);
    const auto counter = [&](unsigned slave, unsigned reg) {
        return *w.line.controller(slave).memory(static_cast<std::uint16_t>(reg));
    };
    EXPECT_EQ(counter(0, registers::station_address), 5) << "in front of the fault";
    EXPECT_EQ(counter(1, registers::station_address), 0);
    EXPECT_EQ(counter(1, registers::rx_errors), 1);
    EXPECT_EQ(counter(2, registers::rx_errors), 0);
    EXPECT_EQ(counter(2, registers::forwarded_errors), 1);
    EXPECT_EQ(counter(0, registers::forwarded_errors + 1), 1) << "on the way back";
    EXPECT_EQ(counter(1, registers::processing_unit_errors), 1);
    EXPECT_EQ(
        w.send(Command::bwr, at_station(0, registers::rx_errors), std::vector<std::uint8_t>(12)),
        3);
    EXPECT_EQ(counter(1, registers::rx_errors) + counter(2, registers::forwarded_errors), 0);
}

TEST_F(Line, Disturbances_hit_every_nth_frame) {
    row(1);
    w.line.power_on(0);
    const int loss = w.line.disturb({.fault = esc::LineFault::loss, .every = 3});
    int lost = 0;
    for (int i = 0; i < 9; ++i) {
        lost += count() < 0 ? 1 : 0;
    }
    EXPECT_EQ(lost, 3);
    EXPECT_EQ(w.line.hits(loss), 3U);
    w.line.calm();
    w.line.disturb({.fault = esc::LineFault::duplicate});
    w.line.disturb({.fault = esc::LineFault::delay, .delay_ns = 7000});
    EXPECT_EQ(count(), 1);
    EXPECT_EQ(w.out.copies, 2U);
    EXPECT_EQ(w.out.first_bit_ns - w.now_ns, 50 + 640 + 50 + 7000);
}

TEST_F(Line, Lost_reply_can_be_repeated_from_the_mailbox) {
    row(1);
    w.line.power_on(0);
    w.sync_manager(0, 1, 0x1080, 16, 0x22);
    auto& pdi = w.line.controller(0);
    pdi.write_sync_manager(1, std::array<std::uint8_t, 1>{9});
    w.line.disturb({.fault = esc::LineFault::loss, .count = 1});
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1080), std::vector<std::uint8_t>(16)), -1);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1080), std::vector<std::uint8_t>(16)), 0)
        << "the slave saw it read";
    EXPECT_TRUE(pdi.write_sync_manager(1, std::array<std::uint8_t, 1>{9}))
        << "the firmware puts it back";
}

TEST_F(Line, Malformed_and_foreign_frames_are_counted_and_do_no_harm) {
    row(2);
    w.line.power_on(0);
    std::array<std::uint8_t, 64> bytes{};
    for (unsigned seed = 1; seed < 3000; ++seed) {
        unsigned x = seed * 2654435761U;
        for (auto& b : bytes) {
            x = x * 1664525U + 1013904223U;
            b = static_cast<std::uint8_t>(x >> 24);
        }
        bytes[12] = 0x88;
        bytes[13] = 0xa4;

        bytes[15] = static_cast<std::uint8_t>(0x10 | (bytes[15] & 7));
        w.line.process(bytes, esc::End::primary, w.now_ns += 10'000);
    }
    bytes[12] = 8;
    bytes[13] = 6;
    EXPECT_TRUE(w.line.process(bytes, esc::End::primary, w.now_ns).lost)
        << "not EtherCAT: destroyed";
    EXPECT_GT(*w.line.controller(0).memory(registers::processing_unit_errors), 0);
}

TEST_F(Line, Posted_commands_take_effect_with_the_next_frame) {
    row(2);
    w.line.power_on(0);
    using Kind = esc::LineCommand::Kind;
    ASSERT_TRUE(w.line.post({.kind = Kind::cable, .slave = 1, .port = 0, .on = false}));
    EXPECT_EQ(count(), 1);
    w.line.post({.kind = Kind::cable, .slave = 1, .port = 0, .on = true});
    w.line.post({.kind = Kind::disturb,
                 .disturbance = {.fault = esc::LineFault::noise, .slave = 1, .count = 2}});
    w.line.post({.kind = Kind::drift, .slave = 1, .value = 25});
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(count(), 2);
    }
    EXPECT_EQ(*w.line.controller(1).memory(registers::rx_errors + 1), 2);
    EXPECT_DOUBLE_EQ(w.line.controller(1).clock().clock().drift_ppm(), 25);
    for (int i = 0; i < 64; ++i) {
        EXPECT_TRUE(w.line.post({.kind = Kind::power, .slave = 99}));
    }
    EXPECT_FALSE(w.line.post({.kind = Kind::calm}));
    EXPECT_EQ(count(), 2);
    EXPECT_TRUE(w.line.post({.kind = Kind::power, .slave = 0, .on = false}));
    EXPECT_EQ(count(), -1);
}

}  // namespace
