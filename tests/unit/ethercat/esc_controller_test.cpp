// SPDX-License-Identifier: MIT
#include "tests/unit/ethercat/esc_world.hpp"

namespace {

using namespace esc_world;

struct Controller : testing::Test {
    World w;
    std::array<Firmware, 3> firmware;
    void SetUp() override {
        for (std::size_t i = 0; i < firmware.size(); ++i) {
            ASSERT_EQ(w.line.add({.sii = image(static_cast<std::uint16_t>(10 + i)),
                                  .application = &firmware[i]}),
                      static_cast<int>(i));
        }
        w.line.power_on(0);
    }
};

TEST_F(Controller, Broadcast_read_counts_the_slaves_and_ors_their_data) {
    EXPECT_EQ(w.send(Command::brd, 0, {0, 0}), 3);
    EXPECT_EQ(w.data[0], 0x11);
    EXPECT_EQ(get<std::uint16_t>(w.frame.data() + 18), 3) << "the position counts the slaves";
    EXPECT_EQ(w.frame[6], 0x12) << "bit 1 of the source address is set";
    w.write<std::uint16_t>(1, registers::station_address, 0x1000);
    w.write<std::uint16_t>(2, registers::station_address, 0x0002);
    EXPECT_EQ(w.send(Command::brd, at_station(0, registers::station_address), {0, 0}), 3);
    EXPECT_EQ(get<std::uint16_t>(w.data.data()), 0x1002);
}

TEST_F(Controller, Working_counter_follows_the_command) {
    for (unsigned i = 0; i < 3; ++i) {
        w.write<std::uint16_t>(i, registers::station_address,
                               static_cast<std::uint16_t>(0x1001 + i));
    }
    const std::uint16_t memory = 0x1000;
    EXPECT_EQ(w.send(Command::nop, 0, {0}), 0);
    EXPECT_EQ(w.send(Command::aprd, at_position(2, memory), {0}), 1);
    EXPECT_EQ(w.send(Command::aprd, at_position(3, memory), {0}), 0) << "no fourth slave";
    EXPECT_EQ(w.send(Command::apwr, at_position(2, memory), {7}), 1);
    EXPECT_EQ(w.send(Command::aprw, at_position(2, memory), {9}), 3);
    EXPECT_EQ(w.data[0], 7) << "the old value is read";
    EXPECT_EQ(w.send(Command::fprd, at_station(0x1003, memory), {0}), 1);
    EXPECT_EQ(w.data[0], 9);
    EXPECT_EQ(w.send(Command::fpwr, at_station(0x1003, memory), {1}), 1);
    EXPECT_EQ(w.send(Command::fprw, at_station(0x1003, memory), {2}), 3);
    EXPECT_EQ(w.send(Command::brd, at_station(0, memory), {0}), 3);
    EXPECT_EQ(w.send(Command::bwr, at_station(0, memory), {4}), 3);
    EXPECT_EQ(w.send(Command::brw, at_station(0, memory), {1}), 9);
    EXPECT_EQ(w.data[0], 5) << "the value sent, or the values read";
    EXPECT_EQ(w.send(Command::fpwr, at_station(0x1002, memory), {0x22}), 1);
    EXPECT_EQ(w.send(Command::frmw, at_station(0x1002, memory), {0}), 3)
        << "one reads, the others write";
    EXPECT_EQ(w.read<std::uint8_t>(2, memory), 0x22);
    EXPECT_EQ(w.read<std::uint8_t>(0, memory), 0) << "in front of the slave that reads";
    EXPECT_EQ(w.send(Command::armw, at_position(1, memory), {0}), 3);
    EXPECT_EQ(w.send(Command::fprd, at_station(0x1009, memory), {0}), 0);
}

TEST_F(Controller, Alias_addresses_a_slave_once_enabled) {
    EXPECT_EQ(w.read<std::uint16_t>(1, registers::station_alias), 11);
    EXPECT_EQ(w.send(Command::fprd, at_station(11, 0), {0}), 0);
    EXPECT_EQ(w.send(Command::bwr, at_station(0, registers::dl_alias_enable), {1}), 3);
    EXPECT_EQ(w.send(Command::fprd, at_station(11, 0), {0}), 1);
}

TEST_F(Controller, Registers_of_identification_are_read_only) {
    EXPECT_EQ(w.send(Command::bwr, at_station(0, 0), {0xff, 0xff, 0xff, 0xff, 0xff}), 3);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0), 0x11);
    EXPECT_EQ(w.read<std::uint8_t>(0, registers::fmmus), 8);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::features),
              registers::dc_supported | registers::dc_64_bit);
    EXPECT_EQ(w.read<std::uint8_t>(0, registers::port_descriptor), 0x0f);
}

