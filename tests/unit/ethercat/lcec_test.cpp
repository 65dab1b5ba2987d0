// SPDX-License-Identifier: MIT
#include <random>

#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {
namespace {

const char* const machine =
    "<masters>\n <master idx=\"0\" appTimePeriod=\"1000000\" refClockSyncCycles=\"-1\">\n"
    "  <slave idx=\"0\" type=\"generic\" name=\"x\" vid=\"0000CAFE\" pid=\"0x402\" configPdos=\"true\">\n"
    "   <dcConf assignActivate=\"300\" sync0Cycle=\"*1\" sync0Shift=\"25000\"/>\n   <watchdog divider=\"2498\" intervals=\"1000\"/>\n"
    "   <sdoConfig idx=\"60C2\" subIdx=\"1\"><sdoDataRaw data=\"E8 03\"/></sdoConfig>\n   <sdoConfig idx=\"8000\" "
    "subIdx=\"complete\"><sdoDataRaw data=\"01 00\"/></sdoConfig>\n"
    "   <syncManager idx=\"2\" dir=\"out\">\n    <pdo idx=\"1600\">\n     <pdoEntry idx=\"6040\" subIdx=\"00\" bitLen=\"16\" "
    "halType=\"u32\" halPin=\"control\"/>\n"
    "     <pdoEntry idx=\"607A\" subIdx=\"00\" bitLen=\"32\" halType=\"float\" halPin=\"target\" scale=\"100\" offset=\"2\"/>\n    "
    "</pdo>\n   </syncManager>\n"
    "   <syncManager idx=\"3\" dir=\"in\">\n    <pdo idx=\"1A00\">\n     <pdoEntry idx=\"6064\" subIdx=\"00\" bitLen=\"32\" "
    "halType=\"float\" halPin=\"pos\" scale=\"0.01\"/>\n"
    "     <pdoEntry idx=\"6000\" subIdx=\"01\" bitLen=\"4\" halType=\"bit\" halPin=\"in\"/>\n     <pdoEntry idx=\"6041\" subIdx=\"00\" "
    "bitLen=\"16\" halType=\"complex\">\n"
    "      <complexEntry bitLen=\"1\" halType=\"bit\" halPin=\"ready\"/>\n      <complexEntry bitLen=\"3\"/>\n      <complexEntry "
    "bitLen=\"4\" halType=\"u32\" halPin=\"code\"/>\n"
    "     </pdoEntry>\n     <pdoEntry idx=\"0000\" subIdx=\"00\" bitLen=\"4\"/>\n    </pdo>\n   </syncManager>\n  </slave>\n"
    "  <slave idx=\"1\" type=\"basic_cia402\" name=\"y\" vid=\"1\" pid=\"2\" syncUnit=\"io\" syncUnitCycle=\"*2\">\n   <modParam "
    "name=\"enableCSP\" value=\"true\"/>\n"
    "   <modParam name=\"enableDigitalInput\" value=\"1\"/>\n  </slave>\n </master>\n</masters>\n";

std::string errors(const std::string& slave) {
    return to_string(read("<masters><master idx=\"0\">\n" + slave + "\n</master></masters>", "c.xml"), "c.xml");
}

TEST(Lcec, Generic_slave_has_its_pins_and_settings) {
    const Reading r = read(machine, "ethercat-conf.xml");
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
    EXPECT_DOUBLE_EQ((3.0 - target.offset) / target.scale, 500.0) << "written: (pin + offset) x scale";
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
    const Reading r = read(machine, "ethercat-conf.xml");
    const master::Slave& y = r.buses.at(0).setup.slaves.at(1);
    EXPECT_EQ(r.buses[0].setup.domains.at(y.domain).every, 2U);
    const SlaveInfo& info = r.buses[0].slaves.at(1);
    for (const char* pin :
         {"srv-cia-controlword", "srv-cia-statusword", "srv-opmode", "srv-opmode-display", "srv-actual-position", "srv-target-position",
          "srv-actual-velocity", "srv-target-velocity", "srv-din-negative-limit", "srv-din-home", "srv-din-0", "srv-din-15"})
        EXPECT_NE(info.find(pin), nullptr) << pin;
    EXPECT_EQ(info.find("srv-actual-torque"), nullptr);
    EXPECT_EQ(y.sync_managers.at(1).pdos.at(0).mapping(0), 0x60410010U);
    EXPECT_EQ(y.sync_managers.at(1).pdos.at(0).mapping(3), 0x60fd0020U);
}

TEST(Lcec, Errors_name_the_element_and_its_line) {
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\"><sdo/></slave>"),
              "c.xml:2:48: error: unknown element <sdo> in <slave>; did you mean 'sdoConfig'?");
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\" alias=\"4\"/>"),
              "c.xml:2:2: error: unknown attribute 'alias' of <slave>; the attributes are: idx, type, name, vid, pid, configPdos, "
              "syncUnit, syncUnitCycle");
    EXPECT_EQ(
        errors("<slave idx=\"0\" type=\"EL1008\"/>"),
        "c.xml:2:2: error: unsupported slave type 'EL1008'; write type=\"generic\" with the PDOs of the device, or type=\"basic_cia402\"");
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"generic\" vid=\"xy\" pid=\"2\"/>"),
              "c.xml:2:2: error: invalid vid 'xy' of <slave>; write a hexadecimal number of 0..FFFFFFFF");
    EXPECT_EQ(errors("<slave idx=\"0\" type=\"basic_cia402\" vid=\"1\" pid=\"2\"><modParam name=\"enableCPS\" value=\"1\"/><modParam "
                     "name=\"enableCSP\" value=\"maybe\"/></slave>"),
              "c.xml:2:2: error: invalid value 'maybe' of modParam 'enableCSP': expected true or false\n"
              "c.xml:2:53: error: unsupported modParam 'enableCPS'; did you mean 'enableCSP'?");
    EXPECT_EQ(to_string(read("<x/>", "c.xml"), "c.xml"),
              "c.xml:1:2: error: the root element is 'x', not masters; the file begins with <masters>");
}

