// SPDX-License-Identifier: MIT
// Configurations of a network: PDOs and their objects, and errors.
#include "config_files.hpp"

namespace hal::canopen::config {
namespace {

TEST(CanopenConfig, a_TPDO_can_be_requested) {
    const std::string node = "[bus]\nsync = cycle\n[node 5 x]\ndevice = cia402\n";
    const auto c = good(node +
                        "tpdo1 = statusword\ntpdo1.request = 100ms\ntpdo2 = "
                        "modes-of-operation-display\ntpdo2.request = 1s\n"
                        "tpdo2.transmission = 252\n");
    EXPECT_EQ(find(c.nodes[0], false, 1)->transmission, 253);
    EXPECT_EQ(find(c.nodes[0], false, 1)->request, 100 * millisecond);
    EXPECT_EQ(find(c.nodes[0], false, 2)->transmission, 252);
    const Schedule s = schedule_of(c, millisecond);
    unsigned requests = 0;
    unsigned answers = 0;
    for (const can_timing::Message& m : s.messages) {
        if (m.id == 0x185 && m.period == 100 * millisecond) {
            ++(m.remote ? requests : answers);
        }
    }
    EXPECT_EQ(requests, 1U);
    EXPECT_EQ(answers, 1U);
    EXPECT_EQ(
        said(node + "tpdo1 = statusword\ntpdo1.transmission = 253\n"),
        "arm:6:22: error: this PDO is sent only on request (RTR); write tpdo1.request = 100ms");
    EXPECT_EQ(said(node + "rpdo1 = controlword\nrpdo1.request = 10ms\n"),
              "arm:6:1: error: only a tpdo can be requested; the master sends an rpdo by itself");
    EXPECT_EQ(said(node + "tpdo1 = statusword\ntpdo1.request = often\n"),
              "arm:6:17: error: invalid tpdo1.request 'often'; write a time of 1ms..3600s, as in "
              "10ms or 0.5s");
}

TEST(CanopenConfig, a_PDO_is_not_assigned_the_identifier_of_the_SYNC) {
    const std::string node = "[node 5 x]\ndevice = cia402\ntpdo5 = statusword\n";
    const auto usual = good("[bus]\nsync = cycle\n" + node);
    EXPECT_EQ(find(usual.nodes[0], false, 5)->cob, 0x181U);
    const auto moved = good("[bus]\nsync = cycle\nsync-cob-id = 0x181\n" + node);
    EXPECT_EQ(find(moved.nodes[0], false, 5)->cob, 0x182U);
}

TEST(CanopenConfig, a_multiplexed_PDO_carries_its_objects_one_at_a_time) {
    const auto c = good(
        "[bus]\nsync = cycle\n[node 3 panel]\ndevice = cia401\ntpdo2 = mpdo read-inputs-1, "
        "0x6401:1\nrpdo2 = mpdo write-outputs-1\n"
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
        std::snprintf(text, sizeof text, "%04X:%u=%llX ", w.index, unsigned{w.sub},
                      static_cast<unsigned long long>(value));
        written += text;
    }
    EXPECT_EQ(
        written,
        "1400:1=80000203 1800:1=80000183 1FA0:1=1600001 1FA0:2=1640101 "
        "1401:1=80000303 1601:0=0 1601:0=FF 1401:2=FF 1401:3=0 1401:5=0 1401:1=303 "
        "1801:1=80000283 1A01:0=0 1A01:0=FE 1801:2=FF 1801:3=14 1801:5=0 1801:6=0 1801:1=283 ");
    const std::string node = "[bus]\nsync = cycle\n[node 3 panel]\ndevice = cia401\n";
    EXPECT_EQ(said(node + "rpdo2 = mpdo gap 8, write-outputs-1\n"),
              "arm:5:9: error: a multiplexed PDO has no gaps; a multiplexed PDO carries one object "
              "of 8, 16, 24 or 32 bits at a time");
    EXPECT_EQ(said(node + "rpdo2 = mpdo 0x2000 u64\n"),
              "arm:5:9: error: object '0x2000' has 64 bits; a multiplexed PDO carries one object "
              "of 8, 16, 24 or 32 bits at a time");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputs-1\ntpdo2.transmission = sync\n"),
              "arm:6:22: error: a multiplexed PDO is sent when an object changes; write "
              "transmission = event, or delete the line");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputs-1\ntpdo1 = read-inputs-1\n"),
              "arm:5:9: error: object 'read-inputs-1' is in two PDOs, one of them multiplexed; "
              "remove it from one of them");
    std::string many = "mpdo 0x2000:1 u8";
    for (int sub = 2; sub <= 100; ++sub) {
        many += ", 0x2000:" + std::to_string(sub) + " u8";
    }
    EXPECT_EQ(good(node + "tpdo2 = " + many + "\n").nodes[0].pdos[0].objects.size(), 100U);
    EXPECT_EQ(said("[bus]\n[node 5]\neds = mpdo.eds\ntpdo1 = default\n"),
              "arm:4:9: error: tpdo1 is a multiplexed PDO: the device description does not list "
              "its objects; "
              "name them: tpdo1 = mpdo OBJECT, OBJECT");
    const ReadResult as_it_is = read_text("[bus]\n[node 5]\neds = mpdo.eds\n");
    EXPECT_TRUE(as_it_is.good());
    ASSERT_EQ(as_it_is.messages.size(), 1U);
    EXPECT_EQ(as_it_is.messages[0].sentence,
              "tpdo1 is a multiplexed PDO: the device description does not list its objects; left "
              "unchanged");
    EXPECT_EQ(said(node + "tpdo2 = mpdo read-inputz\n").substr(0, 49),
              "arm:5:14: error: unknown object 'read-inputz'; di");
}

