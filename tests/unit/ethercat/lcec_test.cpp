// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/config/config.hpp"
#include "ethercat/config/igh_conf.hpp"
#include "ethercat/config/lcec_init_commands.hpp"

namespace hal::ethercat::config {
namespace {

const char* const machine =
    "<masters>\n <master idx=\"0\" appTimePeriod=\"1000000\" refClockSyncCycles=\"-1\">\n"
    "  <slave idx=\"0\" type=\"generic\" name=\"x\" vid=\"0000CAFE\" pid=\"0x402\" "
    "configPdos=\"true\">\n"
    "   <dcConf assignActivate=\"300\" sync0Cycle=\"*1\" sync0Shift=\"25000\"/>\n   <watchdog "
    "divider=\"2498\" intervals=\"1000\"/>\n"
    "   <sdoConfig idx=\"60C2\" subIdx=\"1\"><sdoDataRaw data=\"E8 03\"/></sdoConfig>\n   "
    "<sdoConfig idx=\"8000\" "
    "subIdx=\"complete\"><sdoDataRaw data=\"01 00\"/></sdoConfig>\n"
    "   <syncManager idx=\"2\" dir=\"out\">\n    <pdo idx=\"1600\">\n     <pdoEntry idx=\"6040\" "
    "subIdx=\"00\" bitLen=\"16\" "
    "halType=\"u32\" halPin=\"control\"/>\n"
    "     <pdoEntry idx=\"607A\" subIdx=\"00\" bitLen=\"32\" halType=\"float\" halPin=\"target\" "
    "scale=\"100\" offset=\"2\"/>\n    "
    "</pdo>\n   </syncManager>\n"
    "   <syncManager idx=\"3\" dir=\"in\">\n    <pdo idx=\"1A00\">\n     <pdoEntry idx=\"6064\" "
    "subIdx=\"00\" bitLen=\"32\" "
    "halType=\"float\" halPin=\"pos\" scale=\"0.01\"/>\n"
    "     <pdoEntry idx=\"6000\" subIdx=\"01\" bitLen=\"4\" halType=\"bit\" halPin=\"in\"/>\n     "
    "<pdoEntry idx=\"6041\" subIdx=\"00\" "
    "bitLen=\"16\" halType=\"complex\">\n"
    "      <complexEntry bitLen=\"1\" halType=\"bit\" halPin=\"ready\"/>\n      <complexEntry "
    "bitLen=\"3\"/>\n      <complexEntry "
    "bitLen=\"4\" halType=\"u32\" halPin=\"code\"/>\n"
    "     </pdoEntry>\n     <pdoEntry idx=\"0000\" subIdx=\"00\" bitLen=\"4\"/>\n    </pdo>\n   "
    "</syncManager>\n  </slave>\n"
    "  <slave idx=\"1\" type=\"basic_cia402\" name=\"y\" vid=\"1\" pid=\"2\" syncUnit=\"io\" "
    "syncUnitCycle=\"*2\">\n   <modParam "
    "name=\"enableCSP\" value=\"true\"/>\n"
    "   <modParam name=\"enableDigitalInput\" value=\"1\"/>\n  </slave>\n </master>\n</masters>\n";

std::string errors(const std::string& slave) {
    return to_string(
        read("<masters><master idx=\"0\">\n" + slave + "\n</master></masters>", "c.xml"), "c.xml");
}

TEST(Lcec, Generic_slave_has_its_pins_and_settings) {
    const ReadResult r = read(machine, "ethercat-conf.xml");
    ASSERT_EQ(to_string(r, "c.xml"), "");
    ASSERT_EQ(r.buses.size(), 1U);
    EXPECT_TRUE(r.lcec);
    const Bus& bus = r.buses[0];
    EXPECT_EQ(bus.name, "0");
    EXPECT_EQ(bus.setup.lead, master::ClockLead::reference);
    const master::Slave& x = bus.setup.slaves.at(0);
    EXPECT_EQ(x.identity.vendor, 0xcafeU);
    EXPECT_EQ(x.identity.product, 0x402U);
    EXPECT_EQ(x.dc->assign_activate, 0x300);
    EXPECT_EQ(x.dc->sync0_cycle_ns, 1'000'000);
    EXPECT_EQ(x.watchdog.intervals, 1000);
    ASSERT_EQ(x.startup.size(), 2U);
    EXPECT_EQ(x.startup[0].data, (std::vector<std::uint8_t>{0xe8, 3}));
    EXPECT_TRUE(x.startup[1].complete);
    const master::Entry& target = x.sync_managers.at(0).pdos.at(0).entries.at(1);
    EXPECT_EQ(target.name, "target");
    EXPECT_DOUBLE_EQ((3.0 - target.offset) / target.scale, 500.0)
        << "written: (pin + offset) x scale";
    const master::Pdo& in = x.sync_managers.at(1).pdos.at(0);
    EXPECT_DOUBLE_EQ(in.entries[0].scale, 0.01);
    ASSERT_EQ(in.entries.size(), 10U);
    EXPECT_EQ(in.entries[1].name, "in-0");
    EXPECT_EQ(in.entries[4].name, "in-3");
    EXPECT_EQ(in.entries[5].name, "ready");
    EXPECT_EQ(in.entries[6].name, "");
    EXPECT_EQ(in.entries[7].name, "code");
    EXPECT_EQ(in.entries[8].bits, 8);
    EXPECT_EQ(in.mapped(), 4U);
    EXPECT_EQ(in.mapping(1), 0x60000104U);
    EXPECT_EQ(in.mapping(2), 0x60410010U);
    EXPECT_EQ(in.mapping(3), 0x00000004U);
}

TEST(Lcec, Drive_class_has_the_pins_of_its_parameters) {
    const ReadResult r = read(machine, "ethercat-conf.xml");
    const master::Slave& y = r.buses.at(0).setup.slaves.at(1);
    EXPECT_EQ(r.buses[0].setup.domains.at(y.domain).every, 2U);
    const SlaveInfo& info = r.buses[0].slaves.at(1);
    for (const char* pin : {"srv-cia-controlword", "srv-cia-statusword", "srv-opmode",
                            "srv-opmode-display", "srv-actual-position", "srv-target-position",
                            "srv-actual-velocity", "srv-target-velocity", "srv-din-negative-limit",
                            "srv-din-home", "srv-din-0", "srv-din-15"}) {
        EXPECT_NE(info.find(pin), nullptr) << pin;
    }
    EXPECT_EQ(info.find("srv-actual-torque"), nullptr);
    EXPECT_EQ(y.sync_managers.at(1).pdos.at(0).mapping(0), 0x60410010U);
    EXPECT_EQ(y.sync_managers.at(1).pdos.at(0).mapping(3), 0x60610008U);
    EXPECT_EQ(y.sync_managers.at(1).pdos.at(0).mapping(4), 0x60fd0020U) << "last, as in lcec";
}

TEST(Lcec, Errors_name_the_element_and_its_line) {
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\"><sdo/></slave>"),
              "c.xml:2:48: error: unknown element <sdo> in <slave>; did you mean 'sdoConfig'?");
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\" alias=\"4\"/>"),
              "c.xml:2:2: error: unknown attribute 'alias' of <slave>; the attributes are: idx, "
              "type, name, vid, pid, configPdos, "
              "syncUnit, syncUnitCycle");
    EXPECT_EQ(
        errors("<slave idx=\"0\"/>"),
        "c.xml:2:2: error: missing attribute 'type' of <slave>; write the type of the device, "
        "as in type=\"EL1008\", or type=\"generic\" with its PDOs");
    EXPECT_EQ(
        errors("<slave idx=\"0\" type=\"generic\" vid=\"xy\" pid=\"2\"/>"),
        "c.xml:2:2: error: invalid vid 'xy' of <slave>; write a hexadecimal number of 0..FFFFFFFF");
    EXPECT_EQ(
        errors("<slave idx=\"0\" type=\"basic_cia402\" vid=\"1\" pid=\"2\"><modParam "
               "name=\"enableCPS\" value=\"1\"/><modParam "
               "name=\"enableCSP\" value=\"maybe\"/></slave>"),
        "c.xml:2:2: error: invalid value 'maybe' of modParam 'enableCSP': expected true or false\n"
        "c.xml:2:53: error: unsupported modParam 'enableCPS'; did you mean 'enableCSP'?");
    EXPECT_NE(errors("<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\"><syncManager idx=\"3\" "
                     "dir=\"in\"><pdo idx=\"1A00\"><pdoEntry idx=\"6000\" subIdx=\"01\" "
                     "bitLen=\"16\" halType=\"\" halPin=\"x\"/></pdo></syncManager></slave>")
                  .find("error: pin 'x' has no halType; write halType=\"u32\""),
              std::string::npos);
    EXPECT_EQ(
        to_string(read("<x/>", "c.xml"), "c.xml"),
        "c.xml:1:2: error: the root element is 'x', not masters; the file begins with <masters>");
}

