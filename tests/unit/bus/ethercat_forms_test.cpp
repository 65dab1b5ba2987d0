// SPDX-License-Identifier: MIT
#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {
namespace {

std::string messages(const ReadResult& reading) {
    std::string out;
    for (const Message& m : reading.messages) {
        out += text::message_text("m.ethercat", m.severity, m.at, m.sentence, m.help) + "\n";
    }
    return out;
}

TEST(EthercatForms, Sub_index_of_two_digits_is_decimal_and_reported) {
    const ReadResult reading = read(
        "[bus]\n[slave 0 a]\ndevice = cia402\noutputs = 2000:10 u16, 0x2000:0x10 u16\n"
        "2000:0x0A.scale = 2\nsdo 2001:20 u8 = 1\n",
        "m.ethercat");
    EXPECT_EQ(messages(reading),
              "m.ethercat:4:11: warning: the sub-index of '2000:10' is decimal; earlier versions "
              "read it as hexadecimal; write 0x2000:0xA for sub-index 10, or 0x2000:0x10 for "
              "sub-index 16\n"
              "m.ethercat:6:5: warning: the sub-index of '2001:20' is decimal; earlier versions "
              "read it as hexadecimal; write 0x2001:0x14 for sub-index 20, or 0x2001:0x20 for "
              "sub-index 32\n");
    const master::Slave& slave = reading.buses[0].setup.slaves[0];
    const auto& entries = slave.sync_managers[0].pdos[0].entries;
    ASSERT_EQ(entries.size(), 2U);
    EXPECT_EQ(entries[0].sub, 10);
    EXPECT_TRUE(entries[0].scaled);
    EXPECT_EQ(entries[1].sub, 16);
    EXPECT_EQ(slave.startup[0].sub, 20);
}

TEST(EthercatForms, Old_types_and_sub_indices_are_read_and_reported) {
    const ReadResult reading = read(
        "[bus]\n[slave 0 a]\ndevice = cia402\noutputs = 2000:1F real32 2000:1 UINT 2000:2 i8\n",
        "m.ethercat");
    EXPECT_EQ(messages(reading),
              "m.ethercat:4:11: warning: the sub-index of '2000:1F' is hexadecimal without 0x; "
              "later versions reject it; write 0x2000:31, or 0x2000:0x1F\n"
              "m.ethercat:4:19: warning: 'real32' is the old name of the type f32; later versions "
              "reject it; write f32\n"
              "m.ethercat:4:45: warning: 'i8' is the old name of the type s8; later versions "
              "reject it; write s8\n");
    const auto& entries = reading.buses[0].setup.slaves[0].sync_managers[0].pdos[0].entries;
    ASSERT_EQ(entries.size(), 3U);
    EXPECT_EQ(entries[0].sub, 31);
    EXPECT_EQ(entries[0].type, master::Type::real32);
    EXPECT_EQ(entries[2].type, master::Type::s8);
}

TEST(EthercatForms, Unit_leaves_a_type_that_is_given_as_in_canopen) {
    const ReadResult reading = read(
        "[bus]\n[slave 0 a]\ndevice = cia402\noutputs = 2000:1 s32 2000:2 s32\n"
        "2000:1.unit = mm\n2000:1.type = s32\n2000:2.unit = mm\n",
        "m.ethercat");
    EXPECT_EQ(messages(reading), "");
    const auto& entries = reading.buses[0].setup.slaves[0].sync_managers[0].pdos[0].entries;
    ASSERT_EQ(entries.size(), 2U);
    EXPECT_FALSE(entries[0].scaled);
    EXPECT_TRUE(entries[1].scaled);
    EXPECT_EQ(reading.buses[0].slaves[0].find("2000-01")->unit, "mm");
}

TEST(EthercatForms, Unit_leaves_a_type_that_is_given_under_another_spelling) {
    const ReadResult reading = read(
        "[bus]\n[slave 0 a]\ndevice = cia402\ninputs = 6041 6064\n"
        "6041.unit = bits\nstatusword.type = u16\n0x6064.type = s32\n6064:0.unit = counts\n",
        "m.ethercat");
    EXPECT_EQ(messages(reading), "");
    const auto& managers = reading.buses[0].setup.slaves[0].sync_managers;
    const auto& entries = managers.back().pdos[0].entries;
    ASSERT_EQ(entries.size(), 2U);
    EXPECT_FALSE(entries[0].scaled);
    EXPECT_FALSE(entries[1].scaled);
    EXPECT_EQ(reading.buses[0].slaves[0].find("statusword")->unit, "bits");
}

TEST(EthercatForms, Object_without_a_name_has_a_pin_with_a_decimal_sub_index) {
    const ReadResult reading = read(
        "[bus]\n[slave 0 a]\ndevice = cia402\noutputs = 2000:1 u8 2000:0x0A u8 2000:0x1F u8\n"
        "2000:0x0A.unit = mm\n",
        "m.ethercat");
    EXPECT_EQ(messages(reading), "");
    const auto& entries = reading.buses[0].setup.slaves[0].sync_managers[0].pdos[0].entries;
    ASSERT_EQ(entries.size(), 3U);
    EXPECT_EQ(entries[0].name, "2000-01");
    EXPECT_EQ(entries[1].name, "2000-10");
    EXPECT_EQ(entries[2].name, "2000-31");
}

TEST(EthercatForms, Generated_ranges_keep_their_meaning_in_earlier_versions) {
    Found io;
    io.name = "io";
    sii::Pdo pdo;
    pdo.index = 0x1a00;
    pdo.sync_manager = 3;
    for (unsigned sub = 1; sub <= 16; ++sub) {
        sii::Entry entry;
        entry.index = 0x6000;
        entry.sub = static_cast<std::uint8_t>(sub);
        entry.bits = 1;
        pdo.entries.push_back(entry);
    }
    io.tx.push_back(pdo);
    const std::string text = write("sim:line", 1'000'000, {io});
    EXPECT_NE(text.find("inputs  = 6000:1..0x10 bit\n"), text.npos) << text;
    const ReadResult reading = read(text, "m.ethercat");
    EXPECT_EQ(messages(reading), "");
    EXPECT_EQ(reading.buses[0].setup.slaves[0].sync_managers[0].pdos[0].entries.size(), 16U);
}

}  // namespace
}  // namespace hal::ethercat::config
