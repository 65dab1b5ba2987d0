// SPDX-License-Identifier: MIT
// The configuration of a network: what it makes, and what is said of a wrong one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/node_reader.hpp"

namespace hal::canopen::config {
namespace {

constexpr const char* eds_text = R"([DeviceInfo]
VendorName=Maker
VendorNumber=0x1234
ProductNumber=0x10
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x0007
AccessType=ro
DefaultValue=0x1234
[OptionalObjects]
SupportedObjects=2
1=0x1800
2=0x1A00
[1800]
ParameterName=TPDO 1
ObjectType=0x9
SubNumber=3
[1800sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=2
[1800sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x180
[1800sub2]
ParameterName=Transmission type
DataType=0x0005
AccessType=rw
DefaultValue=254
[1A00]
ParameterName=TPDO 1 mapping
ObjectType=0x9
SubNumber=2
[1A00sub0]
ParameterName=Number
DataType=0x0005
AccessType=rw
DefaultValue=1
[1A00sub1]
ParameterName=Entry
DataType=0x0007
AccessType=rw
DefaultValue=0x20000010
[ManufacturerObjects]
SupportedObjects=2
1=0x2000
2=0x2001
[2000]
ParameterName=Motor Temperature
DataType=0x0003
AccessType=ro
PDOMapping=1
[2001]
ParameterName=Fan (speed)
DataType=0x0006
AccessType=rww
PDOMapping=1
)";

/// The same device as a DCF: a value that fits, one that does not, and two tables in files.
std::string dcf_text(const std::string& more = "") {
    std::string text = eds_text;
    const std::string list = "SupportedObjects=2\n1=0x2000\n2=0x2001\n";
    text.replace(text.find(list), list.size(), "SupportedObjects=6\n1=0x2000\n2=0x2001\n3=0x2002\n4=0x2003\n5=0x2004\n6=0x2005\n");
    text += "[2002]\nParameterName=Ramp\nDataType=0x0006\nAccessType=rw\nDefaultValue=1\nParameterValue=7\n";
    text += "[2003]\nParameterName=Limit\nDataType=0x0006\nAccessType=rw\nParameterValue=70000\n";
    text += "[2004]\nParameterName=Cam\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nDownloadFile=cam.bin\n";
    text += "[2005]\nParameterName=Gear\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nDownloadFile=empty.bin\n";
    if (!more.empty()) text += "[2006]\nParameterName=More\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nDownloadFile=" + more + "\n";
    return text + "[DeviceComissioning]\nNodeID=5\nBaudrate=1000\n";
}

bool files(const std::string& path, std::string& bytes) {
    if (path == "machine/drive.eds") return bytes = eds_text, true;
    if (path == "machine/mpdo.eds") {
        bytes = eds_text;
        const std::string count = "DefaultValue=1\n[1A00sub1]";
        return bytes.replace(bytes.find(count), count.size(), "DefaultValue=0xFE\n[1A00sub1]"), true;
    }
    if (path == "machine/unit/drive.dcf") return bytes = dcf_text(), true;
    if (path == "machine/unit/lost.dcf") return bytes = dcf_text("lost.bin"), true;
    if (path == "machine/unit/program.dcf") {
        const std::string list = "[ManufacturerObjects]";
        bytes = dcf_text();
        bytes.replace(bytes.find("[OptionalObjects]\nSupportedObjects=2\n1=0x1800\n2=0x1A00\n"), 55,
                      "[OptionalObjects]\nSupportedObjects=3\n1=0x1800\n2=0x1A00\n3=0x1F50\n");
        bytes.insert(bytes.find(list),
                     "[1F50]\nParameterName=Program\nObjectType=0x8\nSubNumber=2\n[1F50sub0]\nParameterName=n\nDataType=0x0005\n"
                     "AccessType=const\nDefaultValue=1\n[1F50sub1]\nParameterName=Program\nObjectType=0x2\nDataType=0x000F\n"
                     "AccessType=wo\nDownloadFile=new.bin\n");
        return true;
    }
    if (path == "machine/unit/cam.bin") return bytes = std::string("\0\1\2", 3), true;
    if (path == "machine/unit/empty.bin") return bytes.clear(), true;
    return bytes = "No such file or directory", false;
}

Reading read_text(const std::string& text) { return read(text, "machine/arm.canopen", files); }
MasterConfig good(const std::string& text) {
    Reading r = read_text(text);
    EXPECT_EQ(to_string(r, "arm"), "");
    return r.config;
}
std::string said(const std::string& text) { return to_string(read_text(text), "arm"); }
const Pdo* find(const Node& n, bool to_node, unsigned number) {
    for (const Pdo& p : n.pdos)
        if (p.to_node == to_node && p.number == number) return &p;
    return nullptr;
}

TEST(CanopenConfig, a_profile_gives_objects_names_types_and_safe_values) {
    const auto c = good(
        "[bus]\nlink = sim:arm\nbitrate = 500k\nsync = 2ms\n[node 5 elbow]\ndevice = cia402\n"
        "rpdo1 = controlword, target-position\ntpdo1 = statusword, position-actual-value\n"
        "target-position.scale = 65536/360\ntarget-position.unit = deg\nstatusword.name = status\n");
    EXPECT_EQ(c.link, "sim:arm");
    EXPECT_EQ(c.bit_rate, 500'000U);
    EXPECT_EQ(c.sync_period, 2 * millisecond);
    ASSERT_EQ(c.nodes.size(), 1U);
    const Node& n = c.nodes[0];
    EXPECT_EQ(n.name, "elbow");
    const Pdo* out = find(n, true, 1);
    ASSERT_NE(out, nullptr);
    EXPECT_EQ(out->cob, 0x205U);
    EXPECT_EQ(out->transmission, 1);
    ASSERT_EQ(out->objects.size(), 2U);
    EXPECT_EQ(out->objects[0].pin, "controlword");
    EXPECT_EQ(out->objects[0].as, PinType::u32);
    EXPECT_EQ(out->objects[0].safe, 2U) << "quick stop";
    EXPECT_EQ(out->objects[1].as, PinType::real);
    EXPECT_DOUBLE_EQ(out->objects[1].scale, 65536.0 / 360);
    EXPECT_EQ(out->objects[1].unit, "deg");
    EXPECT_EQ(out->objects[1].safe, std::nullopt) << "a position is held";
    const Pdo* in = find(n, false, 1);
    ASSERT_NE(in, nullptr);
    EXPECT_EQ(in->cob, 0x185U);
    EXPECT_EQ(in->objects[0].pin, "status");
    EXPECT_EQ(in->objects[0].safe, 0U) << "nobody may believe in it";
    EXPECT_EQ(in->objects[1].as, PinType::s32);
}

TEST(CanopenConfig, a_node_without_PDOs_has_those_its_description_has_switched_on) {
    const auto c = good("[bus]\n[node 5]\neds = drive.eds\n");
    const Node& n = c.nodes[0];
    EXPECT_EQ(n.name, "node-5");
    EXPECT_EQ(n.setup.device_type, 0x20192U);
    EXPECT_EQ(n.setup.vendor, 0x1234U);
    EXPECT_EQ(n.setup.product, 0x10U);
    ASSERT_EQ(n.pdos.size(), 1U);
    EXPECT_EQ(n.pdos[0].cob, 0x185U);
    EXPECT_EQ(n.pdos[0].transmission, 254);
    EXPECT_EQ(n.pdos[0].objects[0].pin, "motor-temperature");
    EXPECT_EQ(n.pdos[0].objects[0].type, Type::integer16);
}

TEST(CanopenConfig, naming_a_PDO_switches_the_others_off) {
    const auto c = good("[bus]\n[node 5]\neds = drive.eds\nvendor = any\nrpdo2 = fan-speed\n");
    const Node& n = c.nodes[0];
    EXPECT_EQ(n.setup.vendor, 0U);
    ASSERT_EQ(n.pdos.size(), 1U);
    EXPECT_EQ(n.pdos[0].cob, 0x305U);
    bool off = false;
    for (const auto& w : n.setup.writes)
        off = off || (w.index == 0x1800 && w.sub == 1 && (load<std::uint32_t>(w.data.data()) & cob_invalid) != 0);
    EXPECT_TRUE(off);
}

TEST(CanopenConfig, a_type_is_what_its_nodes_have_in_common_and_a_node_has_the_last_word) {
    const auto c = good(
        "[bus]\n[defaults]\nheartbeat = 20ms\nmandatory = no\n[type drive]\ndevice = cia402\ntpdo1 = statusword\nmandatory = yes\n"
        "[node 1 a]\ntype = drive\n[node 2 b]\ntype = drive\nheartbeat = 40ms\ntpdo1 = statusword, modes-of-operation-display\n");
    EXPECT_EQ(c.nodes[0].setup.heartbeat_ms, 20);
    EXPECT_TRUE(c.nodes[0].setup.mandatory);
    EXPECT_EQ(c.nodes[1].setup.heartbeat_ms, 40);
    EXPECT_EQ(c.nodes[0].pdos[0].objects.size(), 1U);
    EXPECT_EQ(c.nodes[1].pdos[0].objects.size(), 2U);
}

TEST(CanopenConfig, inputs_and_outputs_are_a_pin_a_bit) {
    const auto c = good(
        "[bus]\n[node 3 io]\ndevice = cia401\ntpdo1 = read-inputs-1, read-inputs-2\nread-inputs-2.bits = home, -, limit-max\nrpdo1 = "
        "write-outputs-1\n"
        "write-outputs-1.name = out-##\n");
    const auto& in = find(c.nodes[0], false, 1)->objects;
    ASSERT_EQ(in[0].bit_pins.size(), 8U);
    EXPECT_EQ(in[0].bit_pins[7].name, "read-inputs-1-7");
    ASSERT_EQ(in[1].bit_pins.size(), 2U);
    EXPECT_EQ(in[1].bit_pins[1].name, "limit-max");
    EXPECT_EQ(in[1].bit_pins[1].bit, 2U);
    EXPECT_EQ(find(c.nodes[0], true, 1)->objects[0].bit_pins[3].name, "out-03");
    EXPECT_EQ(find(c.nodes[0], true, 1)->objects[0].safe, 0U);
}

TEST(CanopenConfig, axes_of_one_node_have_names_of_their_own) {
    const auto c = good(
        "[bus]\n[node 8 base]\ndevice = cia402\naxes = 2\nrpdo1 = axis-1.controlword, axis-1.target-velocity\nrpdo65 = axis-2.controlword, "
        "axis-2.target-velocity\n");
    EXPECT_EQ(find(c.nodes[0], true, 65)->objects[0].index, 0x6840);
    EXPECT_EQ(find(c.nodes[0], true, 65)->objects[0].pin, "axis-2.controlword");
    const auto cob = find(c.nodes[0], true, 65)->cob;
    EXPECT_GT(cob, 0x200U) << "a free one";
    EXPECT_NE(cob, 0x208U);
    EXPECT_EQ(c.nodes[0].pdos.size(), 2U);
}

TEST(CanopenConfig, writes_are_made_of_the_object_s_type) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\nwrite modes-of-operation = 8\nwrite 0x6099:1 = 1000\nwrite 0x2001:3 i16 = "
        "-2\n");
    std::vector<std::pair<std::uint16_t, std::size_t>> seen;
    for (const auto& w : c.nodes[0].setup.writes)
        if (w.index >= 0x2000) seen.emplace_back(w.index, w.data.size());
    EXPECT_EQ(seen, (std::vector<std::pair<std::uint16_t, std::size_t>>{{0x6060, 1}, {0x6099, 4}, {0x2001, 2}}));
}

const ObjectWrite* write_of(const Node& n, std::uint16_t index, std::uint8_t sub = 0) {
    for (const ObjectWrite& w : n.setup.writes)
        if (w.index == index && w.sub == sub) return &w;
    return nullptr;
}

TEST(CanopenConfig, what_a_DCF_says_is_written_with_the_files_it_names) {
    const Reading r = read_text("[bus]\n[node 5]\neds = unit/drive.dcf\n");
    ASSERT_TRUE(r.good()) << to_string(r, "arm");
    const Node& n = r.config.nodes[0];
    ASSERT_NE(write_of(n, 0x2002), nullptr);
    EXPECT_EQ(write_of(n, 0x2002)->data, (std::vector<std::uint8_t>{7, 0}));
    EXPECT_EQ(write_of(n, 0x2003), nullptr);
    ASSERT_NE(write_of(n, 0x2004), nullptr);
    EXPECT_EQ(write_of(n, 0x2004)->data, (std::vector<std::uint8_t>{0, 1, 2}));
    EXPECT_EQ(write_of(n, 0x2004)->name, "Cam");
    EXPECT_EQ(write_of(n, 0x2005), nullptr);
    std::vector<std::string> said;
    for (const Message& m : r.messages) said.push_back(std::to_string(m.at.line) + ": " + m.sentence);
    EXPECT_EQ(r.messages[0].help,
              "hal can eds check machine/unit/drive.dcf says which; what it says of an object that is used here counts");
    EXPECT_EQ(said, (std::vector<std::string>{
                        "3: 'unit/drive.dcf' has 1 warning",
                        "3: line 94 of 'unit/drive.dcf': the value of 2003sub0 is not configured: '70000' does not fit into "
                        "UNSIGNED16 (0..65535)",
                        "3: the file 'empty.bin' for object 0x2005:0 is empty, and is not written"}));
}

TEST(CanopenConfig, a_file_that_a_DCF_names_and_that_is_not_there_is_said) {
    EXPECT_EQ(
        said("[bus]\n[node 5]\neds = unit/lost.dcf\n"),
        "arm:3:7: the file 'lost.bin', which 'unit/lost.dcf' names for object 0x2006:0, cannot be read: No such file or directory; put it "
        "beside that file, or take its line DownloadFile= out");
}

TEST(CanopenConfig, the_program_that_a_DCF_names_is_the_matter_of_firmware) {
    const Reading r = read_text("[bus]\n[node 5]\neds = unit/program.dcf\n");
    EXPECT_TRUE(r.good()) << to_string(r, "arm");
    EXPECT_EQ(write_of(r.config.nodes[0], 0x1f50, 1), nullptr);
    const auto about =
        std::find_if(r.messages.begin(), r.messages.end(), [](const Message& m) { return m.sentence.starts_with("the program"); });
    ASSERT_NE(about, r.messages.end());
    EXPECT_EQ(about->sentence + "; " + about->help,
              "the program 'new.bin' that 'unit/program.dcf' names is not downloaded; write firmware = new.bin, with firmware-id or "
              "firmware-version of what the node shall have");
}

TEST(CanopenConfig, a_command_is_written_at_each_boot_and_not_read_back) {
    const auto c =
        good("[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\nwrite 0x2001 u8 = 1\ncommand 0x2002 u16 = 5\nwrite 0x2003 u8 = 2\n");
    std::vector<std::pair<std::uint16_t, bool>> seen;
    for (const auto& w : c.nodes[0].setup.writes)
        if (w.index >= 0x2000) seen.emplace_back(w.index, w.always);
    EXPECT_EQ(seen, (std::vector<std::pair<std::uint16_t, bool>>{{0x2001, false}, {0x2002, true}, {0x2003, false}}));
    EXPECT_EQ(said("[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\ncommand 0x2002 = 5\n"),
              "arm:5:1: the description has no object 0x2002:0; give its type: command 0x2002 u16 = 5");
}

TEST(CanopenConfig, a_slow_node_has_a_time_out_of_its_own) {
    const auto c = good("[bus]\nsdo-timeout = 100ms\n[node 1]\nsdo-timeout = 3s\nsdo-retries = 0\n[node 2]\n");
    EXPECT_EQ(c.master.sdo.timeout, 100 * millisecond);
    EXPECT_EQ(c.nodes[0].setup.sdo_timeout, 3 * second);
    EXPECT_EQ(c.nodes[0].setup.sdo_resends, 0);
    EXPECT_EQ(c.nodes[1].setup.sdo_timeout, 0);
    EXPECT_LT(c.nodes[1].setup.sdo_resends, 0);
}

TEST(CanopenConfig, a_configuration_has_a_date_or_a_number_made_of_what_is_written) {
    const auto dated = [](const std::string& key, const std::string& more = "") {
        const auto c = good("[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\n" + key + more);
        const NodeSetup& s = c.nodes[0].setup;
        return std::pair(s.configuration_date, s.configuration_time);
    };
    using Date = std::pair<std::uint32_t, std::uint32_t>;
    EXPECT_EQ(dated(""), Date(0, 0));
    EXPECT_EQ(dated("configured = no\n"), Date(0, 0));
    EXPECT_EQ(dated("configured = 1984-01-02\n"), Date(1, 0));
    EXPECT_EQ(dated("configured = 2026-03-01 14:30\n"), Date(15400, (14 * 60 + 30) * 60'000));
    EXPECT_EQ(dated("configured = 2026-03-01 00:00:05\n"), Date(15400, 5000));
    const Date one = dated("configured = by-content\n");
    EXPECT_NE(one.first, 0U);
    EXPECT_LT(one.second, 86'400'000U);
    EXPECT_EQ(one, dated("configured = by-content\n"));
    EXPECT_NE(one, dated("configured = by-content\n", "write 0x2001 u8 = 1\n"));
    EXPECT_NE(dated("configured = by-content\n", "write 0x2001 u8 = 2\n"), dated("configured = by-content\n", "write 0x2001 u8 = 1\n"));
    EXPECT_NE(one, dated("configured = by-content\n", "tpdo1.inhibit = 5ms\n"));
    for (const char* wrong : {"2026-02-30", "2026-03-01 25:00", "2026-03-01 14:30x", "1983-12-31", "yes", "14:30"})
        EXPECT_EQ(
            said(std::string("[bus]\n[node 1]\nconfigured = ") + wrong + "\n"),
            "arm:3:14: 'configured' cannot be '" + std::string(wrong) + "'; write by-content, a date such as 2026-03-01 14:30, or no");
}

TEST(CanopenConfig, a_PDO_may_be_asked_for) {
    const std::string node = "[bus]\nsync = cycle\n[node 5 x]\ndevice = cia402\n";
    const auto c = good(node +
                        "tpdo1 = statusword\ntpdo1.request = 100ms\ntpdo2 = modes-of-operation-display\ntpdo2.request = 1s\n"
                        "tpdo2.transmission = 252\n");
    EXPECT_EQ(find(c.nodes[0], false, 1)->transmission, 253);
    EXPECT_EQ(find(c.nodes[0], false, 1)->request, 100 * millisecond);
    EXPECT_EQ(find(c.nodes[0], false, 2)->transmission, 252);
    const Schedule s = schedule_of(c, millisecond);
    unsigned requests = 0, answers = 0;
    for (const plan::Message& m : s.messages)
        if (m.id == 0x185 && m.period == 100 * millisecond) ++(m.remote ? requests : answers);
    EXPECT_EQ(requests, 1U);
    EXPECT_EQ(answers, 1U);
    EXPECT_EQ(said(node + "tpdo1 = statusword\ntpdo1.transmission = 253\n"),
              "arm:6:22: such a PDO is sent only when it is asked for; write tpdo1.request = 100ms");
    EXPECT_EQ(said(node + "rpdo1 = controlword\nrpdo1.request = 10ms\n"),
              "arm:6:1: only what a node sends can be asked for; an rpdo is sent by the master");
    EXPECT_EQ(said(node + "tpdo1 = statusword\ntpdo1.request = often\n"),
              "arm:6:17: 'tpdo1.request' cannot be 'often'; write a time from 1ms to 3600s");
}

TEST(CanopenConfig, a_multiplexed_PDO_carries_its_objects_one_at_a_time) {
    const auto c = good(
        "[bus]\nsync = cycle\n[node 3 panel]\ndevice = cia401\ntpdo2 = mpdo read-inputs-1, 0x6401:1\nrpdo2 = mpdo write-outputs-1\n"
        "rpdo2.inhibit = 5ms\ntpdo2.inhibit = 2ms\n");
    const Node& n = c.nodes[0];
    const Pdo *in = find(n, false, 2), *out = find(n, true, 2);
    ASSERT_NE(in, nullptr);
    ASSERT_NE(out, nullptr);
    EXPECT_EQ(in->multiplex, Multiplex::source_address);
    EXPECT_EQ(out->multiplex, Multiplex::destination_address);
    EXPECT_EQ(in->transmission, 255);
    EXPECT_EQ(in->bytes(), 8U);
    EXPECT_EQ(in->objects[0].bit_pins.size(), 8U);
    std::string written;
    for (const ObjectWrite& w : n.setup.writes) {
        std::uint64_t value = 0;
        std::memcpy(&value, w.data.data(), w.data.size());
        char text[40];
        std::snprintf(text, sizeof text, "%04X:%u=%llX ", w.index, unsigned{w.sub}, static_cast<unsigned long long>(value));
        written += text;
    }
    EXPECT_EQ(written,
              "1400:1=80000203 1800:1=80000183 1FA0:1=1600001 1FA0:2=1640101 "
              "1401:1=80000303 1601:0=0 1601:0=FF 1401:2=FF 1401:3=0 1401:5=0 1401:1=303 "
              "1801:1=80000283 1A01:0=0 1A01:0=FE 1801:2=FF 1801:3=14 1801:5=0 1801:6=0 1801:1=283 ");
    const std::string node = "[bus]\nsync = cycle\n[node 3 panel]\ndevice = cia401\n";
    EXPECT_EQ(said(node + "rpdo2 = mpdo gap 8, write-outputs-1\n"),
              "arm:5:9: a multiplexed PDO has no gaps; a multiplexed PDO carries one object of 8, 16, 24 or 32 bits at a time");
    EXPECT_EQ(said(node + "rpdo2 = mpdo 0x2000 u64\n"),
              "arm:5:9: object '0x2000' has 64 bits; a multiplexed PDO carries one object of 8, 16, 24 or 32 bits at a time");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputs-1\ntpdo2.transmission = sync\n"),
              "arm:6:22: a multiplexed PDO is sent when an object changes; write transmission = event, or leave it out");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputs-1\ntpdo1 = read-inputs-1\n"),
              "arm:5:9: object 'read-inputs-1' is in two PDOs, and one of them is a multiplexed one; leave it in one of the two");
    std::string many = "mpdo 0x2000:1 u8";
    for (int n = 2; n <= 100; ++n) many += ", 0x2000:" + std::to_string(n) + " u8";
    EXPECT_EQ(good(node + "tpdo2 = " + many + "\n").nodes[0].pdos[0].objects.size(), 100U);
    EXPECT_EQ(
        said("[bus]\n[node 5]\neds = mpdo.eds\ntpdo1 = default\n"),
        "arm:4:9: tpdo1 of the description is a multiplexed PDO, whose objects it does not tell; name them: tpdo1 = mpdo OBJECT, OBJECT");
    const Reading as_it_is = read_text("[bus]\n[node 5]\neds = mpdo.eds\n");
    EXPECT_TRUE(as_it_is.good());
    ASSERT_EQ(as_it_is.messages.size(), 1U);
    EXPECT_EQ(as_it_is.messages[0].sentence,
              "tpdo1 of the description is a multiplexed PDO, whose objects it does not tell: it is left as it is");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputz\n").substr(0, 50), "arm:5:14: the node has no object 'read-inputz'; di");
}

TEST(CanopenConfig, a_safe_value_is_in_the_pin_s_unit) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\nrpdo1 = controlword, target-velocity\ntarget-velocity.scale = 100\ntarget-velocity.safe = "
        "-2.5\ncontrolword.safe = hold\n");
    const auto& o = c.nodes[0].pdos[0].objects;
    EXPECT_EQ(o[0].safe, std::nullopt);
    EXPECT_EQ(static_cast<std::int32_t>(*o[1].safe), -250);
}

