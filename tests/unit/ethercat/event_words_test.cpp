// SPDX-License-Identifier: MIT
#include "ethercat/config/event_words.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "ethercat/wire/al_status_codes.hpp"

namespace {

using namespace hal::ethercat;
using master::Event;
using master::Events;

std::string words(Event event, std::uint32_t slave, std::int64_t first = 0, std::int64_t second = 0) {
    master::Setup setup;
    setup.slaves.resize(2);
    setup.slaves[1].name = "x-axis", setup.slaves[1].position = 4;
    return config::event_words({event, slave, first, second}, setup, "eth:enp3s0", "eth:enp4s0");
}

TEST(EthercatEventWords, Refused_state_names_slave_state_code_cause_and_remedy) {
    EXPECT_EQ(words(Event::state_refused, 1, 4, 0x001e),
              "slave 4 (x-axis) rejects SAFE-OP with AL status code 0x001E (invalid input configuration): the length of the inputs differs from "
              "the PDO mapping; compare its PDOs with the configuration");
    EXPECT_EQ(words(Event::state_refused, 1, 8, 0x8123),
              "slave 4 (x-axis) rejects OP with AL status code 0x8123; see the manual of the drive");
}

TEST(EthercatEventWords, Wrong_device_names_what_was_found_and_expected) {
    EXPECT_EQ(words(Event::wrong_product, 0, 0x402, 0x403),
              "slave 0 has the product code 0x00000402, the configuration expects 0x00000403; it stays in INIT: connect the right device, or "
              "correct `product`");
    EXPECT_EQ(words(Event::unknown_slave, Events::of_position + 7, 0x2, 0x7d83052),
              "slave at position 7 is not in the configuration (vendor 0x00000002, product 0x07D83052); add it");
}

TEST(EthercatEventWords, Objects_and_aborts_are_written_as_in_the_standard) {
    EXPECT_EQ(words(Event::startup_write_failed, 1, 0x606000, 0x06020000).substr(0, 86),
              "slave 4 (x-axis) rejects the start-up write of 0x6060:0: SDO abort 0x06020000 (object ");
    EXPECT_EQ(words(Event::mapping_failed, 1, 0x160001, 0),
              "slave 4 (x-axis) rejects the PDO mapping at 0x1600:1: no answer from its mailbox");
}

TEST(EthercatEventWords, Bus_events_name_the_port_and_the_domain) {
    EXPECT_EQ(words(Event::link_lost, Events::bus, 1), "eth:enp4s0 has no link; check the cable to the first slave");
    EXPECT_EQ(words(Event::scanned, Events::bus, 1, 1), "found 1 slave on eth:enp3s0");
    EXPECT_EQ(words(Event::scanned, Events::bus, 3, 2), "found 3 slaves on eth:enp3s0, the configuration has 2");
    EXPECT_EQ(words(Event::wkc_incomplete, Events::bus, 3, 6),
              "domain 'default': working counter 3 instead of 6: some slaves do not exchange process data");
    EXPECT_EQ(words(Event::dc_synchronised, Events::bus, 240), "all clocks are synchronised, largest deviation 0.24 us");
}

TEST(EthercatEventWords, Every_event_but_a_reached_state_has_a_sentence) {
    for (int n = 0; n <= static_cast<int>(Event::start_up_failed); ++n) {
        const auto event = static_cast<Event>(n);
        const bool needs_none = event == Event::state_reached;
        EXPECT_EQ(words(event, 1, 1, 1).empty(), needs_none) << n;
        EXPECT_EQ(words(event, 1, 1, 1).find("  "), std::string::npos) << words(event, 1, 1, 1);
    }
}

TEST(EthercatAlStatus, Every_code_has_a_cause_and_a_remedy_and_they_are_in_order) {
    unsigned rows = 0, last = 0;
    for (unsigned code = 0; code <= 0xffff; ++code) {
        const AlStatusCode* row = al_status(static_cast<std::uint16_t>(code));
        if (row == nullptr) continue;
        ++rows;
        EXPECT_EQ(row->code, code);
        EXPECT_GE(code, last);
        last = code;
        EXPECT_TRUE(std::strlen(row->text) > 0 && std::strlen(row->cause) > 0 && std::strlen(row->remedy) > 0) << code;
    }
    EXPECT_EQ(rows, 55U);
    EXPECT_EQ(al_status(0), nullptr);
}

}  // namespace
