// SPDX-License-Identifier: MIT
// SDO 01 to 30 and OD 01 to 09 of the conformance test, against our device.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

struct ConformanceSdo : Conformance {
    /// Segmented download of up to seven bytes.
    Abort segmented(std::uint16_t index, std::uint32_t value, std::uint8_t size) {
        const auto begun = sdo({0x21, static_cast<std::uint8_t>(index),
                                static_cast<std::uint8_t>(index >> 8), 0, size, 0, 0, 0});
        if (begun.data[0] != 0x60) return abort_of(begun);
        Frame segment(0x605, {static_cast<std::uint8_t>((7 - size) << 1 | 1), 0, 0, 0, 0, 0, 0, 0});
        store(segment.data.data() + 1, value);
        bus.log.clear();
        send(segment);
        const auto answers = since(0x585);
        return answers.size() == 1 && answers[0].data[0] == 0x20 ? Abort::none : Abort::general;
    }
    /// Block download of up to seven bytes.
    Abort block(std::uint16_t index, std::uint32_t value, std::uint8_t size, bool crc) {
        const auto begun =
            sdo({static_cast<std::uint8_t>(crc ? 0xc6 : 0xc2), static_cast<std::uint8_t>(index),
                 static_cast<std::uint8_t>(index >> 8), 0, size, 0, 0, 0});
        if (begun.data[0] != 0xa4) return abort_of(begun);
        std::uint8_t bytes[8] = {0x81};
        store(bytes + 1, value);
        bus.log.clear();
        send({0x605, std::span<const std::uint8_t>(bytes)});
        const auto taken = since(0x585);
        if (taken.size() != 1 || taken[0].data[0] != 0xa2 || taken[0].data[1] != 1) {
            return Abort::sequence;
        }
        const auto sum = crc16({bytes + 1, size});
        const auto end = sdo({static_cast<std::uint8_t>(0xc1 | (7 - size) << 2),
                              static_cast<std::uint8_t>(crc ? sum : 0),
                              static_cast<std::uint8_t>(crc ? sum >> 8 : 0), 0, 0, 0, 0, 0});
        return end.data[0] == 0xa1 ? Abort::none : abort_of(end);
    }
    /// Upload by segments; empty when something is wrong on the way.
    std::string upload(std::uint16_t index) {
        const auto begun = sdo({0x40, static_cast<std::uint8_t>(index),
                                static_cast<std::uint8_t>(index >> 8), 0, 0, 0, 0, 0});
        if (begun.data[0] != 0x41) {
            return {};
        }
        const auto size = load<std::uint32_t>(begun.data.data() + 4);
        std::string text;
        for (std::uint8_t toggle = 0;; toggle ^= 0x10) {
            const auto f = sdo({static_cast<std::uint8_t>(0x60 | toggle), 0, 0, 0, 0, 0, 0, 0});
            if ((f.data[0] & 0xf0) != toggle || f.length != 8) {
                return {};
            }
            text.append(f.data.begin() + 1, f.data.begin() + 8 - (f.data[0] >> 1 & 7));
            if ((f.data[0] & 1) != 0) return text.size() == size ? text : "";
        }
    }
    std::string block_upload(std::uint16_t index, bool crc) {
        const auto begun =
            sdo({static_cast<std::uint8_t>(crc ? 0xa4 : 0xa0), static_cast<std::uint8_t>(index),
                 static_cast<std::uint8_t>(index >> 8), 0, 20, 0, 0, 0});
        if ((begun.data[0] & 0xe3) != 0xc2) {
            return {};
        }
        EXPECT_EQ((begun.data[0] & 4) != 0, true) << "the server offers the CRC";
        const auto size = load<std::uint32_t>(begun.data.data() + 4);
        bus.log.clear();
        send({0x605, {0xa3, 0, 0, 0, 0, 0, 0, 0}});
        run(0);
        std::string text;
        const auto segments = since(0x585);
        for (std::size_t n = 0; n < segments.size(); ++n) {
            EXPECT_EQ(segments[n].data[0] & 0x7f, n + 1);
            text.append(segments[n].data.begin() + 1, segments[n].data.begin() + 8);
        }
        if (segments.empty() || (segments.back().data[0] & 0x80) == 0) {
            return {};
        }
        const auto end = sdo({0xa2, static_cast<std::uint8_t>(segments.size()), 20, 0, 0, 0, 0, 0});
        if ((end.data[0] & 0xe3) != 0xc1) {
            return {};
        }
        text.resize(text.size() - (end.data[0] >> 2 & 7));
        const auto sum = load<std::uint16_t>(end.data.data() + 1);
        EXPECT_EQ(
            sum,
            crc ? crc16({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}) : 0);
        EXPECT_EQ(sdo({0xa1, 0, 0, 0, 0, 0, 0, 0}).length, 0)
            << "nothing follows the end of an upload";
        return text.size() == size ? text : "";
    }
};