TEST(CanopenConfig, values_beyond_an_object_are_cut_off) {
    Object o;
    o.type = Type::integer16, o.bits = 16;
    EXPECT_EQ(static_cast<std::int16_t>(raw_of(o, 1e9)), 32767);
    EXPECT_EQ(static_cast<std::int16_t>(raw_of(o, -1e9)), -32768);
    o.type = Type::unsigned8, o.bits = 8;
    EXPECT_EQ(raw_of(o, -1), 0U);
    EXPECT_EQ(raw_of(o, 256), 255U);
    EXPECT_EQ(raw_of(o, std::numeric_limits<double>::quiet_NaN()), 0U);
}

TEST(CanopenConfig, what_is_wrong_is_said_with_its_place_and_what_to_type) {
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\ntpdo1 = statuswort\n"),
              "arm:4:9: the node has no object 'statuswort'; did you mean 'statusword'?");
    EXPECT_EQ(said("[bus]\n[node 5]\neds = motor.eds\ntpdo1 = speed\nspeed.scale = 5\nwrite gain = 1\nmandatroy = no\n"),
              "arm:3:7: the file 'motor.eds' cannot be read: No such file or directory; a name without / at its beginning is looked for "
              "beside this file\narm:7:1: a node has no 'mandatroy'; did you mean 'mandatory'?");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia410\ntpdo1 = 0x6000\n"),
              "arm:3:10: 'device' cannot be 'cia410'; write cia401, cia402, jr3; or give the device's EDS: eds = FILE");
    EXPECT_EQ(said("[bus]\n[node 128]\n"),
              "arm:2:7: a node section is named by the node's id, 1 to 127, and a name of your own; write [node 5 NAME]");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\ntpdo1 = statusword, position-actual-value, velocity-actual-value\n"),
              "arm:4:9: these objects are 80 bits together; a PDO carries 64; move some to another PDO");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite torque-slope = -1\n"),
              "arm:4:22: '-1' does not fit into UNSIGNED32 (0..4294967295)");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite homing-method = 200\n"),
              "arm:4:23: '200' does not fit into INTEGER8 (-128..127)");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite torque-slope = 0100\n"),
              "arm:4:22: '0100' would be octal; write it without the 0 in front, or 0x…; the object is of type UNSIGNED32");
    EXPECT_TRUE(read("[bus]\n[node 5]\ndevice = cia402\nwrite homing-method = 0xFF\n", "arm", files).good());  // the bits of -1
    EXPECT_EQ(said("link = can:can0\n"),
              "arm:1:1: this line stands before the first section; begin the file with [bus]\n"
              "arm:1:1: there is no section [bus]; write [bus] and below it link = can:can0 and bitrate = 1M");
}

