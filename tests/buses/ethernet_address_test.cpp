// SPDX-License-Identifier: MIT
// Addresses of Ethernet segments, and the discipline of a line.
#include "discipline/discipline.hpp"
#include "link/segment.hpp"

#include <gtest/gtest.h>

#include <span>

namespace hal::ethernet {
namespace {

TEST(Ethernet, open_reports_what_to_write_for_an_invalid_address) {
    EXPECT_EQ(open("net0").problem,
              "'net0' is not the address of an Ethernet segment; write eth:enp3s0 for an interface "
              "of this machine, "
              "sim:NAME for a segment in memory, udp:HOST for UDP datagrams or replay:FILE for a "
              "recorded segment");
    EXPECT_EQ(open("sim:").problem, "sim:: missing name of the segment; write sim:net0");
    EXPECT_EQ(open("sim:x/").problem, "sim:x/: missing name of the station; write sim:x/master");
    EXPECT_EQ(open("sim:x?policy=fast").problem,
              "sim:x?policy=fast: invalid policy 'fast'; write hybrid, block or spin");
    EXPECT_EQ(
        open("sim:x?spin=50").problem,
        "sim:x?spin=50: invalid spin '50'; write a time up to 1 s with its unit, as in 150us");
    EXPECT_EQ(open("sim:x?priority=100").problem,
              "sim:x?priority=100: invalid priority '100'; write a number 1..99");
    EXPECT_EQ(open("sim:x?mac=03:00:00:00:00:01").problem,
              "sim:x?mac=03:00:00:00:00:01: invalid mac '03:00:00:00:00:01'; write a unicast "
              "address, as in 02:00:00:00:00:07");
    EXPECT_TRUE(open("sim:x?fast")
                    .problem.starts_with("sim:x?fast: unknown option 'fast'; options are policy, "))
        << open("sim:x?fast").problem;
}

TEST(Ethernet, addresses_are_formatted_and_parsed) {
    EXPECT_EQ(to_string(Address{2, 0xab, 0, 0xff, 9, 0x10}), "02:ab:00:ff:09:10");
    EXPECT_EQ(parse_address("02:AB:00:ff:09:10"), (Address{2, 0xab, 0, 0xff, 9, 0x10}));
    for (const char* wrong : {"", "02:ab:00:ff:09", "02:ab:00:ff:09:1", "02:ab:00:ff:09:1g",
                              "02:ab:00:ff:09:100", "02.ab.00.ff.09.10"}) {
        EXPECT_FALSE(parse_address(wrong)) << wrong;
    }
}

TEST(Ethernet, discipline_is_found_through_any_port_of_its_line) {
    struct Quiet : Discipline {
        Sent send(std::span<const std::uint8_t>, unsigned, unsigned, Finisher*) noexcept override {
            return Sent::queued;
        }
        std::size_t capacity(unsigned) const noexcept override { return 46; }
        bool ready() const noexcept override { return true; }
        const Address& address() const noexcept override { return broadcast; }
    } one, two;
    const auto first = open("sim:disciplined/a?speed=1000");
    const auto second = open("sim:disciplined/a");

    const auto other = open("sim:disciplined/b");
    EXPECT_TRUE(offer_discipline(*first.port, &one));
    EXPECT_FALSE(offer_discipline(*second.port, &two));
    const auto handle = discipline_of(*second.port);
    ASSERT_NE(handle, nullptr);
    EXPECT_TRUE(handle->holds(&one));
    EXPECT_EQ(discipline_of(*first.port), handle);
    EXPECT_EQ(discipline_of(*other.port), nullptr);
    withdraw_discipline(&one);
    EXPECT_EQ(discipline_of(*first.port), nullptr);
    EXPECT_FALSE(handle->with([](Discipline&) { FAIL(); }));
    EXPECT_TRUE(offer_discipline(*second.port, &two));
    EXPECT_TRUE(handle->holds(&two));  // the handle of the first leads to the second
    withdraw_discipline(&two);
}

TEST(Ethernet, address_is_described_without_opening_it) {
    EXPECT_TRUE(describe("sim:net0/a").in_memory);
    EXPECT_FALSE(describe("sim:net0").paced);
    EXPECT_EQ(describe("eth:enp3s0?pacer").address, "eth:enp3s0");
    EXPECT_TRUE(describe("eth:enp3s0").paced);
    EXPECT_TRUE(describe("tok:en").transport.empty());
}

}  // namespace
}  // namespace hal::ethernet
