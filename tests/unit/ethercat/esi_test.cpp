// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/esi/esi.hpp"
#include "hal/read_file.hpp"

namespace hal::ethercat::esi {
namespace {

std::string servo_text() {
    std::string bytes;
    EXPECT_TRUE(read_regular_file("tests/unit/ethercat/data/servo.xml", 1'000'000, bytes)) << bytes;
    return bytes;
}

TEST(Esi, Device_has_what_its_description_states) {
    const File file = read(servo_text());
    ASSERT_TRUE(file.messages.empty()) << file.messages[0].sentence;
    EXPECT_EQ(file.vendor, 0xcafeU);
    ASSERT_EQ(file.devices.size(), 2U);
    const Device* d = file.find(0x402);
    ASSERT_NE(d, nullptr);
    EXPECT_EQ(file.find("servo-1"), d);
    EXPECT_EQ(d->name, "Servo drive");
    EXPECT_EQ(d->timeouts.preop, 2000U);
    EXPECT_EQ(d->timeouts.back_to_init, 5000U);
    EXPECT_EQ(d->profile, 402);
    ASSERT_EQ(d->sync_managers.size(), 4U);
    EXPECT_EQ(d->sync_managers[2].type, sii::SmType::outputs);
    EXPECT_EQ(d->sync_managers[2].start, 0x1100);
    ASSERT_EQ(d->rx.size(), 2U);
    EXPECT_EQ(d->rx[0].sync_manager, 2);
    EXPECT_EQ(d->rx[0].exclude, (std::vector<std::uint16_t>{0x1601}));
    EXPECT_FALSE(d->rx[1].sync_manager);
    EXPECT_EQ(d->rx[1].bits(), 32U);
    EXPECT_TRUE(d->mailbox && d->mailbox->complete_access && d->mailbox->has(MailboxType::foe) &&
                !d->mailbox->has(MailboxType::eoe));
    ASSERT_EQ(d->init_commands.size(), 1U);
    EXPECT_EQ(d->init_commands[0].transitions, (std::vector<std::string>{"PS"}));
    EXPECT_EQ(d->init_commands[0].data, (std::vector<std::uint8_t>{8}));
    ASSERT_EQ(d->op_modes.size(), 2U);
    EXPECT_EQ(d->op_modes[0].assign_activate, 0x300);
    EXPECT_EQ(d->op_modes[0].sync0_shift_ns, -500);
    EXPECT_EQ(file.devices[1].rx[0].sync_manager, 0) << "mandatory: the first one of its direction";
}

TEST(Esi, Dictionary_resolves_records_arrays_and_enumerations) {
    const File file = read(servo_text());
    const Device& d = *file.find(0x402);
    EXPECT_EQ(d.objects.size(), 7U);
    const Value* mode = d.find(0x6060, 0);
    ASSERT_NE(mode, nullptr);
    EXPECT_EQ(mode->type, "SINT");
    EXPECT_EQ(mode->initial, (std::vector<std::uint8_t>{8}));
    const Value* index = d.find(0x60c2, 2);
    ASSERT_NE(index, nullptr);
    EXPECT_EQ(index->initial, (std::vector<std::uint8_t>{0xfd}));
    const Value* output = d.find(0x60fe, 2);
    ASSERT_NE(output, nullptr);
    EXPECT_EQ(output->bits, 32U);
    EXPECT_TRUE(output->rx_mappable && output->writable);
    EXPECT_EQ(d.find(0x60fe, 0)->initial, (std::vector<std::uint8_t>{2}));
    EXPECT_EQ(d.find(0x60fe, 3), nullptr);
    EXPECT_FALSE(d.find(0x6064, 0)->writable);
}

TEST(Esi, SII_image_has_the_identity_mailboxes_and_PDOs) {
    const File file = read(servo_text());
    const auto c = sii::parse(sii_image(file, file.devices[0]));
    EXPECT_TRUE(c.problems.empty()) << c.problems[0];
    EXPECT_EQ(c.configuration[0], 0x0c80);
    EXPECT_EQ(c.configuration[2], 0x0064);
    EXPECT_EQ(c.vendor, 0xcafeU);
    EXPECT_EQ(c.revision, 0x10001U);
    EXPECT_EQ(c.boot.send, (sii::Area{0x1080, 128}));
    EXPECT_EQ(c.mailboxes.receive, (sii::Area{0x1000, 128}));
    EXPECT_EQ(c.protocols, bit_of(MailboxType::coe) | bit_of(MailboxType::foe));
    EXPECT_EQ(c.general.coe_details, 0x2f);
    EXPECT_EQ(c.eeprom_bytes, 2048U);
    ASSERT_EQ(c.rx.size(), 2U);
    EXPECT_EQ(c.rx[1].sync_manager, 0xff);
    EXPECT_EQ(c.rx[1].flags, sii::pdo_fixed);
    EXPECT_EQ(c.rx[0].entries[1].type, 4);
    EXPECT_EQ(c.dc[0].sync0_shift_ns, -500);
    EXPECT_EQ(c.general.ports, (std::array<std::uint8_t, 4>{1, 1, 0, 0}));
}

TEST(Esi, Numbers_are_read_as_real_files_write_them) {
    EXPECT_EQ(number("#x1F"), 31);
    EXPECT_EQ(number("#X1f"), 31);
    EXPECT_EQ(number(" 0x1f "), 31);
    EXPECT_EQ(number("0012"), 12);
    EXPECT_EQ(number("-250"), -250);
    EXPECT_EQ(number("#xFFFFFFFF"), 0xffffffff);
    EXPECT_EQ(number("1F"), std::nullopt);
    EXPECT_EQ(number("#"), std::nullopt);
    EXPECT_EQ(number(""), std::nullopt);
    EXPECT_EQ(type_bits("ARRAY [0..3] OF UINT"), 64U);
    EXPECT_EQ(type_bits("STRING(8)"), 64U);
    EXPECT_EQ(type_bits("BIT3"), 3U);
    EXPECT_EQ(type_bits("MODE"), 0U);
}

TEST(Esi, Invalid_files_are_reported_with_their_place) {
    const auto first = [](std::string_view xml) {
        const File file = read(xml);
        return file.messages.empty()
                   ? ""
                   : text::message_text("x.xml", file.messages[0].severity, file.messages[0].at,
                                        file.messages[0].sentence, file.messages[0].help);
    };
    EXPECT_EQ(
        first("<EtherCATInfo>\n<Vendor>"),
        "x.xml:2:1: error: invalid XML: start-end tags mismatch; is it a device description?");
    EXPECT_EQ(first("<masters/>"),
              "x.xml:1:1: error: the root element is 'masters', not EtherCATInfo; give the ESI "
              "file of the device, an XML file from its maker");
    EXPECT_EQ(first("<EtherCATInfo/>"), "x.xml:1:2: error: the file describes no device");
    EXPECT_EQ(first("<EtherCATInfo><Descriptions><Devices><Device>\n<Type "
                    "ProductCode='#xZZ'/></Device></Devices></Descriptions></EtherCATInfo>"),
              "x.xml:2:2: error: invalid ProductCode '#xZZ'; write a number, as in 12 or #x1F");
}

TEST(Esi, Any_bytes_are_read_without_harm) {
    std::mt19937 random(2);
    const std::string good = servo_text();
    for (int n = 0; n < 1500; ++n) {
        std::string text = good;
        for (int i = 0; i < 1 + n % 6; ++i) {
            const std::size_t at = random() % text.size();
            switch (random() % 3) {
            case 0: text[at] = static_cast<char>(random()); break;
            case 1: text.erase(at, random() % 40); break;
            default: text.insert(at, text.substr(random() % text.size(), random() % 60)); break;
            }
        }
        const File file = read(text);
        for (const Device& d : file.devices) {
            sii::parse(sii_image(file, with_modules(file, d, {1, 2})));
        }
    }
}

}  // namespace
}  // namespace hal::ethercat::esi
