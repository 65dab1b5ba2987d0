// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/mailbox.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::sii {
namespace {

Contents drive() {
    Contents c;
    c.configuration = {0x0c80, 0x8600, 0x0064, 0, 5, 0, 0};
    c.vendor = 0xcafe;
    c.product = 0x402;
    c.revision = 0x10001;
    c.serial = 7;
    c.boot = {{0x1000, 256}, {0x1200, 256}};
    c.mailboxes = {{0x1000, 128}, {0x1080, 128}};
    c.protocols = bit_of(MailboxType::coe) | bit_of(MailboxType::foe);
    c.has_general = true;
    c.general.group = "Drives";
    c.general.order = "SERVO-1";
    c.general.name = "Servo drive";
    c.general.coe_details = coe_sdo | coe_pdo_config;
    c.general.foe = true;

    c.general.ebus_ma = -120;
    c.general.ports = {1, 1, 0, 0};
    c.fmmus = {FmmuUse::outputs, FmmuUse::inputs, FmmuUse::mailbox_state};
    c.sync_managers = {{0x1000, 128, 0x26, 0, 1, SmType::mailbox_out},
                       {0x1100, 0, 0x64, 0, 1, SmType::outputs}};
    c.rx = {{0x1600,
             2,
             0,
             "Outputs",
             pdo_fixed,
             {{0x6040, 0, "Controlword", type_number("UINT"), 16, 0}, {0, 0, "", 0, 8, 0}}}};
    c.tx = {
        {0x1a00, 0xff, 0, "Inputs", 0, {{0x6041, 0, "Statusword", type_number("UINT"), 16, 0}}}};
    c.dc = {{0, 250'000, -5, 2, 1, 0x300, "DC", "Synchronous"}};
    c.others = {{0x801, {1, 2, 3, 4}}};
    return c;
}

TEST(Sii, Image_has_the_same_contents_when_read_again) {
    Contents c = drive();
    c.eeprom_bytes = 2048;
    const auto image = build(c);
    ASSERT_EQ(image.size(), 2048U);
    EXPECT_EQ(bytes_needed({}), 0x84U);
    std::size_t read = 0;
    while (bytes_needed(std::span(image).first(read)) > read) {
        read += 8;
    }
    for (const auto& bytes :
         {std::span<const std::uint8_t>(image), std::span<const std::uint8_t>(image).first(read)}) {
        const Contents r = parse(bytes);
        EXPECT_TRUE(r.problems.empty()) << r.problems.front();
        EXPECT_TRUE(r.checksum_valid);
        EXPECT_EQ(r.configuration, c.configuration);
        EXPECT_EQ(r.vendor, 0xcafeU);
        EXPECT_EQ(r.product, 0x402U);
        EXPECT_EQ(r.revision, 0x10001U);
        EXPECT_EQ(r.serial, 7U);
        EXPECT_EQ(r.boot, c.boot);
        EXPECT_EQ(r.mailboxes, c.mailboxes);
        EXPECT_EQ(r.protocols, bit_of(MailboxType::coe) | bit_of(MailboxType::foe));
        EXPECT_EQ(r.eeprom_bytes, 2048U);
        EXPECT_EQ(r.general.group, "Drives");
        EXPECT_EQ(r.general.order, "SERVO-1");
        EXPECT_EQ(r.general.name, "Servo drive");
        EXPECT_EQ(r.general.ebus_ma, -120);
        EXPECT_EQ(r.general.ports, c.general.ports);
        EXPECT_EQ(r.fmmus, c.fmmus);
        ASSERT_EQ(r.sync_managers.size(), 2U);
        EXPECT_EQ(r.sync_managers[1].control, 0x64);
        EXPECT_EQ(r.sync_managers[1].type, SmType::outputs);
        ASSERT_EQ(r.rx.size(), 1U);
        EXPECT_EQ(r.rx[0].name, "Outputs");
        EXPECT_EQ(r.rx[0].sync_manager, 2);
        EXPECT_EQ(r.rx[0].flags, pdo_fixed);
        ASSERT_EQ(r.rx[0].entries.size(), 2U);
        EXPECT_EQ(r.rx[0].entries[0].name, "Controlword");
        EXPECT_EQ(r.rx[0].entries[1].bits, 8);
        ASSERT_EQ(r.tx.size(), 1U);
        EXPECT_EQ(r.tx[0].sync_manager, 0xff);
        ASSERT_EQ(r.dc.size(), 1U);
        EXPECT_EQ(r.dc[0].assign_activate, 0x300);
        EXPECT_EQ(r.dc[0].sync0_shift_ns, 250'000);
        EXPECT_EQ(r.dc[0].sync1_shift_ns, -5);
        EXPECT_EQ(r.dc[0].sync1_factor, 2);
        EXPECT_EQ(r.dc[0].description, "Synchronous");
        ASSERT_EQ(r.others.size(), 1U);
        EXPECT_EQ(r.others[0].data, c.others[0].data);
    }
}

TEST(Sii, Checksum_is_the_CRC_of_the_first_seven_words) {
    const auto image = build(drive());
    EXPECT_EQ(image[14], checksum(image));
    EXPECT_EQ(checksum(std::array<std::uint8_t, 14>{}), 0x30);  // by long division
}

TEST(Sii, Names_are_dropped_from_the_last_entry_on_when_the_image_is_too_long) {
    Contents c = drive();
    c.rx[0].entries.clear();
    for (int i = 0; i < 20; ++i) {
        c.rx[0].entries.push_back({0x7000, static_cast<std::uint8_t>(i),
                                   "A name of some length " + std::to_string(i), 1, 1, 0});
    }
    c.eeprom_bytes = 768;
    const auto image = build(c);
    EXPECT_EQ(image.size(), 768U);
    const Contents r = parse(image);
    ASSERT_EQ(r.rx[0].entries.size(), 20U);
    EXPECT_EQ(r.rx[0].name, "Outputs");
    EXPECT_EQ(r.rx[0].entries[0].name, "A name of some length 0");
    EXPECT_EQ(r.rx[0].entries[19].name, "");
}

TEST(Sii, Invalid_parts_are_reported_and_the_rest_is_read) {
    auto image = build(drive());
    image[14] ^= 0xff;
    const auto bad_checksum = parse(image);
    EXPECT_FALSE(bad_checksum.checksum_valid);
    ASSERT_EQ(bad_checksum.problems.size(), 1U);
    char expected[80];
    std::snprintf(expected, sizeof expected, "the checksum is 0x%02X; 0x%02X is expected",
                  image[14], image[14] ^ 0xff);
    EXPECT_EQ(bad_checksum.problems[0], expected);
    EXPECT_EQ(bad_checksum.vendor, 0xcafeU);
    put<std::uint16_t>(image.data() + 14, 0x88a4);
    EXPECT_TRUE(parse(image).checksum_valid);

    const auto cut = parse(std::span(image).first(0x90));
    ASSERT_EQ(cut.problems.size(), 1U);
    EXPECT_EQ(cut.problems[0], "the last category is longer than the image");
    const auto tiny = parse(std::span(image).first(20));
    ASSERT_EQ(tiny.problems.size(), 1U);
    EXPECT_EQ(tiny.problems[0], "the image has 20 bytes; at least 128 are expected");
    EXPECT_EQ(tiny.vendor, 0xcafeU);
}

TEST(Sii, Any_bytes_are_read_without_harm) {
    std::mt19937 random(1);
    const auto image = build(drive());
    for (int n = 0; n < 4000; ++n) {
        auto bytes = image;
        for (int i = 0; i < 1 + n % 8; ++i) {
            bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        }
        bytes.resize(random() % (bytes.size() + 1));
        const Contents c = parse(bytes);
        EXPECT_LE(bytes_needed(bytes), 128U * 1024);
        parse(build(c));
    }
    for (int n = 0; n < 1000; ++n) {
        std::vector<std::uint8_t> bytes(random() % 600);
        for (auto& b : bytes) {
            b = static_cast<std::uint8_t>(random());
        }
        parse(build(parse(bytes)));
    }
}

}  // namespace
}  // namespace hal::ethercat::sii
