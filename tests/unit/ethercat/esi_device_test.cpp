// SPDX-License-Identifier: MIT
// Emulated devices made from descriptions: sync managers, start-up commands, modules, assignments.
#include "ethercat/devices/esi_device.hpp"
#include "ethercat/esi/lookup.hpp"
#include "ethercat/wire/aoe.hpp"
#include "ethercat/wire/foe.hpp"
#include "ethercat/wire/soe.hpp"
#include "tests/unit/ethercat/device_bench.hpp"

namespace {

using namespace esc_world;

constexpr const char* begin =
    "<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices><Device Physics='YY'>"
    "<Type ProductCode='7'>BOX</Type><Name>Box</Name>";
constexpr const char* mailbox_managers =
    "<Sm StartAddress='#x1000' DefaultSize='128' ControlByte='#x26' Enable='1'>MBoxOut</Sm>"
    "<Sm StartAddress='#x1080' DefaultSize='128' ControlByte='#x22' Enable='1'>MBoxIn</Sm>";

std::string pdo(const std::string& name, unsigned manager, const std::string& index,
                const std::string& object) {
    return "<" + name + " Sm='" + std::to_string(manager) + "' Fixed='1'><Index>#x" + index +
           "</Index><Name>P</Name><Entry><Index>#x" + object +
           "</Index><SubIndex>1</SubIndex><BitLen>8</BitLen><Name>V</Name>"
           "<DataType>USINT</DataType></Entry></" +
           name + ">";
}

std::string command(const std::string& index, const std::string& sub, const std::string& data,
                    bool complete = false) {
    return std::string("<InitCmd") + (complete ? " CompleteAccess='1'" : "") +
           "><Transition>PS</Transition><Index>#x" + index + "</Index><SubIndex>" + sub +
           "</SubIndex><Data>" + data + "</Data></InitCmd>";
}

/// The device of a description whose elements follow the name; `rest` follows the device.
DeviceOptions described(const std::string& elements, const std::string& rest = {}) {
    DeviceOptions options;
    options.description = std::make_shared<const esi::File>(esi::read(
        begin + elements + "</Device></Devices>" + rest + "</Descriptions></EtherCATInfo>"));
    EXPECT_TRUE(options.description->messages.empty())
        << options.description->messages.front().sentence;
    options.described = esi::look_up(*options.description, {}).device;
    options.module_idents = esi::default_modules(*options.described);
    return options;
}

struct EsiDevice : testing::Test, DeviceBench {
    std::uint8_t value(std::uint16_t index, std::uint8_t sub) {
        return *device.firmware->design().dictionary->at(index, sub);
    }
};

TEST_F(EsiDevice, Several_sync_managers_of_a_direction_carry_process_data) {
    start("esi", described("<Sm StartAddress='#xf00' ControlByte='#x44' Enable='1'>Outputs</Sm>"
                           "<Sm StartAddress='#xf08' ControlByte='#x44' Enable='1'>Outputs</Sm>"
                           "<Sm StartAddress='#x1000' ControlByte='0' Enable='1'>Inputs</Sm>"
                           "<Sm StartAddress='#x1008' ControlByte='0' Enable='1'>Inputs</Sm>" +
                           pdo("RxPdo", 0, "1600", "7000") + pdo("RxPdo", 1, "1601", "7010") +
                           pdo("TxPdo", 2, "1a00", "6000") + pdo("TxPdo", 3, "1a01", "6010")));
    to_preop();
    process_data();
    sync_manager(1, 0, 0, 0);
    EXPECT_EQ(request(State::safeop), 0x1d0012U) << "the second one is missing";
    process_data();
    ASSERT_EQ(request(State::safeop, al_error), 4U);
    write(0xf00, {3});
    write(0xf08, {5});
    request(State::op);
    ASSERT_EQ(status(), 8U);
    write(0xf00, {3});
    write(0xf08, {5});
    status();
    EXPECT_EQ(value(0x7000, 1), 3);
    EXPECT_EQ(value(0x7010, 1), 5);
    *device.firmware->design().dictionary->at(0x6010, 1) = 9;
    w.now_ns += 1'000'000;
    status();
    EXPECT_EQ(read(0x1008, 1), Bytes{9});
}

TEST_F(EsiDevice, Objects_of_start_up_commands_can_be_written) {
    start("esi", described(mailbox_managers + pdo("TxPdo", 3, "1a00", "6000") +
                           "<Sm>Outputs</Sm><Sm StartAddress='#x1100' ControlByte='#x20' "
                           "Enable='1'>Inputs</Sm><Mailbox><CoE CompleteAccess='1'>" +
                           command("8000", "17", "0500") + command("f800", "0", "07") +
                           command("8010", "0", "02001122", true) + "</CoE></Mailbox>"));
    to_preop();
    EXPECT_EQ(download(0x8000, 17, 6, 2), 0U);
    EXPECT_EQ(upload(0x8000, 17), 6U);
    EXPECT_EQ(download(0xf800, 0, 7, 1), 0U);
    EXPECT_EQ(download(0x8010, 2, 0x22, 1), 0U);
    EXPECT_EQ(download(0x8020, 1, 1, 1), 0x06020000U) << "nobody named it";
}

TEST_F(EsiDevice, A_complete_write_longer_than_the_object_is_accepted) {
    start("esi", described(mailbox_managers + pdo("TxPdo", 2, "1a00", "6000") +
                           "<Sm StartAddress='#x1100' ControlByte='#x20' Enable='1'>Inputs</Sm>"
                           "<Mailbox><CoE CompleteAccess='1'>" +
                           command("6000", "1", "0102030405", true) + "</CoE></Mailbox>"));
    to_preop();
    const auto command = static_cast<std::uint8_t>(
        coe::command::download | coe::command::size_given | coe::command::complete);
    const auto answer = coe::read_sdo(sdo(command, 0x6000, 1, 5, {1, 2, 3, 4, 5}));
    ASSERT_TRUE(answer);
    EXPECT_FALSE(answer->is(coe::command::abort)) << std::hex << answer->value;
}

TEST_F(EsiDevice, A_mapping_that_is_named_as_an_object_of_its_PDO_keeps_its_value) {
    start("esi", described(mailbox_managers + pdo("RxPdo", 2, "1600", "1600") +
                           pdo("TxPdo", 3, "1a00", "6000") +
                           "<Sm StartAddress='#x1100' ControlByte='#x24' Enable='1'>Outputs</Sm>"
                           "<Sm StartAddress='#x1180' ControlByte='#x20' Enable='1'>Inputs</Sm>"
                           "<Mailbox><CoE/></Mailbox>"));
    to_op({0xff});
    EXPECT_EQ(upload(0x1600, 0), 1U);
    EXPECT_EQ(upload(0x1600, 1), 0x16000108U);
}

TEST_F(EsiDevice, Every_device_with_CoE_has_both_assignments) {
    start("esi", described(mailbox_managers + pdo("TxPdo", 2, "1a00", "6000") +
                           "<Sm StartAddress='#x1100' ControlByte='#x20' Enable='1'>Inputs</Sm>"
                           "<Mailbox><CoE/></Mailbox>"));
    to_preop();
    EXPECT_EQ(upload(0x1c12, 0), 1U) << "its inputs are in sync manager 2";
    EXPECT_EQ(upload(0x1c13, 0), 0U);
    EXPECT_EQ(download(0x1c13, 0, 0, 1), 0U);
    EXPECT_NE(download(0x1c13, 0, 1, 1), 0U) << "there is no PDO to assign";
}

TEST_F(EsiDevice, Modules_have_their_PDOs_and_are_listed) {
    const std::string module =
        "<Modules><Module><Type ModuleIdent='#x21'>IN</Type><Name>In</Name>" +
        pdo("TxPdo", 3, "1a00", "6000") + "</Module></Modules>";
    start("esi",
          described(mailbox_managers +
                        std::string("<Sm>Outputs</Sm><Sm StartAddress='#x1100' ControlByte='#x20' "
                                    "Enable='1'>Inputs</Sm><Mailbox><CoE/></Mailbox>"
                                    "<Slots><Slot><Name>1</Name><ModuleIdent Default='1'>#x21"
                                    "</ModuleIdent></Slot></Slots>"),
                    module));
    to_preop();
    EXPECT_EQ(upload(0xf050, 1), 0x21U);
    EXPECT_EQ(download(0xf030, 1, 0x21, 4), 0U);
    EXPECT_EQ(download(0xf030, 0, 1, 1), 0U);
    EXPECT_EQ(upload(0x1c13, 1), 0x1a00U);
}

TEST_F(EsiDevice, A_PDO_of_a_module_replaces_the_one_of_the_device) {
    const std::string module =
        "<Modules><Module><Type ModuleIdent='#x21'>IN</Type><Name>In</Name>" +
        pdo("TxPdo", 0, "1a00", "6010") + "</Module></Modules>";
    const DeviceOptions options = described(
        "<Sm StartAddress='#x1000' ControlByte='0' Enable='1'>Inputs</Sm>" +
            pdo("TxPdo", 0, "1a00", "6000") +
            "<Slots><Slot><Name>1</Name><ModuleIdent Default='1'>#x21</ModuleIdent></Slot></Slots>",
        module);
    const esi::Device modular =
        esi::with_modules(*options.description, *options.described, options.module_idents);
    ASSERT_EQ(modular.tx.size(), 1U);
    EXPECT_EQ(modular.tx[0].entries[0].index, 0x6010);
}

TEST_F(EsiDevice, Parameters_of_start_up_commands_can_be_written_in_each_drive) {
    const auto idn = [](const std::string& drive, const std::string& data) {
        return "<InitCmd Chn='" + drive + "'><Transition>PS</Transition><IDN>2</IDN><Data>" + data +
               "</Data></InitCmd>";
    };
    start("esi", described(mailbox_managers + std::string("<Mailbox><SoE>") + idn("0", "d007") +
                           idn("1", "02000200e803") + "</SoE></Mailbox>"));
    to_preop();
    const auto written = [&](std::uint8_t drive, std::uint16_t number, const Bytes& value) {
        Bytes request(soe::header_bytes);
        soe::write(request.data(),
                   {soe::Opcode::write, false, false, drive, soe::element::value, number});
        request.insert(request.end(), value.begin(), value.end());
        const auto answer = soe::read(ask(MailboxType::soe, request));
        return answer && answer->opcode == soe::Opcode::write_response && !answer->error &&
               answer->drive == drive;
    };
    EXPECT_TRUE(written(0, 2, {0xd0, 7}));
    EXPECT_TRUE(written(1, 2, {2, 0, 2, 0, 0xe8, 3})) << "a list";
    EXPECT_FALSE(written(0, 3, {0, 0})) << "nobody named it";
    EXPECT_FALSE(written(2, 2, {0, 0})) << "there is no such drive";
}

TEST_F(EsiDevice, A_drive_with_SoE_lists_the_parameters_of_its_telegrams) {
    const std::string process_data =
        "<Sm StartAddress='#x1200' ControlByte='#x24' Enable='1'>Outputs</Sm>"
        "<Sm StartAddress='#x1300' ControlByte='#x20' Enable='1'>Inputs</Sm>"
        "<RxPdo Sm='2'><Index>24</Index><Name>MDT</Name>"
        "<Entry><Index>134</Index><BitLen>16</BitLen><Name>Master control word</Name></Entry>"
        "<Entry><Index>47</Index><BitLen>32</BitLen><Name>Position command</Name></Entry></RxPdo>"
        "<TxPdo Sm='3'><Index>#x1010</Index><Name>AT</Name>"
        "<Entry><Index>135</Index><BitLen>16</BitLen><Name>Drive status word</Name></Entry>"
        "<Entry><Index>51</Index><BitLen>32</BitLen><Name>Position</Name></Entry>"
        "<Entry><Index>189</Index><BitLen>32</BitLen><Name>Distance</Name></Entry></TxPdo>";
    start("esi",
          described(std::string(mailbox_managers) + process_data + "<Mailbox><SoE/></Mailbox>"));
    to_preop();
    const auto read = [&](std::uint8_t drive, std::uint16_t number, std::uint8_t element) {
        Bytes request(soe::header_bytes);
        soe::write(request.data(), {soe::Opcode::read, false, false, drive, element, number});
        Bytes answer = ask(MailboxType::soe, request);
        const auto header = soe::read(answer);
        EXPECT_TRUE(header && !header->error) << number;
        answer.erase(answer.begin(), answer.begin() + soe::header_bytes);
        return answer;
    };
    // IEC 61800-7-204: two lengths, then the parameters after the control or status word
    EXPECT_EQ(read(0, soe::idn_mdt_list, soe::element::value), (Bytes{2, 0, 2, 0, 47, 0}));
    EXPECT_EQ(read(1, soe::idn_at_list, soe::element::value), (Bytes{4, 0, 4, 0, 51, 0, 189, 0}));
    EXPECT_EQ(read(0, 47, soe::element::attribute), (Bytes{0, 0, 2, 0})) << "4 bytes";
    EXPECT_EQ(read(0, 134, soe::element::attribute), (Bytes{0, 0, 1, 0})) << "2 bytes";
}

TEST_F(EsiDevice, The_servo_accepts_a_mapping_that_is_written_object_by_object) {
    start("servo");
    to_preop();
    struct Write {
        std::uint16_t index;
        std::uint8_t sub;
        std::uint32_t value;
        std::size_t bytes;
    };
    const Write writes[] = {
        {0x1c12, 0, 0, 1},          {0x1c13, 0, 0, 1},          {0x1600, 0, 0, 1},
        {0x1601, 0, 0, 1},          {0x1602, 0, 0, 1},          {0x1603, 0, 0, 1},
        {0x1a00, 0, 0, 1},          {0x1a01, 0, 0, 1},          {0x1600, 1, 0x60400010, 4},
        {0x1600, 2, 0x607a0020, 4}, {0x1603, 1, 0x60600008, 4}, {0x1a00, 1, 0x60410010, 4},
        {0x1a01, 1, 0x60640020, 4}, {0x1600, 0, 2, 1},          {0x1603, 0, 1, 1},
        {0x1a00, 0, 1, 1},          {0x1a01, 0, 1, 1},          {0x1c12, 1, 0x1600, 2},
        {0x1c12, 2, 0x1603, 2},     {0x1c13, 1, 0x1a00, 2},     {0x1c13, 2, 0x1a01, 2},
        {0x1c12, 0, 2, 1},          {0x1c13, 0, 2, 1}};
    for (const Write& write : writes) {
        ASSERT_EQ(download(write.index, write.sub, write.value, write.bytes), 0U)
            << std::hex << write.index << ":" << unsigned{write.sub};
    }
    sync_manager(2, area(sii::SmType::outputs).start, 7, 0x64);
    sync_manager(3, area(sii::SmType::inputs).start, 6, 0x20);
    EXPECT_EQ(request(State::safeop), 4U);
}

TEST_F(EsiDevice, Keeps_the_last_file_of_an_unknown_name_that_was_written) {
    start("esi", described(mailbox_managers + std::string("<Mailbox><FoE/></Mailbox>")));
    to_preop();
    const auto packet = [](foe::Opcode opcode, std::uint32_t value, std::string_view text) {
        Bytes bytes(foe::header_bytes);
        foe::write_header(bytes.data(), opcode, value);
        bytes.insert(bytes.end(), text.begin(), text.end());
        return bytes;
    };
    const auto read_file = [&](std::string_view name) {
        const Bytes answer = ask(MailboxType::foe, packet(foe::Opcode::read, 0, name));
        return std::string(foe::read(answer)->text());
    };
    const auto write_file = [&](std::string_view name, std::string_view content) {
        ask(MailboxType::foe, packet(foe::Opcode::write, 0, name));
        ask(MailboxType::foe, packet(foe::Opcode::data, 1, content));
    };
    const Bytes missing = ask(MailboxType::foe, packet(foe::Opcode::read, 0, "a.efw"));
    EXPECT_EQ(foe::read(missing)->value, static_cast<std::uint32_t>(foe::Error::not_found));
    write_file("a.efw", "long content");
    EXPECT_EQ(read_file("a.efw"), "long content");
    write_file("b.efw", "short");
    EXPECT_EQ(read_file("b.efw"), "short");
    const Bytes replaced = ask(MailboxType::foe, packet(foe::Opcode::read, 0, "a.efw"));
    EXPECT_EQ(foe::read(replaced)->value, static_cast<std::uint32_t>(foe::Error::not_found));
}

TEST_F(EsiDevice, Serves_objects_by_AoE) {
    start("esi", described(mailbox_managers + std::string("<Mailbox><AoE/><CoE/></Mailbox>")));
    to_preop();
    Bytes ads(aoe::header_bytes + aoe::address_bytes);
    aoe::Header header;
    header.command = aoe::Command::read;
    header.length = aoe::address_bytes;
    aoe::write(ads.data(), header);
    put(&ads[32], aoe::group_sdo);
    put(&ads[36], aoe::sdo_offset(0x1018, 2));
    put<std::uint32_t>(&ads[40], 4);
    const Bytes answer = ask(MailboxType::aoe, ads);
    ASSERT_EQ(answer.size(), aoe::header_bytes + 12U);
    EXPECT_EQ(get<std::uint32_t>(&answer[40]), 7U);
}

TEST(EsiDeviceNotes, Name_the_protocols_that_are_not_emulated) {
    const DeviceOptions options = described(mailbox_managers + std::string("<Mailbox><VoE/><CoE/>"
                                                                           "<FoE/></Mailbox>"));
    EXPECT_EQ(not_emulated(*options.described), "its mailbox protocol VoE");
    EXPECT_EQ(not_emulated(*described("").described), "");
}

}  // namespace