TEST_F(Controller, Al_control_waits_for_the_firmware_and_al_status_raises_an_event) {
    w.send(Command::bwr, at_station(0, registers::ecat_event_mask), {0x08, 0});
    w.read<std::uint16_t>(0, registers::al_status);
    w.write<std::uint16_t>(0, registers::al_control, 0x02);
    EXPECT_EQ(w.send(Command::nop, 0, {0}), 0);
    EXPECT_EQ(w.event, 0x08);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status), 2);
    w.send(Command::nop, 0, {0});
    EXPECT_EQ(w.event & 0x08, 0) << "cleared by reading the status";
    firmware[0].follow = false;
    w.write<std::uint16_t>(0, registers::al_control, 0x04);
    w.write<std::uint16_t>(0, registers::al_control, 0x01);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_control), 4)
        << "not accepted before the firmware has read the request";
    EXPECT_EQ(w.read<std::uint32_t>(0, registers::al_event) & 1, 1U);
}

TEST(ControllerAlone, Device_emulation_follows_al_control) {
    World w;
    w.line.add({.sii = image(0, true)});
    w.line.power_on(0);
    w.write<std::uint16_t>(0, registers::al_control, 0x14);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status), 4) << "without the acknowledge bit";
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status_code), 0);
}

TEST_F(Controller, Buffered_sync_manager_exchanges_at_the_end_of_the_frame) {
    w.sync_manager(0, 2, 0x1100, 4, 0x64);
    w.sync_manager(0, 3, 0x1200, 4, 0x20);
    firmware[0].input = {1, 2, 3, 4};
    std::vector<World::Item> items{{Command::apwr, at_position(0, 0x1100), {9, 8, 7, 6}},
                                   {Command::aprd, at_position(0, 0x0815), {0}}};
    EXPECT_TRUE(w.send(items));
    EXPECT_EQ(items[0].wkc, 1);
    EXPECT_EQ(items[1].data[0], 0x30) << "nothing is written yet";
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x0815) & 0x31, 0x01)
        << "buffer 0, not yet read by the firmware";
    std::array<std::uint8_t, 4> got{};
    auto& pdi = w.line.controller(0);
    EXPECT_EQ(pdi.read_sync_manager(2, got), 4U);
    EXPECT_EQ(got[0], 9);
    EXPECT_EQ(pdi.read_sync_manager(2, got), 0U) << "nothing new";
    EXPECT_EQ(w.read<std::uint32_t>(0, 0x1200), 0x04030201U);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1100), {0, 0, 0, 0}), 0) << "wrong direction";
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1202), {0, 0}), 0)
        << "not opened at its first byte";
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1200), {0, 0}), 1);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1202), {0, 0}), 1) << "now it is open";
    w.write<std::uint16_t>(0, registers::sync_manager_at(2), 0x1f00);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::sync_manager_at(2)), 0x1100)
        << "settings stay while it is enabled";
}

TEST_F(Controller, Mailbox_is_locked_until_the_other_side_has_read_it) {
    w.sync_manager(0, 0, 0x1000, 16, 0x26);
    w.sync_manager(0, 1, 0x1080, 16, 0x22);
    auto& pdi = w.line.controller(0);
    std::vector<std::uint8_t> message(16, 0x55);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1080), std::vector<std::uint8_t>(16)), 0)
        << "empty";
    EXPECT_EQ(w.send(Command::apwr, at_position(0, 0x1000), message), 1);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x0805) & 8, 8);
    EXPECT_EQ(w.send(Command::apwr, at_position(0, 0x1000), message), 0) << "full";
    std::array<std::uint8_t, 16> got{};
    EXPECT_EQ(pdi.read_sync_manager(0, got), 16U);
    EXPECT_EQ(got[15], 0x55);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x0805) & 8, 0);
    EXPECT_TRUE(pdi.write_sync_manager(1, std::array<std::uint8_t, 3>{1, 2, 3}));
    EXPECT_FALSE(pdi.write_sync_manager(1, std::array<std::uint8_t, 3>{4, 5, 6}));
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x080d), 8);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1080), std::vector<std::uint8_t>(10)), 1)
        << "a part does not free it";
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x080d) & 8, 8);
    EXPECT_EQ(w.send(Command::aprd, at_position(0, 0x1080), std::vector<std::uint8_t>(16)), 1);
    EXPECT_EQ(w.data[2], 3);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x080d) & 8, 0);
    w.write<std::uint8_t>(0, 0x080e, 0x03);
    EXPECT_TRUE(pdi.sync_manager(1).repeat_request);
    pdi.acknowledge_repeat(1);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x080f), 0x02);
}

