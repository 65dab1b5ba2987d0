// SPDX-License-Identifier: MIT
// A device on a bus: what each CiA 301 service sends, accepts and rejects. Names follow the public
// list of conformance cases.
#include "node.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

// SDO

struct Sdo : Node {};
TEST_F(Sdo, Upload_is_expedited_up_to_four_bytes) {
    EXPECT_EQ(sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}).data[0], 0x43);
    EXPECT_EQ(sdo({0x40, 0x01, 0x20, 0, 0, 0, 0, 0}).data[0], 0x4b);
    EXPECT_EQ(sdo({0x40, 0x02, 0x20, 0, 0, 0, 0, 0}).data[0], 0x4f);
    EXPECT_EQ(read(0x2000, 0), 0x12345678U);
}
TEST_F(Sdo, Aborts_name_what_is_wrong) {
    EXPECT_EQ(write(0x2fff, 0, 0, 4), Abort::no_object);
    EXPECT_EQ(write(0x2008, 9, 0, 1), Abort::no_sub);
    EXPECT_EQ(write(0x2002, 0, 0, 1), Abort::read_only);
    EXPECT_EQ(static_cast<Abort>(read(0x2003, 0)), Abort::write_only);
    EXPECT_EQ(write(0x2000, 0, 0, 2), Abort::too_short);
    EXPECT_EQ(write(0x2002 - 1, 0, 0, 4), Abort::too_long);
    EXPECT_EQ(write(0x2001, 0, 101, 2), Abort::too_high);
    EXPECT_EQ(write(0x2001, 0, static_cast<std::uint16_t>(-101), 2), Abort::too_low);
    EXPECT_EQ(write(0x2001, 0, static_cast<std::uint16_t>(-100), 2), Abort::none);
    EXPECT_EQ(static_cast<Abort>(
                  load<std::uint32_t>(sdo({0xe0, 0, 0x20, 0, 0, 0, 0, 0}).data.data() + 4)),
              Abort::command);
    EXPECT_EQ(static_cast<Abort>(
                  load<std::uint32_t>(sdo({0xa0, 6, 0x20, 0, 0, 0, 0, 0}).data.data() + 4)),
              Abort::block_size);
    EXPECT_EQ(
        static_cast<Abort>(load<std::uint32_t>(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}).data.data() + 4)),
        Abort::command);
}
TEST_F(Sdo, Toggle_bit_not_alternated_aborts) {
    EXPECT_EQ(sdo({0x40, 0x05, 0x20, 0, 0, 0, 0, 0}).data[0], 0x41);
    EXPECT_EQ(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}).data[0], 0x00);
    EXPECT_EQ(
        static_cast<Abort>(load<std::uint32_t>(sdo({0x60, 0, 0, 0, 0, 0, 0, 0}).data.data() + 4)),
        Abort::toggle);
    EXPECT_EQ(sdo({0x21, 0x05, 0x20, 0, 9, 0, 0, 0}).data[0], 0x60);
    EXPECT_EQ(
        static_cast<Abort>(load<std::uint32_t>(sdo({0x10, 1, 2, 3, 4, 5, 6, 7}).data.data() + 4)),
        Abort::toggle);
}
TEST_F(Sdo, Size_that_does_not_hold_aborts) {
    EXPECT_EQ(sdo({0x21, 0x05, 0x20, 0, 9, 0, 0, 0}).data[0], 0x60);
    EXPECT_EQ(
        static_cast<Abort>(load<std::uint32_t>(sdo({0x01, 1, 2, 3, 4, 5, 6, 7}).data.data() + 4)),
        Abort::too_short);
    EXPECT_EQ(static_cast<Abort>(
                  load<std::uint32_t>(sdo({0x21, 0x05, 0x20, 0, 41, 0, 0, 0}).data.data() + 4)),
              Abort::too_long);
}
TEST_F(Sdo, Wrong_crc_of_a_block_aborts) {
    EXPECT_EQ(sdo({0xc6, 0x06, 0x20, 0, 3, 0, 0, 0}).data[0], 0xa4);
    EXPECT_EQ(sdo({0x81, 1, 2, 3, 0, 0, 0, 0}).data[0], 0xa2);
    EXPECT_EQ(static_cast<Abort>(
                  load<std::uint32_t>(sdo({0xd1, 0xff, 0xff, 0, 0, 0, 0, 0}).data.data() + 4)),
              Abort::crc);
}
TEST_F(Sdo, Client_that_falls_silent_is_told_the_time_out) {
    EXPECT_EQ(sdo({0x40, 0x05, 0x20, 0, 0, 0, 0, 0}).data[0], 0x41);
    bus.log.clear();
    run(1100);
    const auto told = since(0x585);
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told[0].data[0], 0x80);
    EXPECT_EQ(static_cast<Abort>(load<std::uint32_t>(told[0].data.data() + 4)), Abort::timeout);
}
TEST_F(Sdo, Frames_of_another_length_and_remote_frames_are_no_requests) {
    EXPECT_EQ(sdo({0x40, 0x00, 0x20, 0}).length, 0);
    bus.log.clear();
    send(Frame::request(0x605, 8));
    EXPECT_TRUE(since(0x585).empty());
}
TEST_F(Sdo, Server_is_deaf_when_stopped) {
    nmt(stop);
    EXPECT_EQ(sdo({0x40, 0x00, 0x20, 0, 0, 0, 0, 0}).length, 0);
}

