// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/esi/esi.hpp"
#include "ethercat/esi/lookup.hpp"
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
    EXPECT_EQ(file.devices.front().vendor, 0xcafeU);
    ASSERT_EQ(file.devices.size(), 2U);
    const Device* d = look_up(file, {.product = 0x402}).device;
    ASSERT_NE(d, nullptr);
    EXPECT_EQ(look_up(file, {.name = "servo-1"}).device, d);
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

/// A description with a device for each pair of attributes of Type and order code.
std::string types(const std::vector<std::pair<std::string, std::string>>& rows) {
    std::string text = "<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices>";
    for (const auto& [attributes, order] : rows) {
        text += "<Device><Type " + attributes + ">" + order + "</Type></Device>";
    }
    return text + "</Devices></Descriptions></EtherCATInfo>";
}

TEST(EsiLookup, A_revision_selects_its_description_and_then_one_that_accepts_it) {
    const File file = read(types({{"ProductCode='7' RevisionNo='#x10000'", "BOX"},
                                  {"ProductCode='7' RevisionNo='#x20000'", "BOX"},
                                  {"ProductCode='7' RevisionNo='#x40000'", "box"}}));
    using Revision = Match::Revision;
    const auto found = [&](std::optional<std::uint32_t> revision) {
        const Match match = look_up(file, {.product = 7, .revision = revision});
        return std::pair(match.device->revision, match.revision);
    };
    EXPECT_EQ(found({}), std::pair(0x40000U, Revision::newest));
    EXPECT_EQ(found(0x10000), std::pair(0x10000U, Revision::exact));
    EXPECT_EQ(found(0x30000), std::pair(0x20000U, Revision::accepted));
    EXPECT_EQ(found(0x00005), std::pair(0x40000U, Revision::other));
    EXPECT_EQ(revisions_of(file, file.devices[0]),
              (std::vector<std::string>{"0x00010000", "0x00020000", "0x00040000"}));
}

TEST(EsiLookup, CheckRevisionNo_decides_which_revisions_a_description_is_valid_for) {
    struct Row {
        const char* rule;
        std::uint32_t revision;
        bool accepted;
    };
    const Row rows[] = {{"NONE", 1, true},
                        {"EQ", 0x20011, false},
                        {"GE", 0x20011, true},
                        {"EQ_OR_G", 0x2000f, false},
                        {"LW_EQ", 0x10010, true},
                        {"LW_EQ", 0x20011, false},
                        {"LW_EQ_HW_EQ_OR_G", 0x30010, true},
                        {"LW_EQ_HW_EQ_OR_G", 0x10010, false},
                        {"HW_EQ", 0x20001, true},
                        {"HW_EQ", 0x30010, false},
                        {"HW_EQ_LW_EQ_OR_G", 0x20011, true},
                        {"HW_EQ_LW_EQ_OR_G", 0x20001, false}};
    for (const Row& row : rows) {
        const File file =
            read(types({{std::string("ProductCode='7' RevisionNo='#x20010' CheckRevisionNo='") +
                             row.rule + "'",
                         "BOX"}}));
        const Match match = look_up(file, {.revision = row.revision});
        EXPECT_EQ(match.revision == Match::Revision::accepted, row.accepted)
            << row.rule << " " << std::hex << row.revision;
    }
    const File file = read(types({{"ProductCode='7' CheckRevisionNo='OTHER'", "BOX"}}));
    ASSERT_EQ(file.messages.size(), 1U);
    EXPECT_EQ(file.messages[0].sentence,
              "unknown CheckRevisionNo 'OTHER'; higher revisions are accepted");
}

TEST(EsiLookup, Types_of_one_product_code_are_told_apart) {
    const File file = read(
        types({{"ProductCode='7' RevisionNo='#x100000'", "EL3104"},
               {"ProductCode='7' RevisionNo='#x110000' CheckRevisionNo='LW_EQ'", "EL3104"},
               {"ProductCode='7' RevisionNo='#x110014' CheckRevisionNo='LW_EQ'", "EL3104-0020"},
               {"ProductCode='8' RevisionNo='#x110000'", "EL3104, old"}}));
    const Match several = look_up(file, {.product = 7});
    EXPECT_EQ(several.device, nullptr);
    EXPECT_EQ(several.problem, "describes several devices with the product code 0x00000007");
    EXPECT_EQ(several.choices, (std::vector<std::string>{"EL3104", "EL3104-0020"}));
    EXPECT_EQ(look_up(file, {.name = "el3104"}).device, &file.devices[1]);
    EXPECT_EQ(look_up(file, {.name = "EL3104, old"}).device, &file.devices[3]);
    EXPECT_EQ(look_up(file, {.name = "0x8"}).device, &file.devices[3]);
    EXPECT_EQ(look_up(file, {.product = 7, .revision = 0x120014}).device, &file.devices[2])
        << "by the rule";
    EXPECT_EQ(look_up(file, {.name = "EL3104", .product = 8}).problem,
              "does not describe a product 0x00000008");
    EXPECT_EQ(look_up(file, {.name = "EL3104", .vendor = 3}).problem,
              "describes devices of vendor 0x00000002, not of 0x00000003");
    EXPECT_EQ(look_up(File{}, {}).problem, "describes no device");
}