TEST_F(Controller, Fmmus_map_bytes_and_bits_and_count_once_for_each_direction) {
    w.sync_manager(0, 2, 0x1100, 2, 0x24);
    w.sync_manager(0, 3, 0x1200, 2, 0x20);
    w.fmmu(0, 0, {.logical = 0x10000, .length = 2, .physical = 0x1100, .type = 2});
    w.fmmu(0, 1, {.logical = 0x10002, .length = 2, .physical = 0x1200, .type = 1});
    w.sync_manager(1, 2, 0x1100, 1, 0x24);
    w.sync_manager(1, 3, 0x1200, 1, 0x20);
    w.fmmu(1, 0,
           {.logical = 0x10004,
            .length = 1,
            .start = 2,
            .stop = 4,
            .physical = 0x1100,
            .bit = 0,
            .type = 2});
    w.fmmu(1, 1,
           {.logical = 0x10004,
            .length = 2,
            .start = 6,
            .stop = 1,
            .physical = 0x1200,
            .bit = 1,
            .type = 1});
    firmware[0].input = {0xaa, 0xbb};
    w.send(Command::nop, 0, {0});
    w.send(Command::nop, 0, {0});
    w.send(Command::nop, 0, {0});
    *w.line.controller(1).memory(0x1200) = 0x1e;
    EXPECT_EQ(w.send(Command::lrw, 0x10000, {1, 2, 0, 0, 0x14, 0}), 6);
    EXPECT_EQ(w.data, (std::vector<std::uint8_t>{1, 2, 0xaa, 0xbb, 0xd4, 0x03}))
        << "bits 6 to 9 of the byte pair are read";
    EXPECT_EQ(*w.line.controller(1).memory(0x1100), 0x05);
    std::array<std::uint8_t, 2> got{};
    EXPECT_EQ(w.line.controller(0).read_sync_manager(2, got), 2U);
    EXPECT_EQ(got[1], 2);
    EXPECT_EQ(w.send(Command::lrd, 0x10002, {0, 0}), 1);
    EXPECT_EQ(w.send(Command::lwr, 0x10000, {3, 4}), 1);
    EXPECT_EQ(w.send(Command::lrw, 0x20000, {0}), 0);
}

TEST_F(Controller, Zeroing_everything_by_broadcast_disables_sync_managers_and_fmmus) {
    w.sync_manager(0, 2, 0x1100, 2, 0x24);
    w.fmmu(0, 0, {.logical = 0, .length = 2, .physical = 0x1100, .type = 2});
    EXPECT_EQ(w.send(Command::bwr, at_station(0, registers::fmmu), std::vector<std::uint8_t>(256)),
              3);
    EXPECT_EQ(w.send(Command::bwr, at_station(0, registers::sync_manager),
                     std::vector<std::uint8_t>(128)),
              3);
    EXPECT_EQ(w.send(Command::lwr, 0, {1, 2}), 0);
    EXPECT_FALSE(w.line.controller(0).sync_manager(2).enabled);
    EXPECT_EQ(w.send(Command::bwr, at_station(0, 0x0300), std::vector<std::uint8_t>(20)), 3);
}

TEST_F(Controller, Eeprom_reads_writes_and_reports_its_errors) {
    const auto command = [&](std::uint16_t control, std::uint32_t address) {
        std::vector<std::uint8_t> b(6);
        put(&b[0], control);
        put(&b[2], address);
        EXPECT_EQ(w.send(Command::apwr, at_position(0, registers::eeprom_control), b), 1);
    };
    const auto wait = [&] {
        int polls = 0;
        while ((w.read<std::uint16_t>(0, registers::eeprom_control) & 0x8000) != 0) {
            ++polls;
        }
        return polls;
    };
    w.gap_ns = 20'000;
    command(0x0100, 8);
    EXPECT_GE(wait(), 1) << "busy at first";
    EXPECT_EQ(w.read<std::uint64_t>(0, registers::eeprom_data), 0x0000'1234'0000'005aU);
    w.write<std::uint16_t>(0, registers::eeprom_data, 0xbeef);
    command(0x0200, 0x20);
    wait();
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_control) & 0x4000, 0x4000)
        << "write enable is missing";
    command(0x0201, 0x20);
    wait();
    command(0x0100, 0x20);
    wait();
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_control) & 0x2000, 0x2000)
        << "the chip is still writing";
    w.now_ns += 5'000'000;
    command(0x0100, 0x20);
    wait();
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_control) & 0x7800, 0);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_data), 0xbeef);
    command(0x0100, 0x1000);
    wait();
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_data), 0xffff) << "beyond the end";
    w.line.controller(0).eeprom().damage(true);
    w.line.set_power(0, false, w.now_ns);
    w.line.set_power(0, true, w.now_ns);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::eeprom_control) & 0x0800, 0x0800);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::dl_status) & 1, 0) << "no PDI without EEPROM";
}

TEST_F(Controller, Watchdog_expires_without_process_data) {
    firmware[0].trips = true;
    w.sync_manager(0, 2, 0x1100, 1, 0x64);
    w.write<std::uint16_t>(0, registers::al_control, 8);
    w.send(Command::apwr, at_position(0, 0x1100), {1});
    w.now_ns += 98'000'000;
    w.send(Command::apwr, at_position(0, 0x1100), {1});
    EXPECT_EQ(w.read<std::uint8_t>(0, registers::watchdog_status), 1);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status), 8);
    w.now_ns += 101'000'000;
    EXPECT_EQ(w.read<std::uint8_t>(0, registers::watchdog_status), 0);
    EXPECT_EQ(w.read<std::uint8_t>(0, registers::process_data_watchdog_counter), 1);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status), 0x14);
    EXPECT_EQ(w.read<std::uint16_t>(0, registers::al_status_code), 0x1b);
}

}  // namespace