TEST(Lcec, Idn_configuration_is_written_by_SoE_in_its_state) {
    const auto slave = [](const std::string& idns) {
        return "<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\">" + idns + "</slave>";
    };
    const ReadResult r =
        read("<masters><master idx=\"0\">" +
                 slave("<idnConfig drive=\"1\" idn=\"P-0-150\" state=\"SAFEOP\"><idnDataRaw "
                       "data=\"07 00\"/><idnDataRaw data=\"0A\"/></idnConfig>"
                       "<idnConfig idn=\"S-0-15\"><idnDataRaw data=\"0700\"/></idnConfig>") +
                 "</master></masters>",
             "c.xml");
    ASSERT_EQ(to_string(r, "c.xml"), "");
    const auto& writes = r.buses.at(0).setup.slaves.at(0).startup;
    ASSERT_EQ(writes.size(), 2U);
    EXPECT_EQ(writes[0].protocol, master::StartupWrite::Protocol::soe);
    EXPECT_EQ(writes[0].index, 0x8096);
    EXPECT_EQ(writes[0].sub, 1);
    EXPECT_EQ(writes[0].before, State::op);
    EXPECT_EQ(writes[0].data, (std::vector<std::uint8_t>{7, 0, 10}));
    EXPECT_EQ(writes[1].index, 15);
    EXPECT_EQ(writes[1].sub, 0);
    EXPECT_EQ(writes[1].before, State::safeop) << "in PRE-OP, where no state is given";
    EXPECT_EQ(errors(slave("<idnConfig idn=\"X-0-1\"><idnDataRaw data=\"07\"/></idnConfig>")),
              "c.xml:2:48: error: invalid idn 'X-0-1' of <idnConfig>; write idn=\"S-0-15\" or "
              "idn=\"P-0-150\"");
    EXPECT_EQ(errors(slave(
                  "<idnConfig idn=\"S-0-15\" state=\"OP\"><idnDataRaw data=\"07\"/></idnConfig>")),
              "c.xml:2:48: error: invalid state 'OP' of <idnConfig>; write state=\"PREOP\" or "
              "state=\"SAFEOP\", the state in which the IDN "
              "is written");
    EXPECT_EQ(
        errors(slave("<idnConfig idn=\"S-0-15\"/>")),
        "c.xml:2:48: error: <idnConfig> has no data; write <idnDataRaw data=\"E8 03\"/> in it");
    EXPECT_EQ(errors(slave("<idnConfig idn=\"S-0-15\"><idnDataRaw data=\"7\"/></idnConfig>")),
              "c.xml:2:72: error: invalid data '7'; write hexadecimal bytes in the order of the "
              "wire, as in data=\"E8 03\"");
}