TEST(CanopenConfig, by_index_inputs_go_to_the_node_and_outputs_come_from_it) {
    const Reading r = read(ByIndex{"24831", "24675,25600/16", "", 2, 1}, files);
    ASSERT_TRUE(r.good()) << to_string(r, "");
    const Node& n = r.config.nodes[0];
    EXPECT_EQ(r.config.node_id, 1);
    EXPECT_EQ(n.setup.id, 2);
    ASSERT_NE(find(n, true, 1), nullptr);
    EXPECT_EQ(find(n, true, 1)->objects[0].index, 0x60ff);
    EXPECT_EQ(find(n, true, 1)->objects[0].pin, "24831");
    EXPECT_EQ(find(n, true, 1)->transmission, 255);
    ASSERT_NE(find(n, false, 2), nullptr);
    EXPECT_EQ(find(n, false, 1)->objects[0].index, 0x6063);
    EXPECT_EQ(find(n, false, 2)->objects[0].bits, 16);
    EXPECT_FALSE(read(ByIndex{"speed", "", "", 2, 1}, files).good());
    EXPECT_EQ(to_string(read(ByIndex{"24831", "", "", 1, 1}, files), "arm"),
              "arm:0:0: slavenodeid= and masternodeid= are both 1; every node on a bus has an id of its own");
}

