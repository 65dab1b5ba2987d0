// SPDX-License-Identifier: MIT
// Configurations of a network: nodes, types, device descriptions, writes.
#include "config_files.hpp"

namespace hal::canopen::config {
namespace {

TEST(CanopenConfig, a_profile_gives_objects_names_types_and_safe_values) {
    const auto c = good(
        "[bus]\nlink = sim:arm\nbitrate = 500k\nsync = 2ms\n[node 5 elbow]\ndevice = cia402\n"
        "rpdo1 = controlword, target-position\ntpdo1 = statusword, position-actual-value\n"
        "target-position.scale = 65536/360\ntarget-position.unit = deg\nstatusword.name = "
        "status\n");
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
    EXPECT_EQ(in->objects[0].safe, 0U) << "a status input reads 0 while the node is lost";
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
    for (const auto& w : n.setup.writes) {
        off = off || (w.index == 0x1800 && w.sub == 1 &&
                      (load<std::uint32_t>(w.data.data()) & cob_invalid) != 0);
    }
    EXPECT_TRUE(off);
}

TEST(CanopenConfig, a_node_overrides_the_keys_of_its_type) {
    const auto c = good(
        "[bus]\n[defaults]\nheartbeat = 20ms\nmandatory = no\n[type drive]\ndevice = cia402\ntpdo1 "
        "= statusword\nmandatory = yes\n"
        "[node 1 a]\ntype = drive\n[node 2 b]\ntype = drive\nheartbeat = 40ms\ntpdo1 = statusword, "
        "modes-of-operation-display\n");
    EXPECT_EQ(c.nodes[0].setup.heartbeat_ms, 20);
    EXPECT_TRUE(c.nodes[0].setup.mandatory);
    EXPECT_EQ(c.nodes[1].setup.heartbeat_ms, 40);
    EXPECT_EQ(c.nodes[0].pdos[0].objects.size(), 1U);
    EXPECT_EQ(c.nodes[1].pdos[0].objects.size(), 2U);
}

TEST(CanopenConfig, inputs_and_outputs_are_a_pin_a_bit) {
    const auto c = good(
        "[bus]\n[node 3 io]\ndevice = cia401\ntpdo1 = read-inputs-1, "
        "read-inputs-2\nread-inputs-2.bits = home, -, limit-max\nrpdo1 = "
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
        "[bus]\n[node 8 base]\ndevice = cia402\naxes = 2\nrpdo1 = axis-1.controlword, "
        "axis-1.target-velocity\nrpdo65 = axis-2.controlword, "
        "axis-2.target-velocity\n");
    EXPECT_EQ(find(c.nodes[0], true, 65)->objects[0].index, 0x6840);
    EXPECT_EQ(find(c.nodes[0], true, 65)->objects[0].pin, "axis-2.controlword");
    const auto cob = find(c.nodes[0], true, 65)->cob;
    EXPECT_GT(cob, 0x200U) << "a free one";
    EXPECT_NE(cob, 0x208U);
    EXPECT_EQ(c.nodes[0].pdos.size(), 2U);
}

TEST(CanopenConfig, writes_are_encoded_by_the_type_of_the_object) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\nwrite modes-of-operation = 8\nwrite "
        "0x6099:1 = 1000\nwrite 0x2001:3 s16 = "
        "-2\n");
    std::vector<std::pair<std::uint16_t, std::size_t>> seen;
    for (const auto& w : c.nodes[0].setup.writes) {
        if (w.index >= 0x2000) {
            seen.emplace_back(w.index, w.data.size());
        }
    }
    EXPECT_EQ(seen, (std::vector<std::pair<std::uint16_t, std::size_t>>{
                        {0x6060, 1}, {0x6099, 4}, {0x2001, 2}}));
}

const ObjectWrite* write_of(const Node& n, std::uint16_t index, std::uint8_t sub = 0) {
    for (const ObjectWrite& w : n.setup.writes) {
        if (w.index == index && w.sub == sub) return &w;
    }
    return nullptr;
}

TEST(CanopenConfig, writes_the_values_of_a_DCF_and_the_files_it_names) {
    const ReadResult r = read_text("[bus]\n[node 5]\neds = unit/drive.dcf\n");
    ASSERT_TRUE(r.good()) << to_string(r, "arm");
    const Node& n = r.config.nodes[0];
    ASSERT_NE(write_of(n, 0x2002), nullptr);
    EXPECT_EQ(write_of(n, 0x2002)->data, (std::vector<std::uint8_t>{7, 0}));
    ASSERT_NE(write_of(n, 0x2003), nullptr);
    EXPECT_EQ(write_of(n, 0x2003)->data, (std::vector<std::uint8_t>{0x58, 0x1b}));
    ASSERT_NE(write_of(n, 0x2004), nullptr);
    EXPECT_EQ(write_of(n, 0x2004)->data, (std::vector<std::uint8_t>{0, 1, 2}));
    EXPECT_EQ(write_of(n, 0x2004)->name, "Cam");
    EXPECT_EQ(write_of(n, 0x2005), nullptr);
    std::vector<std::string> said;
    for (const Message& m : r.messages) {
        said.push_back(std::to_string(m.at.line) + ": " + m.sentence);
    }
    EXPECT_EQ(said,
              (std::vector<std::string>{
                  "3: the file 'empty.bin' for object 0x2005:0 is empty and is not written"}));
}