// NMT and error control

struct Nmt : Node {};
TEST_F(Nmt, Boot_up_then_every_state_as_commanded) {
    ASSERT_EQ(since(0x705).size(), 1U);
    EXPECT_EQ(since(0x705)[0].data[0], 0);
    EXPECT_EQ(device->state(), NmtState::pre_operational);
    nmt(start);
    EXPECT_EQ(device->state(), NmtState::operational);
    nmt(stop, 0);
    EXPECT_EQ(device->state(), NmtState::stopped);
    nmt(enter_pre_operational);
    EXPECT_EQ(device->state(), NmtState::pre_operational);
    nmt(start, 6);
    EXPECT_EQ(device->state(), NmtState::pre_operational);
    send({0, {0x55, 5}});
    EXPECT_EQ(device->state(), NmtState::pre_operational);
}
TEST_F(Nmt, Reset_of_communication_restores_its_parameters_and_reset_of_the_node_all) {
    write(0x1017, 0, 100, 2);
    write(0x2000, 0, 1, 4);
    bus.log.clear();
    nmt(reset_communication);
    EXPECT_EQ(since(0x705).size(), 1U);
    EXPECT_EQ(read(0x1017, 0) & 0xffff, 0U);
    EXPECT_EQ(read(0x2000, 0), 1U);
    nmt(reset_node);
    EXPECT_EQ(read(0x2000, 0), 0x12345678U);
    EXPECT_EQ(events.resets, (std::vector<bool>{false, true}));
}
TEST_F(Nmt, Stored_values_hold_after_a_reset_and_defaults_come_back) {
    write(0x2000, 0, 77, 4);
    EXPECT_EQ(write(0x1010, 1, 0x12345678, 4), Abort::cannot_store);
    EXPECT_EQ(write(0x1010, 1, 0x65766173, 4), Abort::none);
    nmt(reset_node);
    EXPECT_EQ(read(0x2000, 0), 77U);
    EXPECT_EQ(write(0x1011, 1, 0x64616f6c, 4), Abort::none);
    EXPECT_EQ(read(0x2000, 0), 77U);
    nmt(reset_node);
    EXPECT_EQ(read(0x2000, 0), 0x12345678U);
    EXPECT_EQ(events.stored + events.restored, 2);
}