constexpr const char* init_file = R"(<?xml version="1.0"?>
<EtherCATMailbox>
  <CoE><InitCmds>
    <InitCmd><Transition>PS</Transition><Timeout>0</Timeout><Ccs>1</Ccs><Index>24672</Index><SubIndex>0</SubIndex><Data>08</Data></InitCmd>
    <InitCmd CompleteAccess="true"><Transition>IP</Transition><Index>#x8000</Index><SubIndex>1</SubIndex><Data>d0 07</Data></InitCmd>
    <InitCmd><Transition>PS</Transition><Index>1</Index><Data>00</Data><Disabled>1</Disabled></InitCmd>
    <InitCmd><Transition>PS</Transition><Ccs>2</Ccs><Index>1</Index></InitCmd>
    <InitCmd><Transition>SO</Transition><Transition>OS</Transition><Index>8193</Index><Data>0500</Data></InitCmd>
  </InitCmds></CoE>
  <SoE><InitCmds>
    <InitCmd><Transition>PS</Transition><OpCode>3</OpCode><DriveNo>1</DriveNo><IDN>32918</IDN><Data>0700</Data></InitCmd>
  </InitCmds></SoE>
</EtherCATMailbox>
)";

TEST(Lcec, Init_commands_of_TwinCAT_are_written_at_their_transitions) {
    const auto with = [](const std::string& file) {
        return read(
            "<masters><master idx=\"0\"><slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\">\n"
            "<initCmds filename=\"init.xml\"/></slave></master></masters>",
            "folder/c.xml", [&](const std::string& path, std::string& text) {
            text = file.empty() ? "no such file" : file;
            return path == "folder/init.xml" && !file.empty();
        });
    };
    const ReadResult r = with(init_file);
    ASSERT_EQ(to_string(r, "c.xml"), "");
    ASSERT_EQ(r.messages.size(), 1U);
    EXPECT_EQ(r.messages[0].sentence,
              "'folder/init.xml', line 8: a command at transition 'OS' is left out");
    EXPECT_EQ(r.messages[0].severity, Severity::warning);
    const auto& writes = r.buses.at(0).setup.slaves.at(0).startup;
    ASSERT_EQ(writes.size(), 4U);
    EXPECT_EQ(writes[0].index, 0x8000) << "IP before PS";
    EXPECT_TRUE(writes[0].complete);
    EXPECT_EQ(writes[0].data, (std::vector<std::uint8_t>{0xd0, 7}));
    EXPECT_EQ(writes[1].index, 0x6060);
    EXPECT_EQ(writes[1].before, State::safeop);
    EXPECT_EQ(writes[1].line, 2U) << "of the configuration";
    EXPECT_EQ(writes[2].protocol, master::StartupWrite::Protocol::soe);
    EXPECT_EQ(writes[2].index, 0x8096);
    EXPECT_EQ(writes[2].sub, 1);
    EXPECT_EQ(writes[3].index, 0x2001);
    EXPECT_EQ(writes[3].before, State::op);

    const auto wrong = [&](const std::string& command) {
        return to_string(with("<EtherCATMailbox><CoE><InitCmds>\n" + command +
                              "</InitCmds></CoE></EtherCATMailbox>"),
                         "c.xml");
    };
    EXPECT_EQ(wrong("<InitCmd><Transition>PS</Transition><Data>00</Data></InitCmd>"),
              "c.xml:2:2: error: 'folder/init.xml', line 2: missing <Index> in <InitCmd>; write "
              "the number in decimal, or as #x6040");
    EXPECT_EQ(
        wrong("<InitCmd><Transition>PS</Transition><Index>x</Index><Data>00</Data></InitCmd>"),
        "c.xml:2:2: error: 'folder/init.xml', line 2: invalid Index 'x'; write a number of "
        "0..65535 in decimal, or as #x6040");
    EXPECT_EQ(wrong("<InitCmd><Transition>PS</Transition><Index>1</Index><Data>0</Data></InitCmd>"),
              "c.xml:2:2: error: 'folder/init.xml', line 2: invalid <Data> in <InitCmd>; write "
              "hexadecimal bytes in the order of the wire, "
              "as in <Data>e803</Data>");
    EXPECT_EQ(wrong("<InitCmd><Index>1</Index><Data>00</Data></InitCmd>"),
              "c.xml:2:2: error: 'folder/init.xml', line 2: missing <Transition> in <InitCmd>; "
              "write <Transition>PS</Transition>");
    EXPECT_EQ(wrong(""),
              "c.xml:2:2: error: 'folder/init.xml', line 1: the file writes nothing; it has "
              "<CoE><InitCmds><InitCmd> or "
              "<SoE><InitCmds><InitCmd>");
    EXPECT_EQ(to_string(with("<masters/>"), "c.xml"),
              "c.xml:2:2: error: 'folder/init.xml', line 1: the root element is 'masters', not "
              "EtherCATMailbox; export the start-up "
              "commands of the slave in TwinCAT");
    EXPECT_EQ(to_string(with(""), "c.xml"),
              "c.xml:2:2: error: cannot read 'folder/init.xml': no such file; write the path of a "
              "file beside this one");
}

