// SPDX-License-Identifier: MIT
#include "mesa/lbp16/packet.hpp"
#include "mesa/lbp16/spaces.hpp"
#include "tests/unit/bytes_text.hpp"

namespace hal::mesa {
namespace {

using test::from_hex;
using test::hex;

std::string read_bytes(Space space, std::uint16_t address, Unit unit, std::size_t count) {
    Request request;
    EXPECT_EQ(request.read(space, address, unit, count), 0U);
    EXPECT_EQ(request.reply_size(), count * bytes_of(unit));
    return hex(request.bytes());
}
std::string written(Space space, std::uint16_t address, Unit unit, const std::string& data) {
    Request request;
    EXPECT_EQ(request.write(space, address, unit, from_hex(data)), 4U);
    EXPECT_EQ(request.reply_size(), 0U);
    return hex(request.bytes());
}

TEST(Lbp16, Reads_are_the_bytes_seen_on_the_wire) {
    EXPECT_EQ(read_bytes(Space::eeprom, eeprom::mac, Unit::u16, 3), "83 49 02 00");
    EXPECT_EQ(read_bytes(Space::card, card::name, Unit::u16, 8), "88 5D 00 00");
    EXPECT_EQ(read_bytes(Space::hostmot2, 0x0100, Unit::u32, 1), "81 42 00 01");
    EXPECT_EQ(read_bytes(Space::timers, timers::read_count, Unit::u16, 4), "84 51 10 00");
    Request fixed;
    fixed.read(Space::status, status::received_packets, Unit::u16, 1, false);
    EXPECT_EQ(hex(fixed.bytes()), "01 59 08 00");
}

TEST(Lbp16, Writes_are_the_bytes_seen_on_the_wire) {
    EXPECT_EQ(written(Space::hostmot2, 0x2000, Unit::u32,
                      "01 00 00 00 02 00 00 00 03 00 00 00 04 00 00 00")
                  .substr(0, 11),
              "84 C2 00 20");
    EXPECT_EQ(written(Space::timers, timers::read_count, Unit::u16, "05 00 00 00"),
              "82 D1 10 00 05 00 00 00");
    EXPECT_EQ(written(Space::hostmot2, 0x0c00, Unit::u32, "01 00 00 00"),
              "81 C2 00 0C 01 00 00 00");
}

TEST(Lbp16, Information_area_is_read_as_eight_words) {
    Request request;
    EXPECT_EQ(request.read_information(Space::ethernet_chip), 0U);
    EXPECT_EQ(hex(request.bytes()), "88 65 00 00");
    EXPECT_EQ(request.reply_size(), 16U);
}

TEST(Lbp16, One_datagram_pets_the_watchdog_and_reads_two_ports) {
    Request request;
    const auto value = request.write32(0x0e00, 0);
    const auto ports = request.read(Space::hostmot2, 0x1000, Unit::u32, 2);
    ASSERT_TRUE(value && ports);
    request.set(*value, std::uint32_t{0x5a000000});
    EXPECT_EQ(hex(request.bytes()), "81 C2 00 0E 00 00 00 5A 82 42 00 10");
    EXPECT_EQ(*ports, 0U);
    EXPECT_EQ(request.reply_size(), 8U);
}

TEST(Lbp16, Every_word_of_a_command_is_decoded_to_itself) {
    for (unsigned word = 0; word <= 0xffff; ++word) {
        EXPECT_EQ(word_of(command_of(static_cast<std::uint16_t>(word))), word);
    }
}

TEST(Lbp16, Long_read_is_split_and_its_data_is_in_one_piece) {
    Request request;
    request.read(Space::hostmot2, 0x0100, Unit::u32);
    EXPECT_EQ(request.read(Space::hostmot2, 0x0600, Unit::u32, 200), 4U);
    RequestReader reader(request.bytes());
    Command command;
    std::span<const std::uint8_t> data;
    ASSERT_EQ(reader.next(command, data), RequestReader::Next::command);
    ASSERT_EQ(reader.next(command, data), RequestReader::Next::command);
    EXPECT_EQ(command.count, 127);
    ASSERT_EQ(reader.next(command, data), RequestReader::Next::command);
    EXPECT_EQ(command.count, 73);
    EXPECT_EQ(command.address, 0x0600 + 127 * 4);
    EXPECT_EQ(reader.next(command, data), RequestReader::Next::end);
}

TEST(Lbp16, Request_that_would_be_too_long_is_unchanged) {
    Request request;
    EXPECT_FALSE(request.read(Space::hostmot2, 0, Unit::u32, 351));
    EXPECT_TRUE(request.read(Space::hostmot2, 0, Unit::u32, 350));
    EXPECT_FALSE(request.read(Space::hostmot2, 0, Unit::u8, 1));
    const std::size_t size = request.size();
    const std::vector<std::uint8_t> data(127 * 4);
    EXPECT_TRUE(request.write(Space::hostmot2, 0, Unit::u32, data));
    EXPECT_TRUE(request.write(Space::hostmot2, 0, Unit::u32, data));
    EXPECT_FALSE(request.write(Space::hostmot2, 0, Unit::u32, data));
    EXPECT_EQ(request.size(), size + 2 * (4 + data.size()));
    EXPECT_FALSE(request.write(Space::hostmot2, 0, Unit::u32, std::span(data).first(3)));
    EXPECT_FALSE(request.write(Space::hostmot2, 0, Unit::u32, {}));
}

TEST(Lbp16, Appended_request_has_the_commands_of_both) {
    Request reads;
    ASSERT_TRUE(reads.read(Space::hostmot2, 0x100, Unit::u32, 2));
    Request request;
    ASSERT_TRUE(request.write32(0x2000, 5));
    EXPECT_TRUE(request.append(reads));
    EXPECT_EQ(request.size(), 12U);
    EXPECT_EQ(request.reply_size(), 8U);
    EXPECT_EQ(hex(request.bytes().last(4)), hex(reads.bytes()));
    while (request.write32(0x2000, 5)) {
    }
    EXPECT_EQ(request.size(), max_datagram - 4);
    EXPECT_TRUE(request.append(reads));
    EXPECT_FALSE(request.append(reads));
    EXPECT_EQ(request.size(), max_datagram);
    EXPECT_EQ(request.reply_size(), 16U);
}

TEST(Lbp16, Every_cut_request_is_malformed_at_its_last_command) {
    const auto whole = from_hex("81 C2 00 0E 00 00 00 5A 82 42 00 10");
    for (std::size_t size = 0; size <= whole.size(); ++size) {
        const std::span cut(whole.data(), size);
        RequestReader reader(cut);
        Command command;
        std::span<const std::uint8_t> data;
        const auto first = reader.next(command, data);
        if (size < 8) {
            EXPECT_EQ(first, size == 0 ? RequestReader::Next::end : RequestReader::Next::malformed);
            continue;
        }
        EXPECT_EQ(first, RequestReader::Next::command);
        EXPECT_EQ(data.size(), 4U);
        const auto second = reader.next(command, data);
        if (size == 8) {
            EXPECT_EQ(second, RequestReader::Next::end);
        } else {
            EXPECT_EQ(second, size == whole.size() ? RequestReader::Next::command
                                                   : RequestReader::Next::malformed);
        }
    }
}

TEST(Lbp16, Command_of_no_units_is_malformed) {
    const auto bytes = from_hex("80 42 00 01");
    RequestReader reader(bytes);
    Command command;
    std::span<const std::uint8_t> data;
    EXPECT_EQ(reader.next(command, data), RequestReader::Next::malformed);
    EXPECT_EQ(reader.next(command, data), RequestReader::Next::end);
}

TEST(Lbp16, Information_area_comes_back_as_it_went) {
    Information area;
    area.space = Space::timers;
    area.is_writable = true;
    area.kind = Information::Kind::memory;
    area.units = 0x2;
    area.range = 0x20;
    area.name = {'L', 'B', 'P', 't', 'i', 'm', 'e', 'r'};
    const auto bytes = area.encode();
    EXPECT_EQ(hex(bytes), "04 5A 02 82 20 00 00 00 4C 42 50 74 69 6D 65 72");
    EXPECT_EQ(Information::decode(bytes), area);
    EXPECT_EQ(area.name_text(), "LBPtimer");
    EXPECT_FALSE(Information::decode(std::span(bytes).first(15)));
    auto wrong = bytes;
    wrong[1] = 0x5b;
    EXPECT_FALSE(Information::decode(wrong));
}

TEST(Lbp16, Mac_is_reversed_in_the_eeprom) {
    const std::array<std::uint8_t, 6> bytes{0x06, 0x05, 0x04, 0x1b, 0x60, 0x00};
    EXPECT_EQ(hex(reversed_mac(bytes)), "00 60 1B 04 05 06");
}

}  // namespace
}  // namespace hal::mesa
