// SPDX-License-Identifier: MIT
#include "ethercat/config/event_texts.hpp"
#include "ethercat/config/event_filter.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "ethercat/wire/al_status_codes.hpp"

namespace {

using namespace hal::ethercat;
using master::Event;
using master::Events;

std::string words(Event event, std::uint32_t slave, std::int64_t first = 0,
                  std::int64_t second = 0) {
    master::Setup setup;
    setup.slaves.resize(2);
    setup.slaves[1].name = "x-axis";
    setup.slaves[1].position = 4;
    return config::event_text({event, slave, first, second}, setup, "eth:enp3s0", "eth:enp4s0");
}

TEST(EthercatEventWords, Refused_state_names_slave_state_code_cause_and_remedy) {
    EXPECT_EQ(
        words(Event::state_refused, 1, 4, 0x001e),
        "slave 4 (x-axis) rejects SAFE-OP with AL status code 0x001E (invalid input "
        "configuration): the length of the inputs differs from "
        "the PDO mapping; compare its PDOs with the configuration, which has no process data");
    EXPECT_EQ(
        words(Event::state_refused, 1, 8, 0x8123),
        "slave 4 (x-axis) rejects OP with AL status code 0x8123; see the manual of the drive");
}

TEST(EthercatEventWords, Wrong_device_names_what_was_found_and_expected) {
    EXPECT_EQ(words(Event::wrong_product, 0, 0x402, 0x403),
              "slave 0 has the product code 0x00000402, the configuration expects 0x00000403; it "
              "stays in INIT: connect the right device, or "
              "write `product = 0x00000402` or the `esi` of this device");
    EXPECT_EQ(words(Event::unknown_slave, Events::of_position + 7, 0x2, 0x7d83052),
              "slave at position 7 is not in the configuration (vendor 0x00000002, product "
              "0x07D83052); add [slave 7 NAME], or "
              "write `other-slaves = accept` in [bus]");
}

TEST(EthercatEventWords, Objects_and_aborts_are_written_as_in_the_standard) {
    EXPECT_EQ(
        words(Event::startup_write_failed, 1, 0x606000, 0x06020000).substr(0, 86),
        "slave 4 (x-axis) rejects the start-up write of 0x6060:0: SDO abort 0x06020000 (object ");
    EXPECT_EQ(words(Event::mapping_failed, 1, 0x60400010LL << 24 | 0x160001, 0),
              "slave 4 (x-axis) rejects object 0x6040:0 with 16 bits at 0x1600:1: no answer from "
              "its mailbox; power-cycle it");
    EXPECT_EQ(words(Event::mapping_failed, 1, 0x1600LL << 24 | 0x1c1201, 0x06090030),
              "slave 4 (x-axis) rejects PDO 0x1600 at 0x1C12:1: SDO abort 0x06090030 "
              "(invalid value for the parameter); correct `outputs` or `inputs` or "
              "their `sync-manager` in its section");
    EXPECT_EQ(
        words(Event::mapping_failed, 1, 12LL << 24 | 0x1a0000, 0x06040042),
        "slave 4 (x-axis) rejects 12 entries at 0x1A00:0: SDO abort 0x06040042 "
        "(number and length of the objects to be mapped would exceed the PDO length); correct "
        "`inputs` in its section, or, if the "
        "PDO is full, write `entries-per-pdo = 11`");
    EXPECT_EQ(words(Event::mapping_differs, 1, 0x60640020LL << 24 | 0x1a0002, 0x60410010),
              "slave 4 (x-axis) did not keep the PDO mapping: 0x1A00:2 is 0x60410010 instead of "
              "0x60640020; this PDO is fixed: list its "
              "own entries");
    EXPECT_EQ(words(Event::dc_lost, 1, 123'000, 10'000),
              "slave 4 (x-axis) is operational, but its clock deviates by 123 us from the "
              "reference clock, "
              "more than 10 us; check that the thread misses no cycles, and its manual for what it "
              "does without synchronisation. When all slaves behind the reference clock deviate "
              "alike, that clock has jumped. To set the clocks again: stop, then start");
    EXPECT_NE(words(Event::dc_far, 1, 0x7fff'ffff, 10'000)
                  .find("its clock deviates by more than 2.1 s from the reference clock"),
              std::string::npos);
    EXPECT_EQ(words(Event::dc_jumped, 1, -9'876'600, 10'000),
              "slave 4 (x-axis) has the reference clock, which jumped by 9877 us; the clocks "
              "behind it deviate by more than 10 us: check its supply, and the manuals of the "
              "slaves for what they do without synchronisation. To set the clocks again: stop, "
              "then start");
    EXPECT_EQ(words(Event::dc_jump_ended, 1, 900, 1200),
              "the clocks behind slave 4 (x-axis) are within the window again, 1200 ms after its "
              "clock jumped");
    EXPECT_EQ(words(Event::dc_tolerated, 1, 3'000, 1'000),
              "slave 4 (x-axis) deviates by 3 us from the reference clock, more than the window of "
              "1 us; it is started, because 10 us are tolerable: check the cycle of the thread, or "
              "raise `sync-window`");
    EXPECT_EQ(
        words(Event::dc_not_set, 1, 5000),
        "slave 4 (x-axis) has a clock that could not be set within 5000 ms: its receive times were "
        "not "
        "readable, or the ring is broken; it is not started: check its cables, or remove `dc`");
}

TEST(EthercatEventWords, Bus_events_name_the_port_and_the_domain) {
    EXPECT_EQ(words(Event::link_lost, Events::bus, 1),
              "eth:enp4s0 has no link; check the cable to the first slave");
    EXPECT_EQ(words(Event::scanned, Events::bus, 1, 1), "found 1 slave on eth:enp3s0");
    EXPECT_EQ(words(Event::scanned, Events::bus, 3, 2), "found 3 slaves on eth:enp3s0");
    EXPECT_EQ(words(Event::wkc_incomplete, Events::bus, 3, 6),
              "domain 'default': working counter 3 instead of 6: some slaves do not exchange "
              "process data");
    EXPECT_EQ(
        words(Event::wkc_incomplete, Events::bus, 0, 6),
        "domain 'default': working counter 0 instead of 6: no slave takes part, or the frames "
        "are lost or late");
    EXPECT_EQ(words(Event::data_stale, 1, static_cast<int>(master::Staleness::late)),
              "slave 4 (x-axis) is in OP, but its process data is not exchanged: the frames return "
              "later than the next cycle; find what delays them, or allow more time with a longer "
              "cycle or `frame-timeout` in [bus]");
    EXPECT_EQ(
        words(Event::data_stale, 1, static_cast<int>(master::Staleness::lost)),
        "slave 4 (x-axis) is in OP, but its process data is not exchanged: the frames with it "
        "do not return; check the cables and the network card");
    EXPECT_EQ(words(Event::data_stale, 1, static_cast<int>(master::Staleness::counter)),
              "slave 4 (x-axis) is in OP, but its process data is not exchanged: the working "
              "counter of its datagram is too small; it, or another slave of the same datagram, "
              "does not take part: power-cycle them");
    EXPECT_EQ(words(Event::ring_broken, Events::bus, -1, 0),
              "eth:enp3s0 reaches no slave: the ring is broken there; all slaves still exchange "
              "data, repair the cable");
    EXPECT_EQ(words(Event::dc_synchronised, Events::bus, 240),
              "all clocks are synchronised, largest deviation 0.24 us");
}

TEST(EthercatEventWords, Start_up_writes_name_value_and_line) {
    using Protocol = master::StartupWrite::Protocol;
    master::Setup setup;
    setup.slaves.resize(1);
    master::StartupWrite w;
    w.index = 0x6060;
    w.data = {8};
    w.line = 12;
    setup.slaves[0].startup.push_back(w);
    w.index = 0x8096;
    w.sub = 1;
    w.data = {7, 0};
    w.protocol = Protocol::soe;
    w.line = 0;
    setup.slaves[0].startup.push_back(w);
    w.index = 0x420;
    w.sub = 0;
    w.protocol = Protocol::reg;
    w.line = 14;
    setup.slaves[0].startup.push_back(w);
    const auto of = [&](std::int64_t object, std::int64_t code) {
        return config::event_text({Event::startup_write_failed, 0, object, code}, setup,
                                  "eth:enp3s0");
    };
    EXPECT_EQ(of(0x606000, 0x06090031),
              "slave 0 rejects 0x08 for 0x6060:0: SDO abort 0x06090031 (value of the "
              "parameter written too high); correct or delete line 12 of the configuration");
    EXPECT_EQ(of(0x809601, 0x7004),
              "slave 0 rejects 0x0007 for IDN P-0-150 of drive 1: SoE error 0x7004 (value is "
              "read-only); its description asks "
              "for it: check its `esi`");
    constexpr std::int64_t unsupported = master::mailbox_error_flag | 2;
    EXPECT_EQ(of(0x809601, unsupported),
              "slave 0 rejects 0x0007 for IDN P-0-150 of drive 1: mailbox error 0x0002 (protocol "
              "not supported); its description asks for it: check its `esi`");
    EXPECT_EQ(of(0x606000, unsupported),
              "slave 0 rejects 0x08 for 0x6060:0: mailbox error 0x0002 (protocol not supported); "
              "correct or delete line 12 of the configuration");
    EXPECT_EQ(of(0x42000, 0),
              "slave 0 rejects 0x0007 for register 0x0420: it does not answer; correct or delete "
              "line 14 of the configuration");
}

TEST(EthercatEventWords, One_cause_is_news_once_until_the_slave_is_operational) {
    config::EventFilter filter(2);
    const auto is_new = [&](Event event, std::int64_t first = 0, std::int64_t second = 0) {
        return filter.is_new(event, 1, first, second);
    };
    EXPECT_TRUE(is_new(Event::state_refused, 4, 0x1d));
    EXPECT_FALSE(is_new(Event::start_up_failed, 2, 1)) << "the cause is known";
    EXPECT_FALSE(is_new(Event::state_refused, 4, 0x1d));
    EXPECT_TRUE(is_new(Event::state_refused, 8, 0x1d)) << "another cause";
    EXPECT_TRUE(is_new(Event::dc_timeout, 2000, 1000));
    EXPECT_FALSE(is_new(Event::dc_timeout, 2001, 1000));
    EXPECT_TRUE(filter.is_new(Event::state_refused, 0, 4, 0x1d)) << "another slave";
    EXPECT_TRUE(is_new(Event::slave_operational));
    EXPECT_TRUE(is_new(Event::state_refused, 4, 0x1d));
    EXPECT_TRUE(is_new(Event::slave_returned));
    EXPECT_TRUE(is_new(Event::start_up_failed, 2, 1)) << "nothing else was reported";
    EXPECT_FALSE(is_new(Event::start_up_failed, 2, 2));
    EXPECT_TRUE(filter.is_new(Event::unknown_slave, Events::of_position + 1, 2, 3));
}

TEST(EthercatEventWords, Every_event_but_a_reached_state_has_a_sentence) {
    for (int n = 0; n <= static_cast<int>(Event::slave_settled); ++n) {
        const auto event = static_cast<Event>(n);
        const bool needs_none = event == Event::state_reached;
        EXPECT_EQ(words(event, 1, 1, 1).empty(), needs_none) << n;
        EXPECT_EQ(words(event, 1, 1, 1).find("  "), std::string::npos) << words(event, 1, 1, 1);
    }
}

TEST(EthercatEventWords, Faults_are_of_the_rows_of_the_sentences) {
    master::Setup setup;
    setup.slaves.resize(2);
    setup.slaves[1].name = "y";
    setup.slaves[1].position = 1;
    const auto faults = config::fault_texts(setup, "eth:enp3s0");
    const auto text = [&](Event event, std::uint32_t slave) {
        const auto* const fault = faults.of(event, slave);
        return fault != nullptr ? fault->text : std::string();
    };
    EXPECT_EQ(text(Event::slave_lost, 1),
              "slave 1 (y) does not answer; its inputs keep their last values");
    EXPECT_EQ(text(Event::wrong_serial, 1),
              "slave 1 (y) is not the device of the configuration; it stays in INIT");
    EXPECT_EQ(text(Event::start_up_failed, 1), "slave 1 (y) did not start; it is tried again");
    EXPECT_EQ(text(Event::fell_back, 1),
              "slave 1 (y) left its state with AL status code {x}; its outputs are off");
    EXPECT_EQ(
        text(Event::dc_lost, 1),
        "slave 1 (y) is out of step, its clock deviates by {} us; to set its clock again: stop, "
        "then start");
    EXPECT_EQ(text(Event::dc_far, 1),
              "slave 1 (y) is out of step, its clock deviates by more than 2.1 s; to set its clock "
              "again: stop, then start");
    EXPECT_EQ(text(Event::unknown_slave, Events::of_position + 3),
              "a slave on eth:enp3s0 is not in the configuration");
    EXPECT_EQ(text(Event::link_lost, Events::bus),
              "eth:enp3s0 has no link; no process data is exchanged");
    EXPECT_EQ(text(Event::slave_operational, 1), "");
    EXPECT_EQ(faults.of(Event::fell_back, 1)->detail(0x1b), 0x1b);
    EXPECT_DOUBLE_EQ(faults.of(Event::dc_lost, 1)->detail(348'974), 348.974);
    EXPECT_EQ(text(Event::dc_jumped, 1),
              "slave 1 (y) has the reference clock, which jumped by {} us; the clocks behind it "
              "are out of step; to set them again: stop, then start");
    EXPECT_DOUBLE_EQ(faults.of(Event::dc_jumped, 1)->detail(348'974), 348.974);
    setup.dc_loss = master::DcLoss::safeop;
    EXPECT_EQ(config::fault_texts(setup, "eth:enp3s0").of(Event::dc_jumped, 1)->text,
              "slave 1 (y) has the reference clock, which jumped by {} us; the clocks behind it "
              "are out of step; their outputs are off until they are in step again");
    EXPECT_EQ(config::fault_texts(setup, "eth:enp3s0").of(Event::dc_lost, 1)->text,
              "slave 1 (y) is out of step, its clock deviates by {} us; its outputs are off until "
              "it is in step again");
}

TEST(EthercatAlStatus, Every_code_has_a_cause_and_a_remedy_and_they_are_in_order) {
    unsigned rows = 0;
    unsigned last = 0;
    for (unsigned code = 0; code <= 0xffff; ++code) {
        const AlStatusCode* row = al_status(static_cast<std::uint16_t>(code));
        if (row == nullptr) continue;
        ++rows;
        EXPECT_EQ(row->code, code);
        EXPECT_GE(code, last);
        last = code;
        EXPECT_TRUE(std::strlen(row->text) > 0 && std::strlen(row->cause) > 0 &&
                    std::strlen(row->remedy) > 0)
            << code;
    }
    EXPECT_EQ(rows, 55U);
    EXPECT_EQ(al_status(0), nullptr);
}

TEST(EthercatEventWords, With_LinuxCNCs_format_the_advice_is_in_its_elements) {
    master::Setup setup;
    setup.slaves.resize(1);
    setup.slaves[0].name = "x";
    const auto told = [&](Event event, std::uint32_t slave, std::int64_t first = 0,
                          std::int64_t second = 0) {
        return config::event_text({event, slave, first, second}, setup, "eth:enp3s0", "",
                                  config::Format::lcec);
    };
    EXPECT_EQ(told(Event::wrong_product, 0, 0x402, 0x04020001),
              "slave 0 (x) has the product code 0x00000402, the configuration expects 0x04020001; "
              "it stays in INIT: connect the right "
              "device, or write pid=\"00000402\"");
    EXPECT_EQ(told(Event::wrong_vendor, 0, 0xcafe, 2),
              "slave 0 (x) has the vendor 0x0000CAFE, the configuration expects 0x00000002; it "
              "stays in INIT: connect the right device, or "
              "write vid=\"0000CAFE\"");
    EXPECT_EQ(told(Event::slave_missing, 0),
              "slave 0 (x) is not on the bus; check its supply and cable, or delete its <slave>");
    EXPECT_EQ(told(Event::unknown_slave, Events::of_position + 3, 0xcafe, 0x402),
              "slave at position 3 is not in the configuration (vendor 0x0000CAFE, product "
              "0x00000402); add <slave idx=\"3\" "
              "type=\"generic\" vid=\"0000CAFE\" pid=\"00000402\"/>");
    EXPECT_EQ(told(Event::no_mailbox, 0, 0x606000),
              "slave 0 (x) has no mailbox, but the configuration writes 0x6060:0 at start; delete "
              "its <sdoConfig>, <idnConfig> and "
              "<initCmds>");
    EXPECT_EQ(
        told(Event::dc_unsupported, 0),
        "slave 0 (x) has no distributed clock, but the configuration has <dcConf>; delete it");
    EXPECT_EQ(told(Event::mapping_failed, 0, std::int64_t{0x60410010} << 24 | 0x160002, 0x06040041),
              "slave 0 (x) rejects object 0x6041:0 with 16 bits at 0x1600:2: SDO abort 0x06040041 "
              "(object cannot be mapped to a PDO); "
              "correct its <syncManager dir=\"out\"> or its <modParam>");
}

}  // namespace
