// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/config/config.hpp"
#include "ethercat/config/plan.hpp"
#include "hal/read_file.hpp"

namespace hal::ethercat::config {
namespace {

bool read_test_file(const std::string& path, std::string& bytes) {
    return read_regular_file("tests/unit/ethercat/data/" + path, 1'000'000, bytes);
}

Bus good(const std::string& text) {
    ReadResult r = read(text, "m.ethercat", read_test_file);
    EXPECT_EQ(to_string(r, "m.ethercat"), "");
    return r.buses.at(0);
}
std::string errors(const std::string& text) {
    return to_string(read(text, "m.ethercat", read_test_file), "m.ethercat");
}

const char* const servo =
    "[bus]\nlink = sim:line\ncycle = 1ms\nclock = reference\nreference = x\n[domain io]\nevery = "
    "4\n"
    "[type drive]\nesi = servo.xml\ndevice = SERVO-1\noutputs = 6040 607A 60FE:1 gap 8\ninputs = "
    "6041, 6064\nsdo 60C2:1 = 1\nsdo 60C2:2 = "
    "-3\n"
    "dc = sync0 250us\nwatchdog = 50ms\n607A.scale = 65536/360\n607A.unit = "
    "deg\nposition-actual-value.name = position\n"
    "[slave 0 x]\ntype = drive\n[slave alias=5 y]\ntype = drive\noptional = yes\n[slave 2]\nesi = "
    "servo.xml\ndevice = DIO-8\ndomain = io\n";

TEST(EthercatConfig, Drives_of_a_type_have_its_PDOs_clocks_and_writes) {
    const Bus bus = good(servo);
    EXPECT_EQ(bus.link, "sim:line");
    EXPECT_EQ(bus.setup.cycle_ns, 1'000'000);
    ASSERT_EQ(bus.setup.slaves.size(), 3U);
    EXPECT_EQ(bus.setup.reference_slave, 0);
    const master::Slave& x = bus.setup.slaves[0];
    EXPECT_EQ(x.identity.vendor, 0xcafeU);
    EXPECT_EQ(x.identity.product, 0x402U);
    EXPECT_FALSE(x.identity.revision);
    ASSERT_EQ(x.sync_managers.size(), 2U);
    const master::SyncManager& out = x.sync_managers[0];
    EXPECT_EQ(out.number, 2);
    EXPECT_EQ(out.start, 0x1100);
    EXPECT_TRUE(out.output && out.write_assignment && out.watchdog);
    ASSERT_EQ(out.pdos.size(), 1U);
    EXPECT_EQ(out.pdos[0].index, 0x1600);
    EXPECT_TRUE(out.pdos[0].write_mapping);
    ASSERT_EQ(out.pdos[0].entries.size(), 4U);
    EXPECT_EQ(out.pdos[0].entries[0].name, "controlword");
    EXPECT_EQ(out.pdos[0].entries[1].name, "target-position");
    EXPECT_TRUE(out.pdos[0].entries[1].scaled);
    EXPECT_DOUBLE_EQ(out.pdos[0].entries[1].scale, 360.0 / 65536);
    EXPECT_EQ(out.pdos[0].entries[2].name, "digital-outputs-1");
    EXPECT_EQ(out.pdos[0].entries[3].index, 0);
    EXPECT_FALSE(x.sync_managers[1].pdos[0].write_mapping) << "as described";
    EXPECT_EQ(x.sync_managers[1].pdos[0].entries[1].name, "position");
    EXPECT_EQ(x.sync_managers[1].pdos[0].entries[1].type, master::Type::s32);
    EXPECT_EQ(bus.slaves[0].find("target-position")->unit, "deg");
    EXPECT_EQ(bus.slaves[0].cia402_axes, 1U);
    ASSERT_EQ(x.startup.size(), 3U);
    EXPECT_EQ(x.startup[0].index, 0x6060) << "of the description";
    EXPECT_EQ(x.startup[2].data, (std::vector<std::uint8_t>{0xfd}));
    EXPECT_EQ(x.startup[2].line, 14U);
    ASSERT_TRUE(x.dc);
    EXPECT_EQ(x.dc->assign_activate, 0x300);
    EXPECT_EQ(x.dc->sync0_shift_ns, 250'000);
    EXPECT_EQ(x.watchdog.intervals, 500);
    EXPECT_EQ(x.timeouts.to_preop, 2000U);
    EXPECT_TRUE(x.complete_access);
    EXPECT_EQ(bus.setup.slaves[1].identity.alias, 5);
    EXPECT_TRUE(bus.setup.slaves[1].optional);
    const master::Slave& io = bus.setup.slaves[2];
    EXPECT_EQ(io.name, "slave-2");
    EXPECT_EQ(io.domain, 1);
    EXPECT_EQ(bus.setup.domains[1].every, 4U);
    ASSERT_EQ(io.sync_managers.size(), 2U);
    EXPECT_EQ(io.sync_managers[0].number, 0);
    EXPECT_FALSE(io.sync_managers[0].write_assignment);
    EXPECT_EQ(io.sync_managers[0].pdos[0].entries[0].name, "out-0");
    EXPECT_EQ(io.sync_managers[0].pdos[0].entries[0].type, master::Type::bit);
}

TEST(EthercatConfig, Objects_of_a_drive_have_the_sign_of_CiA_402) {
    const auto description = [](const std::string& profile) {
        const auto entry = [](const std::string& index, const std::string& type) {
            return "<Entry><Index>#x" + index +
                   "</Index><SubIndex>4</SubIndex><BitLen>32</BitLen><Name>" + index +
                   "</Name><DataType>" + type + "</DataType></Entry>";
        };
        return [=](const std::string&, std::string& bytes) {
            bytes =
                "<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>"
                "<Type ProductCode='1'>D</Type>" +
                profile +
                "<Sm StartAddress='#x1100' ControlByte='#x24'>Outputs</Sm><RxPdo Sm='0' "
                "Fixed='1'><Index>#x1600</Index>" +
                entry("607A", "UDINT") + entry("60FE", "UDINT") + entry("60FF", "REAL") +
                "</RxPdo></Device></Devices></Descriptions></EtherCATInfo>";
            return true;
        };
    };
    const auto types = [&](const std::string& profile) {
        const ReadResult r =
            read("[bus]\n[slave 0 d]\nesi = d.xml\n", "d.ethercat", description(profile));
        std::vector<master::Type> all;
        for (const master::Entry& e :
             r.buses.at(0).setup.slaves.at(0).sync_managers.at(0).pdos.at(0).entries) {
            all.push_back(e.type);
        }
        return all;
    };
    using master::Type;
    EXPECT_EQ(types("<Profile><ProfileNo>402</ProfileNo></Profile>"),
              (std::vector{Type::s32, Type::u32, Type::real32}));
    EXPECT_EQ(types(""), (std::vector{Type::u32, Type::u32, Type::real32})) << "not a drive";
}

TEST(EthercatConfig, Generated_netlist_links_pins_of_equal_types_only) {
    const auto description = [](const std::string&, std::string& bytes) {
        const auto entry = [](unsigned sub, const std::string& name, const std::string& type) {
            return "<Entry><Index>#x1600</Index><SubIndex>" + std::to_string(sub) +
                   "</SubIndex><BitLen>32</BitLen><Name>" + name + "</Name><DataType>" + type +
                   "</DataType></Entry>";
        };
        bytes =
            "<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>"
            "<Type ProductCode='1'>D</Type><Profile><ProfileNo>402</ProfileNo></Profile>"
            "<Sm StartAddress='#x1100' ControlByte='#x24'>Outputs</Sm>"
            "<Sm StartAddress='#x1200' ControlByte='#x20'>Inputs</Sm>"
            "<RxPdo Sm='0' Fixed='1'><Index>#x1600</Index>" +
            entry(1, "Controlword", "UDINT") + entry(2, "Target position", "UDINT") +
            entry(3, "Target velocity", "DINT") + entry(4, "Torque actual value", "DINT") +
            "</RxPdo><TxPdo Sm='1' Fixed='1'><Index>#x1a00</Index>" +
            entry(5, "Statusword", "UDINT") +
            "</TxPdo></Device></Devices></Descriptions></EtherCATInfo>";
        return true;
    };
    const ReadResult r = read("[bus]\n[slave 0 d]\nesi = d.xml\n", "d.ethercat", description);
    const std::string text = netlist(r.buses.at(0), "d.ethercat", "");
    const auto has = [&](const std::string& part) { return text.find(part) != text.npos; };
    EXPECT_TRUE(has("=> ethercat.0.d.controlword\n"));
    EXPECT_TRUE(has("=> d.statusword\n"));
    EXPECT_TRUE(has("=> ethercat.0.d.target-velocity\n"));
    EXPECT_TRUE(has("#   in  u32   ethercat.0.d.target-position ")) << "the component's pin is s32";
    EXPECT_TRUE(has("#   in  s32   ethercat.0.d.torque-actual-value "))
        << "the component reads this value, the slave too";
}

TEST(EthercatConfig, Drive_without_a_description_has_the_objects_of_its_profile) {
    const Bus bus = good(
        "[bus]\n[slave 0 a]\ndevice = cia402\naxes = 2\nproduct = 0x10\nvendor = 1\nrevision = "
        "0x20+\noutputs = 6040 6840 2000:1 u8\n"
        "inputs = 6041\nentries-per-pdo = 2\nsdo 6860 = 8\nsdo 8000 complete = 01 00 02\nregister "
        "0420 u16 = 1000\nidn P-0-150 1 = 07 "
        "00\n");
    const master::Slave& s = bus.setup.slaves[0];
    ASSERT_EQ(s.sync_managers[0].pdos.size(), 2U);
    EXPECT_EQ(s.sync_managers[0].pdos[1].index, 0x1601);
    EXPECT_EQ(s.sync_managers[0].pdos[0].entries[1].name, "axis-2-controlword");
    EXPECT_EQ(s.sync_managers[0].pdos[1].entries[0].name, "2000-01");
    EXPECT_EQ(s.identity.revision, 0x20U);
    EXPECT_EQ(s.identity.revision_rule, RevisionRule::equal_or_higher);
    ASSERT_EQ(s.startup.size(), 4U);
    EXPECT_TRUE(s.startup[1].complete);
    EXPECT_EQ(s.startup[2].protocol, master::StartupWrite::Protocol::reg);
    EXPECT_EQ(s.startup[3].index, 0x8096);
    EXPECT_EQ(s.startup[3].sub, 1);
}

/// Two revisions of a device, and a variant of it with the same product code.
bool read_revisions(const std::string&, std::string& bytes) {
    const auto device = [](const char* type, const char* object) {
        return std::string("<Device><Type ProductCode='7' ") + type +
               "</Type><Sm>Outputs</Sm><RxPdo Sm='0' Fixed='1'><Index>#x1600</Index><Name>P</Name>"
               "<Entry><Index>#x" +
               object +
               "</Index><SubIndex>1</SubIndex><BitLen>8</BitLen><Name>V</Name><DataType>USINT"
               "</DataType></Entry></RxPdo></Device>";
    };
    bytes = "<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices>" +
            device("RevisionNo='#x10000' CheckRevisionNo='HW_EQ'>BOX, 24 V", "7001") +
            device("RevisionNo='#x20000'>BOX, 24 V", "7002") +
            device("RevisionNo='#x20010'>BOX: x", "7003") +
            "</Devices></Descriptions></EtherCATInfo>";
    return true;
}

TEST(EthercatConfig, Revision_selects_the_description) {
    const auto slave = [](const std::string& lines) {
        ReadResult r = read("[bus]\n[slave 0 a]\nesi = my boxes, all: new.xml\n" + lines,
                            "m.ethercat", read_revisions);
        EXPECT_EQ(to_string(r, "m.ethercat"), "");
        return r.buses.at(0).setup.slaves.at(0);
    };
    const auto object = [](const master::Slave& s) {
        return s.sync_managers.at(0).pdos.at(0).entries.at(0).index;
    };
    EXPECT_EQ(object(slave("device = BOX, 24 V\n")), 0x7002);
    EXPECT_EQ(object(slave("device = BOX, 24 V\nrevision = 0x10000\n")), 0x7001);
    EXPECT_EQ(object(slave("product = 7\nrevision = 0x20010+\n")), 0x7003);
    EXPECT_EQ(object(slave("device = BOX: x\n")), 0x7003);
    const master::Slave s = slave("device = BOX: x\nrevision = esi\n");
    EXPECT_EQ(s.identity.revision, 0x20010U);
    EXPECT_EQ(s.identity.revision_rule, RevisionRule::equal_or_higher);
    EXPECT_FALSE(slave("device = BOX: x\n").identity.revision);
}

/// A device that can be mapped anew, and whose start-up commands clear PDO 1600h.
bool read_commanded(const std::string&, std::string& bytes) {
    const auto pdo = [](const char* index) {
        return std::string("<RxPdo Sm='2'><Index>#x") + index +
               "</Index><Name>P</Name><Entry><Index>#x7000</Index><SubIndex>1</SubIndex>"
               "<BitLen>8</BitLen><Name>V</Name><DataType>USINT</DataType></Entry></RxPdo>";
    };
    bytes =
        "<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices><Device>"
        "<Type ProductCode='7'>BOX</Type><Sm>MBoxOut</Sm><Sm>MBoxIn</Sm><Sm>Outputs</Sm>" +
        pdo("1600") + pdo("1601") +
        "<Mailbox><CoE PdoAssign='1' PdoConfig='1'><InitCmd><Transition>PS</Transition>"
        "<Index>#x1600</Index><SubIndex>0</SubIndex><Data>00</Data></InitCmd></CoE></Mailbox>"
        "</Device></Devices></Descriptions></EtherCATInfo>";
    return true;
}

TEST(EthercatConfig, A_mapping_that_start_up_commands_write_is_restored) {
    const ReadResult r = read("[bus]\n[slave 0 a]\nesi = box.xml\n", "m.ethercat", read_commanded);
    EXPECT_EQ(to_string(r, "m.ethercat"), "");
    const auto& pdos = r.buses.at(0).setup.slaves.at(0).sync_managers.at(0).pdos;
    ASSERT_EQ(pdos.size(), 2U);
    EXPECT_TRUE(pdos[0].write_mapping);
    EXPECT_FALSE(pdos[1].write_mapping);
}

bool read_modular(const std::string&, std::string& bytes) {
    const auto module = [](const char* ident, const char* type) {
        return std::string("<Module><Type ModuleIdent='") + ident + "'>" + type +
               "</Type></Module>";
    };
    bytes =
        "<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices><Device>"
        "<Type ProductCode='7'>BOX</Type><Slots DownloadModuleIdentList='0'>"
        "<Slot><ModuleIdent Default='1'>1</ModuleIdent></Slot></Slots></Device></Devices>"
        "<Modules>" +
        module("1", "IN") + module("2", "OUT") + "</Modules></Descriptions></EtherCATInfo>";
    return true;
}

TEST(EthercatConfig, Modules_that_do_not_fit_are_reported) {
    const auto messages = [](const std::string& modules) {
        const ReadResult r = read("[bus]\n[slave 0 a]\nesi = box.xml\nmodules = " + modules + "\n",
                                  "m.ethercat", read_modular);
        std::string text;
        for (const Message& m : r.messages) {
            text += text::message_text("", m.severity, m.at, m.sentence, m.help) + "\n";
        }
        EXPECT_TRUE(!r.good() || r.buses.at(0).setup.slaves.at(0).startup.empty())
            << "the device wants no module list";
        return text;
    };
    EXPECT_EQ(messages("IN"), "");
    EXPECT_EQ(messages("IN, OUT"),
              ":4:15: error: module 'OUT' has no slot: 'BOX' has 1; leave it out\n");
    EXPECT_EQ(messages("OUT"),
              ":4:11: warning: slot 1 of 'BOX' does not name module 'OUT'; the modules of the slot "
              "are: IN\n");
    EXPECT_EQ(messages("INN"), ":4:11: error: unknown module 'INN'; did you mean 'IN'?\n");
}

TEST(EthercatConfig, A_product_with_several_types_and_an_unknown_revision_are_reported) {
    const auto first = [](const std::string& lines) {
        const ReadResult r =
            read("[bus]\n[slave 0 a]\nesi = box.xml\n" + lines, "m.ethercat", read_revisions);
        return r.messages.empty() ? std::string()
                                  : r.messages.front().sentence + "; " + r.messages.front().help;
    };
    EXPECT_EQ(first("product = 7\n"),
              "'box.xml' describes several devices with the product code 0x00000007; the devices "
              "are: BOX, 24 V, BOX: x");
    EXPECT_EQ(first("device = BOX: x\nrevision = 5\n"),
              "'box.xml' does not describe revision 5 of 'BOX: x'; the description of revision "
              "0x00020010 is used; the revisions are: 0x00020010");
    EXPECT_EQ(first("device = BOX: x\nvendor = 9\n"),
              "'box.xml' describes devices of vendor 0x00000002, not of 0x00000009; correct the "
              "key, or write the ESI file of the device");
}

TEST(EthercatConfig, Errors_name_the_place_and_what_to_write) {
    EXPECT_EQ(
        errors("link = x\n[slav 0]\n"),
        "m.ethercat:1:1: error: this line is before the first section; begin the file with [bus]\n"
        "m.ethercat:1:1: error: missing section [bus]; write [bus] and below it link = eth:enp3s0 "
        "and cycle = 1ms\n"
        "m.ethercat:2:1: error: unknown section 'slav'; did you mean 'slave'?");
    EXPECT_EQ(errors("[bus]\n"),
              "m.ethercat:1:1: error: the configuration has no slave; write [slave 0 NAME] and "
              "below it esi = FILE");
    EXPECT_EQ(
        errors("[bus]\ncycle = 3\nclock = me\n[slave 0]\nesi = none.xml\n"),
        "m.ethercat:2:9: error: invalid cycle '3'; write a time of 10us..1s, as in 10ms or 0.5s\n"
        "m.ethercat:3:9: error: invalid clock 'me'; write reference, thread or none\n"
        "m.ethercat:5:7: error: cannot read 'none.xml': No such file or directory; write the path "
        "of an ESI file, relative to this file");
    EXPECT_EQ(errors("[bus]\n[slave 0 a]\nesi = servo.xml\ndevice = SERVO-2\n"),
              "m.ethercat:4:10: error: 'servo.xml' does not describe a device 'SERVO-2'; did you "
              "mean 'SERVO-1'?");
    EXPECT_EQ(errors("[bus]\n[slave 0 a]\nesi = servo.xml\n"),
              "m.ethercat:3:7: error: 'servo.xml' describes several devices; write device = NAME; "
              "the devices are: SERVO-1, DIO-8");
    EXPECT_EQ(errors("[bus]\n[slave 0 a]\nesi = servo.xml\nproduct = 9\n"),
              "m.ethercat:4:11: error: 'servo.xml' does not describe a product 0x00000009; the "
              "devices are: "
              "SERVO-1, DIO-8");
    const std::string a = "[bus]\n[slave 0 a]\nesi = servo.xml\ndevice = SERVO-1\n";
    EXPECT_EQ(errors(a + "outputs = 6040 6072\n"),
              "m.ethercat:5:16: error: object 0x6072:0 is not in the description of 'SERVO-1'; "
              "write its type, as in 6072 u16; the types "
              "are bit, u8, u16, u32, u64, "
              "s8, s16, s32, s64, f32 or f64");
    EXPECT_EQ(errors(a + "outputs = 6040 u32\n"),
              "m.ethercat:5:11: error: object 0x6040:0 of 'SERVO-1' has 16 bits, not 32; leave out "
              "the type");
    EXPECT_EQ(errors(a + "outputs = 1602\n"),
              "m.ethercat:5:11: error: unknown PDO '1602'; the PDOs are: 1600, 1601");
    EXPECT_EQ(errors(a + "outputs = 1600 1601\n"),
              "m.ethercat:5:11: error: PDOs 1600 and 1601 of 'SERVO-1' exclude each other; assign "
              "only one of them");
    EXPECT_EQ(errors(a + "sdo 6060 = 200\n"),
              "m.ethercat:5:12: error: invalid value '200' of object 0x6060:0; write a number of "
              "-128..127, decimal or with 0x");
    EXPECT_EQ(errors(a + "outputs = 6040\n6040.name = online\n"),
              "m.ethercat:6:13: error: duplicate pin name 'online'; choose another one");
    EXPECT_EQ(errors(a + "607b.scale = 2\noutput = 6040\n"),
              "m.ethercat:5:1: error: no PDO of this slave has an object '607b'; the objects are: "
              "controlword, target-position, "
              "statusword, position-actual-value\n"
              "m.ethercat:6:1: error: unknown key 'output' of a slave; did you mean 'outputs'?");
    EXPECT_EQ(errors("[bus]\n[slave 0 a]\nesi = servo.xml\ndevice = DIO-8\noutputs = 7000:1\ndc = "
                     "sync0\n[slave 0 a]\ndevice = cia402\n"),
              "m.ethercat:5:11: error: the PDOs of 'DIO-8' are fixed: it has no CoE mailbox to map "
              "objects with; delete the line, or "
              "assign PDOs: 1600\n"
              "m.ethercat:6:6: error: 'DIO-8' has no distributed clocks; delete the line\n"
              "m.ethercat:7:1: error: duplicate slave name 'a'; first in line 2\n"
              "m.ethercat:7:1: error: duplicate position 0; first in line 2");
    EXPECT_EQ(errors(a + "dc = sync0 2ms\n"),
              "m.ethercat:5:6: error: invalid dc 'sync0 2ms'; write a shift that is shorter than "
              "the cycle");
    EXPECT_EQ(errors("[bus]\ncycle = 1ms\nsync-window = 1ns\n[slave alias=0 a]\ndevice = cia402\n"),
              "m.ethercat:3:15: error: invalid sync-window '1ns'; write a time of 10ns..1s, as in "
              "10ms or 0.5s\n"
              "m.ethercat:4:8: error: alias 0 means that a slave has none; write its position, as "
              "in [slave 0 NAME]");
    EXPECT_EQ(errors("[bus]\n[domain slow]\nevery = 100\n[slave 0 a]\ndevice = cia402\ndomain = "
                     "slow\noutputs = 6040\n"),
              "m.ethercat:4:1: error: the outputs of 'a' are sent every 100ms, but its watchdog "
              "ends after 100ms; write watchdog = 500ms "
              "in its section, "
              "watchdog = none, or a shorter cycle");
    EXPECT_EQ(errors("[bus]\n[domain slow]\nevery = 100\n[slave 0 a]\ndevice = cia402\ndomain = "
                     "slow\noutputs = 6040\nwatchdog = 500ms\n"),
              "");
    EXPECT_EQ(errors("[bus]\n[slave 0]\ndevice = x\n[slave z]\n[slave 1]\ntype = q\n"),
              "m.ethercat:3:10: error: unknown device 'x'; write device = cia402, or esi = FILE "
              "for a device with a description\n"
              "m.ethercat:4:8: error: invalid slave section: expected a position of 0..65535 and a "
              "name; write [slave 0 NAME], [slave "
              "alias=5 NAME] or [slave id=5 NAME]\n"
              "m.ethercat:6:8: error: unknown type 'q'; write [type q]");
}

TEST(EthercatConfig, Real_type_needs_the_bits_of_its_object) {
    const std::string slave =
        "[bus]\n[slave 0 a]\ndevice = cia402\noutputs = 7010:1 u16, 7020:1 u32\n";
    EXPECT_EQ(errors(slave + "7010:1.type = f32\n7020:1.type = f64\n"),
              "m.ethercat:5:15: error: type 'f32' has 32 bits, object 0x7010:1 has 16 bits; write "
              "an integer type with at least 16 bits, or float for an integer that is shown as a "
              "float\n"
              "m.ethercat:6:15: error: type 'f64' has 64 bits, object 0x7020:1 has 32 bits; write "
              "an integer type with at least 32 bits, or float for an integer that is shown as a "
              "float");
    const Bus bus = good(slave + "7020:1.type = f32\n");
    EXPECT_EQ(bus.setup.slaves[0].sync_managers[0].pdos[0].entries[1].type, master::Type::real32);
}

TEST(EthercatConfig, Plan_shows_the_arithmetic) {
    const Plan p = plan(good(servo));
    EXPECT_EQ(
        p.text,
        "frame 1, every cycle: 84 bytes\n"
        "  FRMW  10 + 8 + 2 = 20 bytes: time of the reference clock\n"
        "  LRW   10 + 36 + 2 = 48 bytes: domain default, 22 out, 12 in, 2 mailbox states, working "
        "counter 6\n"
        "frame 2, every 4 cycles: 60 bytes\n"
        "  FRMW  10 + 8 + 2 = 20 bytes: time of the reference clock\n"
        "  LRW   10 + 3 + 2 = 15 bytes: domain io, 1 out, 1 in, 1 mailbox state, working counter "
        "3\n"
        "states and mailboxes, counted in every cycle: 60 bytes, more where the cycle has time\n"
        "cycle 0 of 4: frame 1, frame 2, states and mailboxes, 22.08 us\n"
        "cycles 1 to 3 of 4: frame 1, states and mailboxes, 15.36 us\n"
        "longest cycle: 3 frames, 204 bytes: (204 + 3 x 24) x 80 ns = 22.08 us at 100 Mbit/s\n"
        "through 3 slaves x 1.00 us = 3.00 us\n"
        "cycle 1000.00 us: wire load 2.2 %, needed 100.00 us + 22.08 us + 3.00 us = 125.08 us\n"
        "input to output, default to default, at most 3 x 1000.00 us = 3000.00 us, at SYNC0\n"
        "input to output, default to io, at most 6 x 1000.00 us = 6000.00 us, at SYNC0\n"
        "input to output, io to default, at most 6 x 1000.00 us = 6000.00 us, at SYNC0\n"
        "input to output, io to io, at most 8 x 1000.00 us + 125.08 us = 8125.08 us\n");
    EXPECT_EQ(p.frames, 3U);
    EXPECT_EQ(p.input_to_output_ns, 8'125'080);
    EXPECT_TRUE(p.fits);
}

TEST(EthercatConfig, Plan_has_the_frames_that_the_master_sends) {
    std::string text =
        "[bus]\ncycle = 2ms\nclock = thread\n[defaults]\ndevice = cia402\noutputs = 2000:1 "
        "u32\ninputs = 2001:1 u32\n";
    for (int n = 0; n < 200; ++n) {
        text += "[slave " + std::to_string(n) + " s" + std::to_string(n) + "]\n" +
                (n == 199 ? "lrw = no\n" : "");
    }
    const Bus bus = good(text);
    const Plan p = plan(bus);
    std::size_t outputs = 0;
    std::size_t inputs = 0;
    std::size_t states = 0;
    unsigned wkc = 0;
    ASSERT_EQ(p.cyclic.size(), 2U) << "1800 bytes";
    for (const PlannedFrame& f : p.cyclic) {
        EXPECT_LE(f.bytes, 1514U);
        for (const PlannedDatagram& d : f.datagrams) {
            outputs += d.output_bytes;
            inputs += d.input_bytes;
            states += d.mailbox_states;

            wkc += d.expected_wkc;
            EXPECT_EQ(d.data_bytes,
                      d.domain.empty() ? 8 : d.output_bytes + d.input_bytes + d.mailbox_states);
        }
    }
    EXPECT_EQ(outputs, 800U);
    EXPECT_EQ(inputs, 800U);
    EXPECT_EQ(states, 200U);
    EXPECT_EQ(wkc, 199U * 3 + 2) << "the last one by LWR and LRD";
    EXPECT_EQ(p.cyclic[0].datagrams[0].command, "NOP") << "no slave has dc";
    EXPECT_EQ(p.trips.size(), 1U);
    EXPECT_EQ(p.trips[0].cycles, 2U);
}

TEST(EthercatConfig, Written_file_is_read_again_without_errors) {
    Found drive;
    drive.name = "Axis X";
    drive.device = "SERVO-1";
    drive.vendor = 0xcafe;
    drive.product = 0x402;

    drive.revision = 0x10001;
    drive.assign_activate = 0x300;
    drive.rx = {{0x1601,
                 2,
                 0,
                 "",
                 0,
                 {{0x6040, 0, "", 6, 16, 0}, {0, 0, "", 0, 8, 0}, {0x7000, 1, "", 1, 1, 0}}},
                {0x1602, 0xff, 0, "", 0, {{0x6040, 0, "", 6, 16, 0}}}};
    drive.tx = {{0x1a00, 3, 0, "", 0, {{0x6064, 0, "", 4, 32, 0}}}};
    const std::string text = write("eth:enp3s0", 1'000'000, {drive, drive});
    EXPECT_TRUE(
        text.starts_with("[bus]\nlink  = eth:enp3s0\ncycle = 1ms\n\n[slave 0 axis-x]  # "
                         "SERVO-1\nvendor   = 0xCAFE\nproduct  = "
                         "0x402\nrevision = 0x10001+  # or a higher one\n"
                         "outputs = 6040 u16, gap 8, 7000:1 bit\ninputs  = 6064 s32\n"))
        << text;
    const Bus bus = good(text);
    ASSERT_EQ(bus.setup.slaves.size(), 2U);
    EXPECT_EQ(bus.setup.slaves[1].name, "axis-x-1");
    EXPECT_EQ(bus.setup.slaves[0].sync_managers[0].pdos[0].index, 0x1601);
    EXPECT_EQ(bus.setup.slaves[0].dc->assign_activate, 0x300);
}

TEST(EthercatConfig, Any_bytes_are_read_without_harm) {
    std::mt19937 random(3);
    for (int n = 0; n < 1500; ++n) {
        std::string text = servo;
        for (int i = 0; i < 1 + n % 6; ++i) {
            const std::size_t at = random() % text.size();
            switch (random() % 3) {
            case 0: text[at] = static_cast<char>(random()); break;
            case 1: text.erase(at, random() % 20); break;
            default: text.insert(at, text.substr(random() % text.size(), random() % 40)); break;
            }
        }
        for (const Bus& bus : read(text, "m.ethercat", read_test_file).buses) {
            plan(bus);
        }
    }
}

TEST(EthercatConfig, Ethernet_over_EtherCAT_has_settings_for_the_slave_and_an_interface_here) {
    const std::string bus = "[bus]\nlink = sim:line\n";

    const std::string rest = "vendor = 1\nproduct = 2\noutputs = none\ninputs = none\n";
    const Bus one = good(bus + "[slave 0 panel]\n" + rest +
                         "eoe = 192.168.2.10/28 host 192.168.2.1 dns 10.0.0.1\n[slave 1 b]\n" +
                         rest + "eoe = dhcp interface eth7\n[slave 2 c]\n" + rest +
                         "eoe = yes\n[slave 3 d]\n" + rest + "eoe = no\n");
    const auto& slaves = one.setup.slaves;
    ASSERT_TRUE(slaves[0].eoe && slaves[0].eoe_ip);
    const eoe::Ip& ip = *slaves[0].eoe_ip;
    EXPECT_EQ(ip.flags, 0x1fU) << "without gaps";
    EXPECT_EQ(ip.address, 0xc0a8020aU);
    EXPECT_EQ(ip.mask, 0xfffffff0U);
    EXPECT_EQ(ip.gateway, 0U);
    EXPECT_EQ(ip.dns, 0x0a000001U);
    EXPECT_EQ(ip.mac[0], 2) << "locally administered";
    EXPECT_EQ(one.slaves[0].eoe.name, "eoe-panel");
    EXPECT_EQ(one.slaves[0].eoe.ip, 0xc0a80201U);
    EXPECT_EQ(one.slaves[0].eoe.prefix, 28U);
    ASSERT_TRUE(slaves[1].eoe_ip);
    EXPECT_EQ(slaves[1].eoe_ip->flags, 1U) << "the MAC address only";
    EXPECT_NE(slaves[1].eoe_ip->mac, ip.mac);
    EXPECT_EQ(one.slaves[1].eoe.name, "eth7");
    EXPECT_TRUE(slaves[2].eoe && !slaves[2].eoe_ip);
    EXPECT_FALSE(slaves[3].eoe);
    const Bus two = good(bus + "eoe-switch = eoe0 192.168.2.1/24\n[slave 0 a]\n" + rest +
                         "eoe = 192.168.2.10/24\n");
    EXPECT_EQ(two.eoe_switch.name, "eoe0");
    EXPECT_EQ(two.eoe_switch.ip, 0xc0a80201U);

    const std::string usual =
        "write yes, dhcp, or an address with its prefix, as in 192.168.2.10/24; gateway ADDRESS, "
        "dns ADDRESS, mac "
        "ADDRESS, interface NAME and host ADDRESS may follow";
    for (const char* wrong :
         {"192.168.2.10", "192.168.2.10/33", "192.168.2.10/24 gateway", "192.168.2.10/24 gateway x",
          "yes gateway 10.0.0.1", "yes mac 01:00:00:00:00:01", "yes interface a/b", "maybe"}) {
        EXPECT_NE(errors(bus + "[slave 0 a]\n" + rest + "eoe = " + wrong + "\n").find(usual),
                  std::string::npos)
            << errors(bus + "[slave 0 a]\n" + rest + "eoe = " + wrong + "\n");
    }
    EXPECT_EQ(errors(bus + "[slave 0 a-very-long-name]\n" + rest + "eoe = yes\n"),
              "m.ethercat:3:1: error: 'eoe-a-very-long-name' is too long for the name of an "
              "interface: at most 15 characters; write a "
              "shorter one "
              "at the end of `eoe`: interface eoe0");
    EXPECT_EQ(errors(bus + "[slave 0 a]\n" + rest + "eoe = 10.0.0.2/8\n[slave 1 b]\n" + rest +
                     "eoe = 10.0.0.2/8 interface eoe-a\n"),
              "m.ethercat:9:1: error: duplicate interface 'eoe-a'; first in line 3; for one "
              "interface of all, write eoe-switch = eoe-a in [bus]\n"
              "m.ethercat:9:1: error: duplicate IP address 10.0.0.2; first in line 3");
    EXPECT_EQ(errors(bus + "eoe-switch = eoe0\n[slave 0 a]\n" + rest + "eoe = yes interface x\n"),
              "m.ethercat:4:1: error: `interface` and `host` of 'a' do not apply: all slaves are "
              "at eoe0; delete them from `eoe`, or delete "
              "`eoe-switch` in [bus]");
}

TEST(EthercatConfig, Reaction_to_a_clock_out_of_step_is_chosen) {
    const std::string slave =
        "[slave 0 a]\nvendor = 1\nproduct = 2\noutputs = none\ninputs = none\n";
    EXPECT_EQ(good("[bus]\n" + slave).setup.dc_loss, master::DcLoss::report);
    const Bus bus = good("[bus]\ndc-loss = safeop\ndc-loss-time = 20ms\n" + slave);
    EXPECT_EQ(bus.setup.dc_loss, master::DcLoss::safeop);
    EXPECT_EQ(bus.setup.dc_loss_ns, 20'000'000);
    EXPECT_NE(errors("[bus]\ndc-loss = stop\n" + slave).find("report or safeop"),
              std::string::npos);
}

}  // namespace
}  // namespace hal::ethercat::config