struct Heartbeat : Node {};
TEST_F(Heartbeat, Producer_keeps_its_period_and_tells_the_state) {
    write(0x1017, 0, 10, 2);
    nmt(start);
    bus.log.clear();
    run(100);
    const auto beats = since(0x705);
    EXPECT_NEAR(static_cast<double>(beats.size()), 10, 1);
    for (const auto& b : beats) {
        EXPECT_EQ(b.data[0], 5);
    }
    write(0x1017, 0, 0, 2);
    bus.log.clear();
    run(50);
    EXPECT_TRUE(since(0x705).empty());
}
TEST_F(Heartbeat, Consumer_watches_from_the_first_beat_and_reports_loss_once) {
    EXPECT_EQ(write(0x1016, 1, 9 << 16 | 50, 4), Abort::none);
    EXPECT_EQ(write(0x1016, 2, 9 << 16 | 60, 4), Abort::incompatible);
    nmt(start);
    run(200);
    EXPECT_EQ(events.communication_errors, 0);
    send({0x709, {0x05}});
    run(40);
    send({0x709, {0x05}});
    run(49);
    EXPECT_EQ(events.communication_errors, 0);
    bus.log.clear();
    run(100);
    EXPECT_EQ(events.communication_errors, 1);
    EXPECT_EQ(device->state(), NmtState::pre_operational);
    ASSERT_EQ(since(0x085).size(), 1U);
    EXPECT_EQ(load<std::uint16_t>(since(0x085)[0].data.data()), 0x8130);
    send({0x709, {0x05}});
    run(1);
    EXPECT_EQ(events.nodes.back().event, NodeEvent::alive);
    EXPECT_EQ(load<std::uint16_t>(since(0x085).back().data.data()), 0);
}
TEST_F(Heartbeat, Error_behaviour_decides_the_state) {
    for (const auto& [value, state] : {std::pair{1U, NmtState::operational},
                                       {2U, NmtState::stopped},
                                       {0U, NmtState::pre_operational}}) {
        nmt(reset_node);
        write(0x1029, 1, value, 1);
        write(0x1016, 1, 9 << 16 | 50, 4);
        nmt(start);
        send({0x709, {0x05}});
        run(60);
        EXPECT_EQ(device->state(), state) << value;
    }
}
TEST_F(Heartbeat, Another_node_with_our_id_is_noticed) {
    bus.log.clear();
    send({0x705, {0x05}});
    send({0x705, {0x05}});
    run(1);
    EXPECT_EQ(events.collisions, 1);
    ASSERT_EQ(since(0x85).size(), 1U);
    EXPECT_EQ(load<std::uint16_t>(since(0x85)[0].data.data()), 0x8150);
    nmt(reset_communication);
    EXPECT_FALSE(device->emcy().active(0x8150));
    EXPECT_EQ(device->emcy().error_register(), 0);
}

struct Guarding : Node {};
TEST_F(Guarding, Answer_toggles_from_zero_and_life_guarding_notices_a_silent_master) {
    write(0x100c, 0, 10, 2);
    write(0x100d, 0, 3, 1);
    bus.log.clear();
    for (int n = 0; n < 3; ++n) {
        send(Frame::request(0x705, 1));
        run(10);
    }
    std::vector<int> seen;
    for (const auto& f : since(0x705)) {
        if (!f.remote) {
            seen.push_back(f.data[0]);
        }
    }
    EXPECT_EQ(seen, (std::vector<int>{0x7f, 0xff, 0x7f}));
    EXPECT_TRUE(events.life.empty());
    run(40);
    EXPECT_EQ(events.life, (std::vector<bool>{true}));
    EXPECT_EQ(events.communication_errors, 1);
    send(Frame::request(0x705, 1));
    EXPECT_EQ(events.life, (std::vector<bool>{true, false}));
}

// SYNC, TIME, EMCY