TEST(Esi, A_list_of_the_IgH_master_has_a_device_per_slave) {
    const auto info = [](int vendor, const std::string& order) {
        return "<EtherCATInfo><Vendor><Id>" + std::to_string(vendor) +
               "</Id></Vendor><Descriptions><Devices><Device><Type ProductCode='#x1'>" + order +
               "</Type><Sm Enable='1' StartAddress='#x1000' ControlByte='#x26' />"
               "<Sm Enable='1' StartAddress='#x1100' ControlByte='#x22' />"
               "<Sm Enable='1' StartAddress='#x1200' ControlByte='#x64' />"
               "<Sm Enable='1' StartAddress='#x1300' ControlByte='#x20' />"
               "</Device></Devices></Descriptions></EtherCATInfo>";
    };
    const File file =
        read("<EtherCATInfoList>" + info(2, "A") + info(3, "B") + "</EtherCATInfoList>");
    ASSERT_TRUE(file.messages.empty()) << file.messages[0].sentence;
    ASSERT_EQ(file.devices.size(), 2U);
    EXPECT_EQ(look_up(file, {.name = "B"}).device->vendor, 3U);
    ASSERT_EQ(file.devices[0].sync_managers.size(), 4U);
    const std::array expected{sii::SmType::mailbox_out, sii::SmType::mailbox_in,
                              sii::SmType::outputs, sii::SmType::inputs};
    for (std::size_t n = 0; n < expected.size(); ++n) {
        EXPECT_EQ(file.devices[0].sync_managers[n].type, expected[n]) << n;
    }
}

TEST(Esi, A_sync_manager_has_the_direction_of_its_PDOs) {
    const File file = read(
        "<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode='1'>BOX</Type>"
        "<Sm StartAddress='#xf00'>Outputs</Sm><Sm StartAddress='#x1000'>Outputs</Sm>"
        "<RxPdo Sm='0'><Index>#x1600</Index></RxPdo><TxPdo Sm='1'><Index>#x1a00</Index></TxPdo>"
        "</Device></Devices></Descriptions></EtherCATInfo>");
    EXPECT_EQ(file.devices.at(0).sync_managers.at(0).type, sii::SmType::outputs);
    EXPECT_EQ(file.devices.at(0).sync_managers.at(1).type, sii::SmType::inputs);
    ASSERT_EQ(file.messages.size(), 1U);
    EXPECT_EQ(file.messages[0].sentence,
              "sync manager 1 is named Outputs, but has TxPDOs; it is read as Inputs");
}

TEST(Esi, Mailboxes_that_overlap_are_read_with_the_space_between_them) {
    const auto mailboxes = [](const std::string& min, const std::string& in) {
        return read(
            "<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode='1'>BOX</Type>"
            "<Sm StartAddress='#x1000' DefaultSize='1024' MinSize='" +
            min + "'>MBoxOut</Sm><Sm StartAddress='" + in +
            "' DefaultSize='1024'>MBoxIn</Sm></Device></Devices></Descriptions>"
            "</EtherCATInfo>");
    };
    const auto size = [](const File& file, std::size_t manager) {
        return file.devices.at(0).sync_managers.at(manager).default_size;
    };
    const File overlapping = mailboxes("64", "#x1200");
    EXPECT_EQ(size(overlapping, 0), 512U);
    EXPECT_EQ(size(overlapping, 1), 1024U);
    ASSERT_EQ(overlapping.messages.size(), 1U);
    EXPECT_EQ(overlapping.messages[0].sentence,
              "the mailbox of 1024 bytes reaches into the other one; it is read with 512 bytes");
    EXPECT_EQ(size(mailboxes("64", "#x0e00"), 1), 512U) << "the other one is first";
    EXPECT_EQ(size(mailboxes("768", "#x1200"), 0), 1024U) << "its least size does not allow it";
    EXPECT_TRUE(mailboxes("64", "#x1400").messages.empty()) << "side by side";
}

TEST(Esi, A_number_with_two_prefixes_is_hexadecimal) {
    const File file = read(
        "<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode='#x0x12'>BOX</Type>"
        "<RxPdo><Index>#x0xy</Index></RxPdo></Device></Devices></Descriptions></EtherCATInfo>");
    EXPECT_EQ(file.devices.at(0).product, 0x12U);
    ASSERT_EQ(file.messages.size(), 2U);
    EXPECT_EQ(file.messages[0].sentence,
              "ProductCode '#x0x12' has two prefixes; read as hexadecimal");
    EXPECT_EQ(file.messages[1].sentence, "invalid Index '#x0xy'");
}

TEST(Esi, Of_PDOs_that_exclude_each_other_one_is_assigned_by_default) {
    const auto pdo = [](const std::string& attributes, const std::string& index,
                        const std::string& excluded) {
        return "<TxPdo Sm='0' " + attributes + "><Index>#x" + index + "</Index><Exclude>#x" +
               excluded + "</Exclude></TxPdo>";
    };
    const File file = read(
        "<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode='1'>BOX</Type>"
        "<Sm StartAddress='#x1000'>Inputs</Sm>" +
        pdo("", "1a00", "1a01") + pdo("", "1a01", "1a00") + pdo("", "1a02", "1a03") +
        pdo("Mandatory='1'", "1a03", "1a02") + "</Device></Devices></Descriptions></EtherCATInfo>");
    const std::vector<Pdo>& pdos = file.devices.at(0).tx;
    EXPECT_TRUE(pdos.at(0).sync_manager && !pdos.at(1).sync_manager);
    EXPECT_TRUE(!pdos.at(2).sync_manager && pdos.at(3).sync_manager) << "the mandatory one";
    ASSERT_EQ(file.messages.size(), 2U);
    EXPECT_EQ(file.messages[0].sentence,
              "PDOs 1A00 and 1A01 exclude each other, but both are assigned by default; 1A01 is "
              "left out");
}

TEST(Esi, Dictionary_resolves_records_arrays_and_enumerations) {
    const File file = read(servo_text());
    const Device& d = *look_up(file, {.product = 0x402}).device;
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
    const auto c = sii::parse(sii_image(file.devices[0]));
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
            sii::parse(sii_image(with_modules(file, d, {1, 2})));
        }
    }
}

}  // namespace
}  // namespace hal::ethercat::esi
