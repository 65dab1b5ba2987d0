// SPDX-License-Identifier: MIT
// The gateway of CiA 309-3: lines in, lines out, and a device on the bus between them.
#include <gtest/gtest.h>

#include "bus.hpp"
#include "canopen/master/gateway/gateway.hpp"

namespace hal::canopen::test {
namespace {

using gateway::Gateway;

struct Gate : testing::Test {
    Recorder events;
    Bus bus;
    std::unique_ptr<Device> device;
    Gateway gate{1};
    Time now = 0;
    int client = gate.connect();

    void make(std::uint8_t id) {
        device = std::make_unique<Device>(
            example(), DeviceSettings{.node_id = id, .pdo = {.send_at_start = false}}, events);
        bus.attach(*device);
        bus.attach(gate.out(1), [this](const Frame& f, Time t) { gate.handle(1, f, t); });
        device->start(now);
        run(1);
        taken();
    }
    void SetUp() override { make(5); }
    void run(Time ms) {
        for (Time n = 0; n <= ms; ++n) {
            gate.poll(now);
            device->poll(now);
            bus.exchange(now);
            gate.poll(now);
            if (n != ms) {
                now += millisecond;
            }
        }
    }
    std::string taken() {
        std::string text;
        std::swap(text, gate.output(client));
        return text;
    }
    /// What comes of a line, without its line end; several lines are joined by "|".
    std::string ask(const std::string& line, Time max_ms = 3000) {
        taken();
        gate.receive(client, line + "\r\n", now);
        for (Time n = 0; n == 0 || (n < max_ms && !gate.idle()); ++n) {
            run(1);
        }
        std::string text = taken();
        for (std::size_t at; (at = text.find("\r\n")) != text.npos;) {
            text.replace(at, 2, "|");
        }
        if (text.ends_with('|')) {
            text.pop_back();
        }
        return text;
    }
};

TEST_F(Gate, Reads_and_writes_in_all_types) {
    EXPECT_EQ(ask("[1] 1 5 read 0x2000 0 u32"), "[1] 305419896");
    EXPECT_EQ(ask("[2] 5 r 0x2000 0"), "[2] 78 56 34 12");
    EXPECT_EQ(ask("[3] 5 r 0x2000 0 x32"), "[3] 0x12345678");
    EXPECT_EQ(ask("[4] 5 w 0x2001 0 i16 -7"), "[4] OK");
    EXPECT_EQ(ask("[5] 5 r 0x2001 0 i16"), "[5] -7");
    EXPECT_EQ(ask("[6] 5 w 0x2009 0 r32 -2.5"), "[6] OK");
    EXPECT_EQ(ask("[7] 5 r 0x2009 0 r32"), "[7] -2.5");
    EXPECT_EQ(ask("[8] 5 w 0x2005 0 vs \"yes \"\"hi\"\"\""), "[8] OK");
    EXPECT_EQ(ask("[9] 5 r 0x2005 0 vs"), "[9] \"yes \"\"hi\"\"\"");
    EXPECT_EQ(ask("[10] 5 w 0x2006 0 d aGFsY3lvbg=="), "[10] OK");
    EXPECT_EQ(ask("[11] 5 r 0x2006 0 d"), "[11] aGFsY3lvbg==");
    EXPECT_EQ(ask("[12] 5 w 0x2004 0 u64 0xFFFFFFFFFFFFFFFF"), "[12] OK");
    EXPECT_EQ(ask("[13] 5 r 0x2004 0 u64"), "[13] 18446744073709551615");
    EXPECT_EQ(ask("[14] 5 w 0x2007 0 b 1"), "[14] OK");
    EXPECT_EQ(ask("[15] 5 w 0x2005 0 hex 41 42 43"), "[15] OK");
    EXPECT_EQ(ask("[16] 5 R 0x2005 0 VS"), "[16] \"ABC\"");
}
TEST_F(Gate, Long_values_go_both_ways_by_segments_and_by_blocks) {
    std::vector<std::uint8_t> data(20'000);
    for (std::size_t n = 0; n < data.size(); ++n) {
        data[n] = static_cast<std::uint8_t>(n * 7);
    }
    for (const char* block : {"0", "1"}) {
        EXPECT_EQ(ask(std::string("[1] set sdo_block ") + block), "[1] OK");
        EXPECT_EQ(ask("[2] 5 w 0x2006 0 d " + gateway::base64(data), 60'000), "[2] OK");
        EXPECT_EQ(ask("[3] 5 r 0x2006 0 d", 60'000), "[3] " + gateway::base64(data));
        data[0] ^= 1;
    }
}
TEST_F(Gate, Own_node_answers_without_the_bus) {
    // no own node yet
    EXPECT_EQ(ask("[1] 126 r 0x1000 0 u32", 10'000),
              "[1] ERROR:0x05040000 #SDO protocol timed out");
    EXPECT_EQ(ask("[2] set id 126"), "[2] OK");
    EXPECT_EQ(ask("[3] 126 r 0x1000 0 u32", 0), "[3] 0");
    EXPECT_EQ(ask("[4] 126 r 0x1001 0 u8", 0), "[4] 0");
    EXPECT_EQ(ask("[5] 126 r 0x1008 0 vs", 0), "[5] \"Halcyon CiA 309-3 gateway\"");
    EXPECT_EQ(ask("[5] 126 r 0x2000 1 vs", 0), "[5] \"Halcyon\"");
    EXPECT_EQ(ask("[5] 126 r 0x2000 3 vs", 0), "[5] \"\"");
    EXPECT_EQ(ask("[6] 126 r 0x1018 0 u8", 0), "[6] 4");
    EXPECT_EQ(ask("[7] 126 w 0x1018 1 u32 1", 0),
              "[7] ERROR:0x06010002 #attempt to write a read-only object");
    EXPECT_EQ(ask("[8] 126 r 0x1018 9 u32", 0), "[8] ERROR:0x06090011 #sub-index does not exist");
    EXPECT_EQ(ask("[9] set heartbeat 250"), "[9] OK");
    EXPECT_EQ(ask("[10] 126 r 0x1017 0 u16", 0), "[10] 250");
    EXPECT_EQ(ask("[11] 126 w 0x1017 0 u16 0", 0), "[11] OK");
    EXPECT_EQ(ask("[12] 126 stop", 0),
              "[12] ERROR:102 #request not processed due to internal state: node 126 is the "
              "gateway itself, always operational");
    EXPECT_EQ(ask("[13] 5 r 0x1000 0 hex").substr(0, 5), "[13] ");
}
TEST_F(Gate, Aborts_and_errors_have_their_numbers) {
    EXPECT_EQ(ask("[1] 5 r 0x2fff 0 u8"),
              "[1] ERROR:0x06020000 #object does not exist in the object dictionary");
    EXPECT_EQ(ask("[2] 5 w 0x2002 0 u8 1"),
              "[2] ERROR:0x06010002 #attempt to write a read-only object");
    EXPECT_EQ(ask("[3] 9 r 0x1000 0", 10'000), "[3] ERROR:0x05040000 #SDO protocol timed out");
    EXPECT_EQ(ask("[4] r 0x1000 0"), "[4] ERROR:105 #no default node set");
    EXPECT_EQ(ask("[5] 2 5 r 0x1000 0"), "[5] ERROR:106 #unsupported net");
    EXPECT_EQ(ask("[6] 200 r 0x1000 0"), "[6] ERROR:107 #unsupported node");
    EXPECT_EQ(ask("[7] 5 r 0x1000"), "[7] ERROR:101 #syntax error: the sub-index is missing");
    EXPECT_EQ(ask("[8] 5 w 0x2000 0 u8 256"),
              "[8] ERROR:101 #syntax error: invalid value for type u8");
    EXPECT_EQ(ask("[9] fly"),
              "[9] ERROR:100 #request not supported: unknown command 'fly'; see: help");
    EXPECT_EQ(ask("[10] set speed 5"),
              "[10] ERROR:100 #request not supported: what to set is not 'speed'; see: help");
    EXPECT_EQ(ask("[x] start"), "[0] ERROR:101 #syntax error: a line begins with [NUMBER]");
    EXPECT_EQ(ask("[11] set network 7"), "[11] ERROR:106 #unsupported net");
    EXPECT_EQ(ask("[12] 5 w 0x2005 0 vs \"open"),
              "[12] ERROR:101 #syntax error: a quotation mark is not closed");
    EXPECT_EQ(ask("[13] set command_timeout 20"), "[13] OK");
    EXPECT_EQ(ask("[14] 9 r 0x1000 0"), "[14] ERROR:103 #timeout");
    EXPECT_EQ(ask(""), "");
    EXPECT_EQ(ask("# only a comment"), "");
}
TEST_F(Gate, Defaults_of_net_and_node_are_each_clients_own) {
    const int other = gate.connect();
    EXPECT_EQ(ask("[1] set node 5"), "[1] OK");
    EXPECT_EQ(ask("[2] r 0x2002 0 u8"), "[2] 7");
    gate.receive(other, "[1] r 0x2002 0 u8\n", now);
    EXPECT_EQ(gate.output(other), "[1] ERROR:105 #no default node set\r\n");
}
TEST_F(Gate, Two_nodes_are_asked_at_once_and_answers_carry_their_numbers) {
    taken();
    gate.receive(client, "[7] 9 r 0x1000 0\n[8] 5 r 0x2002 0 u8\n", now);
    run(5);
    EXPECT_EQ(taken(), "[8] 7\r\n");
    run(3000);
    EXPECT_EQ(taken(), "[7] ERROR:0x05040000 #SDO protocol timed out\r\n");
}
TEST_F(Gate, Network_management_reaches_the_node) {
    EXPECT_EQ(ask("[1] 5 start"), "[1] OK");
    EXPECT_EQ(device->state(), NmtState::operational);
    ask("[2] 5 preop");
    EXPECT_EQ(device->state(), NmtState::pre_operational);
    ask("[3] 0 stop");
    EXPECT_EQ(device->state(), NmtState::stopped);
    EXPECT_EQ(ask("[4] 5 reset communication"), "[4] OK|1 5 BOOT_UP");
    EXPECT_EQ(ask("[5] boot_up_indication disable"), "[5] OK");
    EXPECT_EQ(ask("[6] 5 reset node"), "[6] OK");
    EXPECT_EQ(events.resets, (std::vector<bool>{false, true}));
}
TEST_F(Gate, Loss_of_heartbeat_and_of_guarding_is_told_and_emergencies_are) {
    EXPECT_EQ(ask("[1] 5 enable heartbeat 120"), "[1] OK");
    EXPECT_EQ(ask("[2] 5 w 0x1017 0 u16 50"), "[2] OK|1 5 PRE_OPERATIONAL");
    run(100);
    EXPECT_EQ(taken(), "");
    device->command(NmtCommand::start, now);
    run(100);
    EXPECT_EQ(taken(), "1 5 OPERATIONAL\r\n");
    ask("[3] 5 w 0x1017 0 u16 0");
    run(300);
    EXPECT_EQ(taken(), "1 5 ERROR 203 #heartbeat lost\r\n");
    EXPECT_EQ(ask("[4] 5 enable guarding 50 3"), "[4] OK|1 5 OPERATIONAL");
    device->command(NmtCommand::stop, now);
    run(100);
    EXPECT_EQ(taken(), "1 5 STOPPED\r\n");
    ask("[5] 5 disable guarding");
    device->command(NmtCommand::enter_pre_operational, now);
    device->emcy().raise(0x2310, error_current, {1, 2, 3, 4, 5});
    run(10);
    EXPECT_EQ(taken(), "1 5 EMCY 0x2310 0x03 1 2 3 4 5 #current, device output side\r\n");
}
TEST_F(Gate, Pdos_are_sent_received_and_asked_for) {
    device->command(NmtCommand::start, now);
    EXPECT_EQ(ask("[1] r p 1"),
              "[1] ERROR:102 #request not processed due to internal state: nothing has come yet, "
              "or set rpdo is missing");
    EXPECT_EQ(ask("[2] set rpdo 1 0x185 event 1 x32"), "[2] OK");
    device->pdos().trigger(1);
    run(3);
    EXPECT_EQ(taken(), "1 pdo 1 1 0x12345678\r\n");
    EXPECT_EQ(ask("[3] r p 1"), "[3] 1 pdo 1 1 0x12345678");
    EXPECT_EQ(ask("[4] set tpdo 1 0x205 event 2 u32 i16"), "[4] OK");
    EXPECT_EQ(ask("[5] w p 1 2 99 -3"), "[5] OK");
    EXPECT_EQ(device->dictionary().get<std::uint32_t>(0x2000, 0), 99U);
    EXPECT_EQ(device->dictionary().get<std::int16_t>(0x2001, 0), -3);
    EXPECT_EQ(ask("[6] w p 1 1 5"), "[6] ERROR:101 #syntax error: it has 2 values");
    EXPECT_EQ(ask("[7] set tpdo 2 0x205 event 1 u8"), "[7] ERROR:400 #PDO already used");
    EXPECT_EQ(ask("[8] set tpdo 2 0x305 event 2 u64 u8"), "[8] ERROR:401 #PDO length exceeded");
    EXPECT_EQ(ask("[9] set tpdo 2 0x305 sync2 1 u16"), "[9] OK");
    EXPECT_EQ(ask("[10] w p 2 1 0x0102"), "[10] OK");
    EXPECT_TRUE(bus.sent(0x305).empty());
    bus.inject({0x80, {}}, now);
    bus.inject({0x80, {}}, now);
    run(1);
    EXPECT_EQ(bus.sent(0x305).size(), 1U);
    EXPECT_EQ(ask("[11] set rpdo 3 0x181 rtr 1 u8"), "[11] OK");
    EXPECT_EQ(ask("[12] r p 3"), "[12] ERROR:103 #timeout");
    EXPECT_EQ(ask("[13] set rpdo 4 0x191 sync 1 u8"), "[13] OK");
    bus.inject({0x191, {7}}, now);
    EXPECT_EQ(taken(), "");
    bus.inject({0x80, {}}, now);
    EXPECT_EQ(taken(), "1 pdo 4 1 7\r\n");
}
TEST_F(Gate, Own_node_beats_and_settings_are_kept) {
    std::string kept;
    gate.keep = [&](const std::string& text) {
        kept = text;
        return true;
    };
    EXPECT_EQ(ask("[1] set id 100"), "[1] OK");
    EXPECT_EQ(ask("[2] set heartbeat 20"), "[2] OK");
    ask("[3] set sdo_block 1");
    bus.log.clear();
    run(100);
    EXPECT_NEAR(static_cast<double>(bus.sent(0x764).size()), 5, 1);
    EXPECT_EQ(ask("[4] store"), "[4] OK");
    Gateway other(1);
    other.configure(kept, 0);
    other.poll(0);
    EXPECT_EQ(other.out(1).size(), 1U);
    EXPECT_EQ(ask("[5] init 4"), "[5] OK");
    gate.initialise = [](unsigned, std::uint32_t) { return false; };
    EXPECT_EQ(ask("[6] init 4"),
              "[6] ERROR:304 #CAN could not be initialised: the bus runs at another bit rate");
    EXPECT_EQ(ask("[7] restore"), "[7] OK");
    EXPECT_EQ(kept, "");
    EXPECT_TRUE(ask("[8] info version").starts_with("[8] 0 0 "));
    EXPECT_TRUE(ask("[9] help").starts_with("[9] OK|# [SEQ]"));
}
TEST_F(Gate, Init_ends_what_waits_and_so_does_a_client_that_goes) {
    taken();
    gate.receive(client, "[1] 9 r 0x1000 0\n[2] init 4\n", now);
    EXPECT_EQ(
        taken(),
        "[1] ERROR:102 #request not processed due to internal state: ended by init\r\n[2] OK\r\n");
    EXPECT_TRUE(gate.idle());
    gate.receive(client, "[3] 9 r 0x1000 0\n", now);
    EXPECT_FALSE(gate.idle());
    gate.disconnect(client);
    EXPECT_TRUE(gate.idle());
    run(5);
}
TEST_F(Gate, Lines_that_are_too_long_and_commands_that_are_too_many_are_refused) {
    gate.receive(client, std::string(Gateway::max_line + 10, 'x'), now);
    gate.receive(client, "still the same\n[1] 5 start\n", now);
    EXPECT_EQ(taken(),
              "[0] ERROR:101 #syntax error: the line is longer than 4194304 bytes\r\n[1] OK\r\n");
    std::string many;
    for (unsigned n = 0; n < Gateway::max_pending + 1; ++n) {
        many += "[" + std::to_string(n) + "] 9 r 0x1000 0\n";
    }
    gate.receive(client, many, now);
    EXPECT_EQ(
        taken(),
        "[64] ERROR:600 #running out of memory: too many commands wait for their answers\r\n");
}

struct LssGate : Gate {
    void SetUp() override { make(unconfigured); }
};
TEST_F(LssGate, Node_without_id_is_found_gets_one_and_talks) {
    EXPECT_EQ(ask("[1] lss_ident_nonconf"), "[1] OK");
    EXPECT_EQ(ask("[2] _lss_fastscan 5", 60'000),
              "[2] 0x00000001 0x00000002 0x00000003 0x00000004");
    EXPECT_EQ(ask("[3] lss_inquire_addr"), "[3] 0x00000001 0x00000002 0x00000003 0x00000004");
    EXPECT_EQ(ask("[4] lss_inquire_addr 3"), "[4] 0x00000004");
    EXPECT_EQ(ask("[5] lss_get_node"), "[5] 255");
    EXPECT_EQ(ask("[6] lss_set_node 200"), "[6] ERROR:502 #LSS: node-ID not supported");
    EXPECT_EQ(ask("[7] lss_conf_bitrate 0 0"), "[7] ERROR:503 #LSS: bit rate not supported");
    EXPECT_EQ(ask("[8] lss_conf_bitrate 0 2"), "[8] OK");
    EXPECT_EQ(ask("[9] lss_set_node 9"), "[9] OK");
    EXPECT_EQ(ask("[10] lss_store"), "[10] OK");
    EXPECT_EQ(ask("[11] lss_switch_glob 0"), "[11] OK|1 9 BOOT_UP");
    EXPECT_EQ(ask("[12] 9 r 0x2002 0 u8"), "[12] 7");
    EXPECT_EQ(ask("[13] lss_identity 1 2 0 9 0 9"), "[13] OK");
    EXPECT_EQ(ask("[14] lss_identity 1 2 0 9 7 9"), "[14] ERROR:103 #timeout");
    EXPECT_EQ(ask("[15] lss_switch_sel 1 2 3 4"), "[15] OK");
    EXPECT_EQ(ask("[16] lss_activate_bitrate 10"), "[16] OK");
    EXPECT_EQ(events.activated_rate, 500'000U);
    EXPECT_EQ(ask("[17] lss_get_node"), "[17] 9");
}

TEST(GatewayValues, Base64_is_read_and_written) {
    const auto bytes = [](std::string_view text) {
        return std::vector<std::uint8_t>(text.begin(), text.end());
    };
    for (const auto& [plain, coded] : {std::pair{"", ""},
                                       {"f", "Zg=="},
                                       {"fo", "Zm8="},
                                       {"foo", "Zm9v"},
                                       {"foob", "Zm9vYg=="}}) {
        EXPECT_EQ(gateway::base64(bytes(plain)), coded);
        std::vector<std::uint8_t> back;
        EXPECT_TRUE(gateway::base64(coded, back));
        EXPECT_EQ(back, bytes(plain));
    }
    std::vector<std::uint8_t> back;
    for (const char* wrong : {"Zg", "Zg=", "=g==", "Z===", "Zg=?", "Zm 9"}) {
        EXPECT_FALSE(gateway::base64(wrong, back)) << wrong;
    }
}

}  // namespace
}  // namespace hal::canopen::test