TEST(Lcec, Idn_configuration_is_written_by_SoE_in_its_state) {
    const auto slave = [](const std::string& idns) { return "<slave idx=\"0\" type=\"generic\" vid=\"1\" pid=\"2\">" + idns + "</slave>"; };
    const Reading r = read(
        "<masters><master idx=\"0\">" +
            slave(
                "<idnConfig drive=\"1\" idn=\"P-0-150\" state=\"SAFEOP\"><idnDataRaw data=\"07 00\"/><idnDataRaw data=\"0A\"/></idnConfig>"
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
              "c.xml:2:48: error: invalid idn 'X-0-1' of <idnConfig>; write idn=\"S-0-15\" or idn=\"P-0-150\"");
    EXPECT_EQ(errors(slave("<idnConfig idn=\"S-0-15\" state=\"OP\"><idnDataRaw data=\"07\"/></idnConfig>")),
              "c.xml:2:48: error: invalid state 'OP' of <idnConfig>; write state=\"PREOP\" or state=\"SAFEOP\", the state in which the IDN "
              "is written");
    EXPECT_EQ(errors(slave("<idnConfig idn=\"S-0-15\"/>")),
              "c.xml:2:48: error: <idnConfig> has no data; write <idnDataRaw data=\"E8 03\"/> in it");
    EXPECT_EQ(errors(slave("<idnConfig idn=\"S-0-15\"><idnDataRaw data=\"7\"/></idnConfig>")),
              "c.xml:2:72: error: invalid data '7'; write hexadecimal bytes in the order of the wire, as in data=\"E8 03\"");
}

TEST(Lcec, Any_bytes_are_read_without_harm) {
    std::mt19937 random(4);
    for (int n = 0; n < 3000; ++n) {
        std::string text = machine;
        for (int i = 0; i < 1 + n % 5; ++i) {
            const std::size_t at = 1 + random() % (text.size() - 1);
            if (n % 2 == 0) text[at] = static_cast<char>('0' + random() % 64);
            else if (random() % 2 == 0) text.erase(at, random() % 12);
            else text.insert(at, text.substr(random() % text.size(), random() % 40));
        }
        read(text, "c.xml");
    }
}

}  // namespace
}  // namespace hal::ethercat::config
