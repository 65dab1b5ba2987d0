// SPDX-License-Identifier: MIT
// Smart serial of the emulated card: found as LinuxCNC's driver finds it, then exchanged with.
#include <map>

#include "mesa/card/emulated_card.hpp"
#include "mesa/hostmot2/smart_serial.hpp"
#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa {
namespace {

using namespace smart_serial;

constexpr std::int64_t ms = 1'000'000;

/// The smart-serial port of a 7i76e with one device, on channel 0.
class Serial : public testing::Test {
protected:
    std::uint32_t read(unsigned reg) {
        return card_.read(static_cast<std::uint16_t>(0x5b00 + reg * 0x100));
    }
    void write(unsigned reg, std::uint32_t value) {
        card_.write(static_cast<std::uint16_t>(0x5b00 + reg * 0x100), value);
    }
    /// Gives a command and waits until it is done, without time.
    void order(std::uint32_t value) {
        write(command, value);
        for (int n = 0; n < 10 && read(command) != 0; ++n) {
        }
        EXPECT_EQ(read(command), 0U);
    }
    std::uint8_t remote_byte(std::uint16_t address) {
        write(control_status, remote::request(remote::read_byte, address));
        EXPECT_EQ(read(control_status) & 0xff00, 0U) << "the status, not what was written";
        order(port::do_it | 1);
        EXPECT_EQ(read(data), 0U);
        return static_cast<std::uint8_t>(read(user));
    }
    std::uint16_t remote_word(std::uint16_t address) {
        return static_cast<std::uint16_t>(
            remote_byte(address) | remote_byte(static_cast<std::uint16_t>(address + 1)) << 8);
    }
    std::vector<std::uint8_t> remote_bytes(std::uint16_t address, std::uint16_t count) {
        std::vector<std::uint8_t> bytes;
        for (std::uint16_t n = 0; n < count; ++n) {
            bytes.push_back(remote_byte(static_cast<std::uint16_t>(address + n)));
        }
        return bytes;
    }
    void set_up() {
        order(port::reset);
        order(port::clear);
        order(port::stop_all);
        write(control_status, 0);
        order(port::start_setup | 1);
    }

    const CardReadResult read_ = read_card(
        "[card]\ntype = 7i76e\n[input stop]\nterminal = remote 0 31\n"
        "[output coolant]\nterminal = remote 0 3\n[spindle s]\ndrive = remote 0\n"
        "max-speed = 1000\ntime-constant = 1ms\n",
        "serial.mesa");
    EmulatedCard card_{read_.card, {}};
};

TEST_F(Serial, Version_and_baud_rate_are_local_bytes) {
    order(port::reset);
    order(port::read_local | local::version);
    EXPECT_EQ(read(data), 43U);
    order(port::read_local | local::channels);
    EXPECT_EQ(read(data), 2U);
    order(port::read_local | local::channel_offset);
    const std::uint32_t offset = read(data);
    std::uint32_t baud = 0;
    for (std::uint32_t n = 0; n < 4; ++n) {
        order(port::read_local | (offset + 42 + n));
        baud |= read(data) << 8 * n;
    }
    EXPECT_EQ(baud, 2'500'000U);
}

TEST_F(Serial, Device_describes_its_process_data) {
    set_up();
    EXPECT_EQ(read(user + 1), 0x36374937U) << "7I76";
    const std::uint32_t tables = read(user + 2);
    std::map<std::string, Record> records;
    unsigned bits_out = 0;
    for (auto at = static_cast<std::uint16_t>(tables); remote_word(at) != 0; at += 2) {
        const auto record = decode_record(remote_bytes(remote_word(at), 40));
        ASSERT_TRUE(record);
        records[record->name] = *record;
        if (record->direction == Direction::out) {
            bits_out += record->bits;
        }
    }
    EXPECT_EQ(records.size(), 6U);
    EXPECT_EQ(bits_out, 32U);
    EXPECT_EQ(records["SpinOut"].max, 100.0F);
    EXPECT_EQ(records["Input"].bits, 32);
    const auto globals = static_cast<std::uint16_t>(tables >> 16);
    EXPECT_EQ(decode_record(remote_bytes(remote_word(globals), 40))->name, "SwRevision");
    const std::uint16_t mode = remote_word(static_cast<std::uint16_t>(globals + 2));
    EXPECT_EQ(decode_mode(remote_bytes(mode, 40))->name, "Standard");
}

TEST_F(Serial, Process_data_reach_the_machine_and_come_from_it) {
    card_.advance(0);
    order(port::start | 1);
    card_.set_input(0, true);
    for (std::int64_t n = 1; n <= 30; ++n) {
        write(user, 0x017f8009);  // outputs 0, 3, 15; half of the speed
        write(command, port::do_it | 1);
        card_.advance(n * ms);
        EXPECT_EQ(read(command), 0U);
        EXPECT_EQ(read(data), 0U);
    }
    EXPECT_EQ(read(user), 0x80000000U);
    EXPECT_TRUE(card_.output(0));
    EXPECT_NEAR(card_.plant().rpm(0), 498.0, 1.0);
    card_.advance(95 * ms);
    EXPECT_FALSE(card_.output(0)) << "the watchdog of the device";
    EXPECT_NEAR(card_.plant().rpm(0), 0.0, 1.0);
}

TEST_F(Serial, Lost_device_is_reported_in_data_and_status) {
    card_.advance(0);
    order(port::start | 1);
    card_.set_remotes_lost(true);
    order(port::do_it | 1);
    EXPECT_EQ(read(data), 1U);
    EXPECT_NE(read(control_status) & communication_error, 0U);
    card_.set_remotes_lost(false);
    order(port::do_it | 1);
    EXPECT_EQ(read(data), 0U);
    EXPECT_EQ(read(control_status), 0U);
}

TEST_F(Serial, Channel_without_a_device_has_no_tables) {
    set_up();
    order(port::start_setup | 3);
    EXPECT_NE(read(user + 2), 0U);
    EXPECT_EQ(card_.read(0x5b00 + (user + 2) * 0x100 + 4), 0U);
}

TEST_F(Serial, Stopped_channel_is_an_error_of_an_exchange) {
    order(port::stop_all);
    order(port::do_it | 1);
    EXPECT_EQ(read(data), 1U);
    order(port::ignored | port::start | 1);
    order(port::do_it | 1);
    EXPECT_EQ(read(data), 1U);
}

}  // namespace
}  // namespace hal::mesa