TEST(CanopenConfig, reports_a_missing_file_that_a_DCF_names) {
    EXPECT_EQ(said("[bus]\n[node 5]\neds = unit/lost.dcf\n"),
              "arm:3:7: error: cannot read 'lost.bin', which 'unit/lost.dcf' names for object "
              "0x2006:0: No such file or directory; "
              "put it beside that file, or delete its line DownloadFile=");
}

TEST(CanopenConfig, does_not_download_the_program_that_a_DCF_names) {
    const ReadResult r = read_text("[bus]\n[node 5]\neds = unit/program.dcf\n");
    EXPECT_TRUE(r.good()) << to_string(r, "arm");
    EXPECT_EQ(write_of(r.config.nodes[0], 0x1f50, 1), nullptr);
    const auto about = std::find_if(r.messages.begin(), r.messages.end(), [](const Message& m) {
        return m.sentence.starts_with("program");
    });
    ASSERT_NE(about, r.messages.end());
    EXPECT_EQ(about->sentence + "; " + about->help,
              "program 'new.bin' of 'unit/program.dcf' is not downloaded; write firmware = new.bin "
              "and its firmware-id or firmware-version");
}

TEST(CanopenConfig, a_command_is_written_at_each_boot_and_not_read_back) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\nwrite 0x2001 u8 = 1\ncommand 0x2002 "
        "u16 = 5\nwrite 0x2003 u8 = 2\n");
    std::vector<std::pair<std::uint16_t, bool>> seen;
    for (const auto& w : c.nodes[0].setup.writes) {
        if (w.index >= 0x2000) {
            seen.emplace_back(w.index, w.always);
        }
    }
    EXPECT_EQ(seen, (std::vector<std::pair<std::uint16_t, bool>>{
                        {0x2001, false}, {0x2002, true}, {0x2003, false}}));
    EXPECT_EQ(said("[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword\ncommand 0x2002 = 5\n"),
              "arm:5:1: error: the device description has no object 0x2002:0; state its type: "
              "command 0x2002 u16 = 5");
}

TEST(CanopenConfig, a_node_can_have_its_own_SDO_timeout) {
    const auto c =
        good("[bus]\nsdo-timeout = 100ms\n[node 1]\nsdo-timeout = 3s\nsdo-retries = 0\n[node 2]\n");
    EXPECT_EQ(c.master.sdo.timeout, 100 * millisecond);
    EXPECT_EQ(c.nodes[0].setup.sdo_timeout, 3 * second);
    EXPECT_EQ(c.nodes[0].setup.sdo_resends, 0);
    EXPECT_EQ(c.nodes[1].setup.sdo_timeout, 0);
    EXPECT_LT(c.nodes[1].setup.sdo_resends, 0);
}

TEST(CanopenConfig, a_configuration_has_a_date_or_a_number_derived_from_its_writes) {
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
    EXPECT_NE(dated("configured = by-content\n", "write 0x2001 u8 = 2\n"),
              dated("configured = by-content\n", "write 0x2001 u8 = 1\n"));
    EXPECT_NE(one, dated("configured = by-content\n", "tpdo1.inhibit = 5ms\n"));
    for (const char* wrong :
         {"2026-02-30", "2026-03-01 25:00", "2026-03-01 14:30x", "1983-12-31", "yes", "14:30"}) {
        EXPECT_EQ(said(std::string("[bus]\n[node 1]\nconfigured = ") + wrong + "\n"),
                  "arm:3:14: error: invalid configured '" + std::string(wrong) +
                      "'; write by-content, a date such as 2026-03-01 14:30, or no");
    }
}

TEST(CanopenConfig, by_index_inputs_go_to_the_node_and_outputs_come_from_it) {
    const ReadResult r = read(ByIndex{"24831", "24675,25600/16", "", 2, 1}, files);
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
              "arm: error: slavenodeid= and masternodeid= are both 1; use different node IDs");
}

/// Axes with a statusword and a position each way.
std::string axes(unsigned count, const std::string& bus) {
    std::string text = "[bus]\n" + bus +
                       "[type drive]\ndevice = cia402\nheartbeat = 100ms\ntpdo1 = statusword, "
                       "position-actual-value\nrpdo1 = controlword, "
                       "target-position\n";
    for (unsigned n = 1; n <= count; ++n) {
        text += "[node " + std::to_string(n) + " axis-" + std::to_string(n) + "]\ntype = drive\n";
    }
    return text;
}

TEST(CanopenSchedule, reports_how_many_axes_fit_into_a_millisecond) {
    // A frame of 6 bytes has at most 117 bits with its intermission, two for each axis, and the
    // SYNC 55.
    const auto share = [](unsigned n) {
        return schedule_of(good(axes(n, "sync = 1ms\n")), millisecond).sync_share;
    };
    EXPECT_NEAR(share(4), 0.055e-3 / 1e-3 + 4 * 2 * 0.000115 / 1e-3, 1e-9);
    EXPECT_TRUE(load_messages(good(axes(3, "sync = 1ms\n")), millisecond, "arm").empty());
    EXPECT_FALSE(load_messages(good(axes(8, "sync = 1ms\n")), millisecond, "arm").empty());
    EXPECT_TRUE(load_messages(good(axes(8, "sync = 2500us\n")), millisecond, "arm").empty());
    const auto slow =
        load_messages(good(axes(3, "bitrate = 250k\nsync = 1ms\n")), millisecond, "arm");
    ASSERT_EQ(slow.size(), 1U);
    EXPECT_EQ(slow[0].help,
              "bitrate = 1M is sufficient; hal canopen plan arm shows the calculation and what to "
              "change");
}

}  // namespace
}  // namespace hal::canopen::config