TEST(Lcec, Interfaces_come_from_ethercat_conf) {
    const std::string text =
        "# MASTER0_DEVICE=\"no\"\nMASTER0_DEVICE=\"00:11:22:aa:bb:cc\" # comment\n MASTER1_DEVICE "
        "= enp3s0 # x\n"
        "MASTER1_BACKUP='sim:ring'\nMASTER12_DEVICE=\"eth:x\"\n";
    EXPECT_EQ(device_of(text, 0, false), "00:11:22:aa:bb:cc");
    EXPECT_EQ(device_of(text, 0, true), "");
    EXPECT_EQ(device_of(text, 1, false), "enp3s0");
    EXPECT_EQ(device_of(text, 1, true), "sim:ring");
    EXPECT_EQ(device_of(text, 2, false), "");
    EXPECT_EQ(link_of_device("enp3s0"), "eth:enp3s0");
    EXPECT_EQ(link_of_device("sim:ring"), "sim:ring");
    EXPECT_EQ(link_of_device("00:11:22:aa:bb:cc", "no-such-folder"), "");
    EXPECT_EQ(link_of_device("00:00:00:00:00:00"), "eth:lo")
        << "the loopback interface has this address";
}

TEST(Lcec, Any_bytes_are_read_without_harm) {
    std::mt19937 random(4);
    for (int n = 0; n < 3000; ++n) {
        std::string text = machine;
        for (int i = 0; i < 1 + n % 5; ++i) {
            const std::size_t at = 1 + random() % (text.size() - 1);
            if (n % 2 == 0) {
                text[at] = static_cast<char>('0' + random() % 64);
            } else if (random() % 2 == 0) {
                text.erase(at, random() % 12);
            } else {
                text.insert(at, text.substr(random() % text.size(), random() % 40));
            }
        }
        read(text, "c.xml");
        std::string init = init_file;
        for (int i = 0; i < 1 + n % 5; ++i) {
            init.insert(random() % init.size(), init.substr(random() % init.size(), random() % 40));
        }
        read_init_commands(init,
                           [](bool, std::uint32_t, const std::string&, const std::string&) {});
    }
}

}  // namespace
}  // namespace hal::ethercat::config