TEST(CanopenConfig, a_safe_value_is_in_the_pin_s_unit) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\nrpdo1 = controlword, "
        "target-velocity\ntarget-velocity.scale = 100\ntarget-velocity.safe = "
        "-2.5\ncontrolword.safe = hold\n");
    const auto& o = c.nodes[0].pdos[0].objects;
    EXPECT_EQ(o[0].safe, std::nullopt);
    EXPECT_EQ(static_cast<std::int32_t>(*o[1].safe), -250);
}

TEST(CanopenConfig, a_unit_leaves_a_type_that_is_given_under_another_spelling) {
    const auto c = good(
        "[bus]\n[node 1]\ndevice = cia402\ntpdo1 = statusword, 6064\n"
        "6041.unit = bits\nstatusword.type = u32\n0x6064.type = s32\n6064:0.unit = counts\n");
    const auto& o = c.nodes[0].pdos[0].objects;
    EXPECT_EQ(o[0].unit, "bits");
    EXPECT_EQ(o[0].as, PinType::u32);
    EXPECT_EQ(o[1].unit, "counts");
    EXPECT_EQ(o[1].as, PinType::s32);
}

TEST(CanopenConfig, an_object_without_a_name_has_a_pin_with_a_decimal_sub_index) {
    const auto c = good("[bus]\n[node 1]\ntpdo1 = 0x2000:0x0A u8, 2000:31 u8, 0x2001 u8\n");
    const auto& o = c.nodes[0].pdos[0].objects;
    EXPECT_EQ(o[0].pin, "0x2000-10");
    EXPECT_EQ(o[1].pin, "0x2000-31");
    EXPECT_EQ(o[2].pin, "0x2001");
}

TEST(CanopenConfig, silence_is_not_shorter_than_guarding_takes) {
    const std::string node =
        "[bus]\n[node 5]\ndevice = cia402\ntpdo1 = statusword\nheartbeat = 100ms\n"
        "guarding = 100ms x 3\n";
    EXPECT_EQ(said(node + "silence = 250ms\n"),
              "arm:7:11: error: silence is shorter than guard time x life time factor; with "
              "guarding the node is lost after 300ms; write at least that, or delete silence");
    EXPECT_EQ(said(node + "silence = 300ms\n"), "");
}

TEST(CanopenConfig, limits_values_to_the_range_of_the_object) {
    Object o;
    o.type = Type::integer16;
    o.bits = 16;
    EXPECT_EQ(static_cast<std::int16_t>(raw_of(o, 1e9)), 32767);
    EXPECT_EQ(static_cast<std::int16_t>(raw_of(o, -1e9)), -32768);
    o.type = Type::unsigned8;
    o.bits = 8;
    EXPECT_EQ(raw_of(o, -1), 0U);
    EXPECT_EQ(raw_of(o, 256), 255U);
    EXPECT_EQ(raw_of(o, std::numeric_limits<double>::quiet_NaN()), 0U);
}

TEST(CanopenConfig, reports_errors_with_their_position_and_a_fix) {
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\ntpdo1 = statuswort\n"),
              "arm:4:9: error: unknown object 'statuswort'; did you mean 'statusword'?");
    EXPECT_EQ(said("[bus]\n[node 5]\neds = motor.eds\ntpdo1 = speed\nspeed.scale = 5\nwrite gain = "
                   "1\nmandatroy = no\n"),
              "arm:3:7: error: cannot read 'motor.eds': No such file or directory; a relative path "
              "starts at the folder of this file\n"
              "arm:7:1: error: unknown key 'mandatroy' of a node; did you mean 'mandatory'?");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia410\ntpdo1 = 0x6000\n"),
              "arm:3:10: error: invalid device 'cia410'; write cia401, cia402, jr3; or name the "
              "EDS of the device: eds = FILE");
    EXPECT_EQ(said("[bus]\n[node 128]\n"),
              "arm:2:7: error: invalid node section: expected a node ID of 1..127 and a name; "
              "write [node 5 NAME]");
    EXPECT_EQ(
        said("[bus]\n[node 5]\ndevice = cia402\ntpdo1 = statusword, position-actual-value, "
             "velocity-actual-value\n"),
        "arm:4:9: error: these objects have 80 bits; a PDO carries 64; move some to another PDO");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite torque-slope = -1\n"),
              "arm:4:22: error: '-1' does not fit into UNSIGNED32 (0..4294967295)");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite homing-method = 200\n"),
              "arm:4:23: error: '200' does not fit into INTEGER8 (-128..127)");
    EXPECT_EQ(said("[bus]\n[node 5]\ndevice = cia402\nwrite torque-slope = 0100\n"),
              "arm:4:22: error: '0100' would be octal; write it without the 0 in front, or 0x…; "
              "the object is of type UNSIGNED32");
    // the bits of -1
    EXPECT_TRUE(read("[bus]\n[node 5]\ndevice = cia402\nwrite homing-method = 0xFF\n", "arm", files)
                    .good());
    EXPECT_EQ(said("link = can:can0\n"),
              "arm:1:1: error: this line is before the first section; begin the file with [bus]\n"
              "arm:1:1: error: missing section [bus]; write [bus] and below it link = can:can0 and "
              "bitrate = 1M");
}

}  // namespace
}  // namespace hal::canopen::config