struct SyncService : Node {};
TEST_F(SyncService, Producer_keeps_the_grid_and_counts) {
    write(0x1019, 0, 3, 1);
    write(0x1006, 0, 2000, 4);
    EXPECT_EQ(write(0x1019, 0, 4, 1), Abort::device_state);
    EXPECT_EQ(write(0x1005, 0, 0x40000080, 4), Abort::none);
    EXPECT_EQ(write(0x1005, 0, 0x40000090, 4), Abort::value);
    bus.log.clear();
    run(9);
    std::vector<int> counters;
    for (const auto& f : since(0x80)) {
        counters.push_back(f.length == 1 ? f.data[0] : -1);
    }
    EXPECT_EQ(counters, (std::vector<int>{1, 2, 3, 1, 2}));
    nmt(stop);
    bus.log.clear();
    run(9);
    EXPECT_TRUE(since(0x80).empty());
}
TEST_F(SyncService, Unexpected_length_is_told) {
    send({0x80, {1}});
    run(1);
    ASSERT_FALSE(since(0x085).empty());
    EXPECT_EQ(load<std::uint16_t>(since(0x085)[0].data.data()), 0x8240);
    send({0x80, {}});
    run(1);
    EXPECT_EQ(load<std::uint16_t>(since(0x085).back().data.data()), 0);
}
TEST_F(SyncService, Consumer_notices_that_it_stops) {
    write(0x1006, 0, 10'000, 4);
    send({0x80, {}});
    run(14);
    EXPECT_EQ(events.syncs_lost, 0);
    run(50);
    EXPECT_EQ(events.syncs_lost, 1);
}
TEST_F(SyncService, Time_stamp_is_consumed_and_produced) {
    send({0x100, {0x78, 0x56, 0x34, 0xf2, 0x10, 0x27}});
    ASSERT_EQ(events.times.size(), 1U);
    EXPECT_EQ(events.times[0].milliseconds, 0x2345678U);
    EXPECT_EQ(events.times[0].days, 10000);
    EXPECT_FALSE(device->time().produce({}));
    write(0x1012, 0, 0x40000100, 4);
    bus.log.clear();
    EXPECT_TRUE(device->time().produce({5, 6}));
    run(0);
    EXPECT_EQ(since(0x100).at(0).length, 6);
}

struct EmcyService : Node {};
TEST_F(EmcyService, History_keeps_the_newest_first_and_is_cleared_by_zero) {
    device->emcy().raise(0x2310, error_current, {1, 2, 3, 4, 5});
    device->emcy().raise(0x3110, error_voltage);
    device->emcy().raise(0x3110, error_voltage);
    run(1);
    const auto told = since(0x085);
    ASSERT_EQ(told.size(), 2U);
    EXPECT_EQ(told[0].data[2], 0x03);
    EXPECT_EQ(told[0].data[7], 5);
    EXPECT_EQ(told[1].data[2], 0x07);
    EXPECT_EQ(read(0x1003, 0) & 0xff, 2U);
    EXPECT_EQ(read(0x1003, 1) & 0xffff, 0x3110U);
    EXPECT_EQ(read(0x1003, 2) & 0xffff, 0x2310U);
    EXPECT_EQ(write(0x1003, 0, 1, 1), Abort::value);
    EXPECT_EQ(write(0x1003, 0, 0, 1), Abort::none);
    EXPECT_EQ(read(0x1003, 0) & 0xff, 0U);
    device->emcy().clear(0x2310);
    run(1);
    EXPECT_EQ(since(0x085).back().data[2], 0x05);
    EXPECT_EQ(read(0x1001, 0) & 0xff, 0x05U);
}
TEST_F(EmcyService, Inhibit_time_keeps_them_apart_and_bit_31_keeps_them_in) {
    EXPECT_EQ(write(0x1014, 0, 0x80000085, 4), Abort::none);
    EXPECT_EQ(write(0x1015, 0, 100, 2), Abort::none);  // 10 ms
    device->emcy().raise(0x1000, error_generic);
    run(1);
    EXPECT_TRUE(since(0x085).empty());
    EXPECT_EQ(write(0x1014, 0, 0x85, 4), Abort::none);
    EXPECT_EQ(write(0x1014, 0, 0x86, 4), Abort::value);
    bus.log.clear();
    device->emcy().raise(0x2000, error_current);
    device->emcy().raise(0x3000, error_voltage);
    run(8);
    EXPECT_EQ(since(0x085).size(), 1U);
    run(3);
    EXPECT_EQ(since(0x085).size(), 2U);
}
TEST_F(EmcyService, Consumer_hears_those_of_1028h) {
    send({0x087, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5}});
    EXPECT_TRUE(events.emergencies.empty());
    EXPECT_EQ(write(0x1028, 2, 0x87, 4), Abort::none);
    send({0x087, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5}});
    ASSERT_EQ(events.emergencies.size(), 1U);
    EXPECT_EQ(events.emergencies[0].second.code, 0x8110);
    EXPECT_STREQ(emergency_text(0x8110), "CAN overrun (objects lost)");
}

}  // namespace
}  // namespace hal::canopen::test