TEST_F(ConformanceSdo, Sdo_01_1000h_is_read_expedited) {
    const auto f = sdo({0x40, 0, 0x10, 0, 0, 0, 0, 0});
    EXPECT_EQ(f.data[0], 0x43);
    EXPECT_EQ(load<std::uint32_t>(f.data.data() + 4), 0x191U);
}
TEST_F(ConformanceSdo, Sdo_02_every_readable_and_writable_entry_takes_back_what_it_gave) {
    unsigned entries = 0;
    for (const Entry& e : device->dictionary().entries()) {
        if (e.access != Access::read_write || e.size > 4 || e.bits == 0 || e.index == 0x1010 ||
            e.index == 0x1011) {
            continue;
        }
        // only while the PDO is off
        if ((e.index >= 0x1600 && e.index < 0x1800) || (e.index >= 0x1a00 && e.index < 0x1c00)) {
            continue;
        }
        if (((e.index >= 0x1800 && e.index < 0x1a00) && (e.sub == 3 || e.sub == 6)) ||
            e.index == 0x1015) {
            continue;
        }
        const auto value = get(e.index, e.sub);
        if (e.index == 0x1003 && value != 0) continue;
        EXPECT_EQ(put(e.index, e.sub, value), Abort::none)
            << std::hex << e.index << ":" << int{e.sub};
        EXPECT_EQ(get(e.index, e.sub), value) << std::hex << e.index;
        ++entries;
    }
    EXPECT_GT(entries, 30U);
}
TEST_F(ConformanceSdo, Sdo_03_write_of_1000h_is_refused) {
    EXPECT_EQ(write(0x1000, 0, 0, 4), Abort::read_only);
}
TEST_F(ConformanceSdo, Sdo_04_read_of_a_write_only_object_is_refused) {
    EXPECT_EQ(read_abort(0x2002, 0), Abort::write_only);
}
TEST_F(ConformanceSdo, Sdo_05_sub_index_that_does_not_exist) {
    EXPECT_EQ(read_abort(0x1000, 1), Abort::no_sub);
}
TEST_F(ConformanceSdo, Sdo_06_object_that_does_not_exist) {
    EXPECT_EQ(read_abort(0x1004, 0), Abort::no_object);
}
TEST_F(ConformanceSdo, Sdo_07_unknown_command_specifier) {
    const auto f = sdo({0xe0, 0, 0x10, 0, 0, 0, 0, 0});
    EXPECT_EQ(abort_of(f), Abort::command);
    EXPECT_EQ(load<std::uint16_t>(f.data.data() + 1), 0x1000)
        << "the abort names the object of the request";
}
TEST_F(ConformanceSdo, Sdo_08_more_bytes_than_the_object_has) {
    EXPECT_EQ(write(0x1017, 0, 0, 4), Abort::too_long);
    EXPECT_EQ(write(0x1029, 1, 0, 4), Abort::too_long);
}
TEST_F(ConformanceSdo, Sdo_09_less_bytes_than_the_object_has) {
    EXPECT_EQ(write(0x1017, 0, 0, 1), Abort::too_short);
    EXPECT_EQ(write(0x1006, 0, 0, 1), Abort::too_short);
}
TEST_F(ConformanceSdo, Sdo_10_value_above_its_limit) {
    EXPECT_EQ(write(0x2000, 0, 1001, 4), Abort::too_high);
    EXPECT_EQ(write(0x2000, 0, 1000, 4), Abort::none);
}
TEST_F(ConformanceSdo, Sdo_11_value_below_its_limit) {
    EXPECT_EQ(write(0x2000, 0, 1, 4), Abort::too_low);
    EXPECT_EQ(write(0x2001, 0, 0xff9b, 2), Abort::too_low);
    EXPECT_EQ(write(0x2001, 0, 0xff9c, 2), Abort::none);
}
TEST_F(ConformanceSdo, Sdo_12_1200h_holds_the_predefined_identifiers) {
    EXPECT_EQ(read(0x1200, 1), 0x605U);
    EXPECT_EQ(read(0x1200, 2), 0x585U);
    EXPECT_EQ(write(0x1200, 1, 0x606, 4), Abort::read_only);
}
TEST_F(ConformanceSdo, Sdo_13_1000h_of_a_client_that_takes_segments) {
    EXPECT_EQ(sdo({0x40, 0, 0x10, 0, 0, 0, 0, 0}).data[0] & 0xe0, 0x40);
}
TEST_F(ConformanceSdo, Sdo_14_100Ch_is_written_by_segments) {
    EXPECT_EQ(segmented(0x100c, 250, 2), Abort::none);
    EXPECT_EQ(get(0x100c, 0), 250U);
}
TEST_F(ConformanceSdo, Sdo_15_1017h_is_written_by_segments) {
    EXPECT_EQ(segmented(0x1017, 750, 2), Abort::none);
    EXPECT_EQ(get(0x1017, 0), 750U);
    EXPECT_EQ(segmented(0x1017, 750, 3), Abort::too_long);
}
TEST_F(ConformanceSdo, Sdo_16_object_of_more_than_four_bytes_is_read_by_segments) {
    EXPECT_EQ(upload(0x1008), "a conforming device");
}
TEST_F(ConformanceSdo, Sdo_17_wrong_toggle_bit_of_an_upload) {
    EXPECT_EQ(sdo({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}).data[0], 0x41);
    const auto f = sdo({0x70, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(abort_of(f), Abort::toggle);
    EXPECT_EQ(load<std::uint16_t>(f.data.data() + 1), 0x1008);
}
TEST_F(ConformanceSdo, Sdo_18_segments_can_be_read_again_and_again) {
    for (int n = 0; n < 3; ++n) {
        EXPECT_EQ(upload(0x1008), "a conforming device");
    }
}
TEST_F(ConformanceSdo, Sdo_19_1000h_by_block_without_CRC) {
    EXPECT_EQ(block_upload(0x1000, false), std::string("\x91\x01\0\0", 4));
}
TEST_F(ConformanceSdo, Sdo_20_100Ch_by_block_without_CRC) {
    EXPECT_EQ(block(0x100c, 300, 2, false), Abort::none);
    EXPECT_EQ(get(0x100c, 0), 300U);
}
TEST_F(ConformanceSdo, Sdo_21_1017h_by_block_without_CRC) {
    EXPECT_EQ(block(0x1017, 0, 2, false), Abort::none);
    EXPECT_EQ(get(0x1017, 0), 0U);
}
TEST_F(ConformanceSdo, Sdo_22_long_object_by_block_without_CRC) {
    EXPECT_EQ(block_upload(0x1008, false), "a conforming device");
}
TEST_F(ConformanceSdo, Sdo_23_long_object_by_block_with_CRC) {
    EXPECT_EQ(block_upload(0x1008, true), "a conforming device");
}
TEST_F(ConformanceSdo, Sdo_24_100Ch_by_block_with_CRC) {
    EXPECT_EQ(block(0x100c, 400, 2, true), Abort::none);
    EXPECT_EQ(get(0x100c, 0), 400U);
}
TEST_F(ConformanceSdo, Sdo_25_1017h_by_block_with_CRC) {
    EXPECT_EQ(block(0x1017, 900, 2, true), Abort::none);
    EXPECT_EQ(get(0x1017, 0), 900U);
}
TEST_F(ConformanceSdo, Sdo_26_block_size_128_is_refused) {
    EXPECT_EQ(abort_of(sdo({0xa0, 0, 0x10, 0, 128, 0, 0, 0})), Abort::block_size);
    EXPECT_EQ(abort_of(sdo({0xa0, 0, 0x10, 0, 0, 0, 0, 0})), Abort::block_size);
}
TEST_F(ConformanceSdo, Sdo_27_sequence_number_128_is_refused) {
    EXPECT_EQ(sdo({0xa0, 0, 0x10, 0, 20, 0, 0, 0}).data[0] & 0xe3, 0xc2);
    EXPECT_EQ(sdo({0xa3, 0, 0, 0, 0, 0, 0, 0}).data[0], 0x81);
    EXPECT_TRUE(
        one_of(abort_of(sdo({0xa2, 128, 20, 0, 0, 0, 0, 0})), {Abort::command, Abort::sequence}));
}
TEST_F(ConformanceSdo, Sdo_28_further_servers_work_by_the_identifiers_they_are_given) {
    EXPECT_EQ(read(0x1201, 1), cob_invalid);
    EXPECT_EQ(write(0x1201, 1, 0x6c0, 4), Abort::none);
    EXPECT_EQ(write(0x1201, 2, 0x6c1, 4), Abort::none);
    bus.log.clear();
    send({0x6c0, {0x40, 0, 0x10, 0, 0, 0, 0, 0}});
    ASSERT_EQ(since(0x6c1).size(), 1U);
    EXPECT_EQ(since(0x6c1)[0].data[0], 0x43);
    EXPECT_EQ(write(0x1201, 1, 0x6c2, 4), Abort::value) << "while it is on, only bit 31 changes";
    EXPECT_EQ(write(0x1201, 1, cob_invalid | 0x6c0, 4), Abort::none);
    bus.log.clear();
    send({0x6c0, {0x40, 0, 0x10, 0, 0, 0, 0, 0}});
    EXPECT_TRUE(since(0x6c1).empty());
}
TEST_F(ConformanceSdo, Sdo_29_further_servers_are_off_again_after_reset_of_communication) {
    write(0x1201, 1, 0x6c0, 4);
    write(0x1201, 2, 0x6c1, 4);
    nmt(NmtCommand::reset_communication);
    EXPECT_EQ(read(0x1201, 1), cob_invalid);
    bus.log.clear();
    send({0x6c0, {0x40, 0, 0x10, 0, 0, 0, 0, 0}});
    EXPECT_TRUE(since(0x6c1).empty());
}
TEST_F(ConformanceSdo, Sdo_30_channels_that_were_stored_are_there_after_reset_of_communication) {
    EXPECT_EQ(write(0x1280, 1, 0x6c0, 4), Abort::none);
    EXPECT_EQ(write(0x1280, 2, 0x6c1, 4), Abort::none);
    EXPECT_EQ(write(0x1280, 3, 9, 1), Abort::none);
    EXPECT_EQ(write(0x1010, 1, 0x65766173, 4), Abort::none);
    nmt(NmtCommand::reset_communication);
    EXPECT_EQ(read(0x1280, 1), 0x6c0U);
    EXPECT_EQ(read(0x1280, 2), 0x6c1U);
    EXPECT_EQ(get(0x1280, 3), 9U);
}

// The object dictionary as a whole.

struct ConformanceOd : ConformanceSdo {
    std::vector<std::pair<std::uint16_t, std::uint8_t>> all() {
        std::vector<std::pair<std::uint16_t, std::uint8_t>> keys;
        for (const Entry& e : device->dictionary().entries()) {
            keys.emplace_back(e.index, e.sub);
        }
        return keys;
    }
    const Entry& entry(std::uint16_t index, std::uint8_t sub) {
        return *device->dictionary().find(index, sub);
    }
};
TEST_F(ConformanceOd, Od_01_access_follows_the_access_type) {
    for (const auto& [index, sub] : all()) {
        const bool refused = read_abort(index, sub) == Abort::write_only;
        EXPECT_EQ(refused, !readable(entry(index, sub).access))
            << std::hex << index << ":" << int{sub};
        sdo({0x80, 0, 0, 0, 0, 0, 0, 0});  // ends what a long value has begun
    }
}
TEST_F(ConformanceOd, Od_02_values_at_power_on_are_the_defaults) {
    const auto d = conforming();
    for (const auto& e : d.entries) {
        if (e.value.empty() || e.value.size() > 4 || !readable(e.access) ||
            bytes_of(e.type) != e.value.size()) {
            continue;
        }
        std::uint32_t expected = 0;
        std::copy(e.value.begin(), e.value.end(), reinterpret_cast<std::uint8_t*>(&expected));
        EXPECT_EQ(get(e.index, e.sub), expected + (e.plus_node_id ? 5 : 0))
            << std::hex << e.index << ":" << int{e.sub};
    }
}
TEST_F(ConformanceOd, Od_03_read_only_entries_refuse_a_write) {
    for (const auto& [index, sub] : all()) {
        const Entry& e = entry(index, sub);
        if (e.access != Access::read_only && e.access != Access::constant) continue;
        if (e.size < 1 || e.size > 4) continue;
        EXPECT_EQ(write(index, sub, 0, e.size), Abort::read_only)
            << std::hex << index << ":" << int{sub};
    }
}
TEST_F(ConformanceOd, Od_04_write_only_entries_refuse_a_read) {
    EXPECT_EQ(read_abort(0x2002, 0), Abort::write_only);
}
TEST_F(ConformanceOd, Od_05_sub_index_255_is_not_there_when_it_is_not_described) {
    for (const std::uint16_t index :
         {std::uint16_t{0x1018}, std::uint16_t{0x1400}, std::uint16_t{0x6000}}) {
        EXPECT_EQ(read_abort(index, 255), Abort::no_sub);
    }
}
TEST_F(ConformanceOd, Od_06_limits_of_writable_entries_hold_at_both_ends) {
    for (const auto& [index, sub] : all()) {
        const Entry& e = entry(index, sub);
        if (!e.ranged || !writable(e.access)) continue;
        EXPECT_EQ(put(index, sub, static_cast<std::uint32_t>(e.high)), Abort::none);
        EXPECT_EQ(put(index, sub, static_cast<std::uint32_t>(e.low)), Abort::none);
        EXPECT_EQ(put(index, sub, static_cast<std::uint32_t>(e.high + 1)), Abort::too_high);
        EXPECT_EQ(put(index, sub, static_cast<std::uint32_t>(e.low - 1)), Abort::too_low);
    }
}
TEST_F(ConformanceOd, Od_07_write_only_entries_take_a_write) {
    EXPECT_EQ(write(0x2002, 0, 3, 1), Abort::none);
}
TEST_F(ConformanceOd, Od_08_defaults_are_back_after_a_reset) {
    put(0x2000, 0, 99);
    nmt(NmtCommand::reset_node);
    EXPECT_EQ(get(0x2000, 0), 5U);
}
TEST_F(ConformanceOd, Od_09_highest_sub_index_is_right_for_every_object) {
    for (const auto& [index, sub] : all()) {
        const auto object = device->dictionary().object(index);
        if (sub != 0 || object.size() < 2 || index == 0x1003 ||
            (index >= 0x1600 && index < 0x1800) || (index >= 0x1a00 && index < 0x1c00)) {
            continue;
        }
        EXPECT_EQ(get(index, 0), object.back().sub) << std::hex << index;
    }
}

}  // namespace
}  // namespace hal::canopen::test