/// Axes with a statusword and a position each way.
std::string axes(unsigned count, const std::string& bus) {
    std::string text = "[bus]\n" + bus +
                       "[type drive]\ndevice = cia402\nheartbeat = 100ms\ntpdo1 = statusword, position-actual-value\nrpdo1 = controlword, "
                       "target-position\n";
    for (unsigned n = 1; n <= count; ++n) text += "[node " + std::to_string(n) + " axis-" + std::to_string(n) + "]\ntype = drive\n";
    return text;
}

TEST(CanopenSchedule, says_how_many_axes_fit_into_a_millisecond) {
    // A frame of 6 bytes has at most 117 bits with its intermission, two for each axis, and the SYNC 55.
    const auto share = [](unsigned n) { return schedule_of(good(axes(n, "sync = 1ms\n")), millisecond).sync_share; };
    EXPECT_NEAR(share(4), 0.055e-3 / 1e-3 + 4 * 2 * 0.000115 / 1e-3, 1e-9);
    EXPECT_TRUE(load_messages(good(axes(3, "sync = 1ms\n")), millisecond, "arm").empty());
    EXPECT_FALSE(load_messages(good(axes(8, "sync = 1ms\n")), millisecond, "arm").empty());
    EXPECT_TRUE(load_messages(good(axes(8, "sync = 2500us\n")), millisecond, "arm").empty());
    const auto slow = load_messages(good(axes(3, "bitrate = 250k\nsync = 1ms\n")), millisecond, "arm");
    ASSERT_EQ(slow.size(), 1U);
    EXPECT_EQ(slow[0].help, "bitrate = 1M would do; hal canopen plan arm shows the arithmetic and what to change");
}

}  // namespace
}  // namespace hal::canopen::config
