// SPDX-License-Identifier: MIT
#include "ethercat/plugins/entry_pins.hpp"

#include <array>
#include <bit>
#include <limits>
#include <memory>

#include "tests/unit/ethercat/pin_host.hpp"

namespace hal::ethercat {
namespace {

using Host = PinHost;

struct Entries : Component {
    using Component::Component;
    Function receive{*this, "receive", &Entries::nothing, "shows inputs"};
    Function transmit{*this, "transmit", &Entries::nothing, "takes outputs"};
    EntryPins pins{*this, receive, transmit};

    void nothing(Cycle) noexcept {}
    void declare(unsigned bits, master::Type type, bool output, std::size_t at = 0) {
        master::Entry entry;
        entry.index = 0x7010;
        entry.bits = static_cast<std::uint16_t>(bits);
        entry.type = type;
        entry.name = output ? "out" : "in";
        pins.declare("", entry, output, 0, at);
    }
};

TEST(EthercatEntryPins, Real_wider_than_its_entry_leaves_the_bits_behind_it) {
    for (const master::Type type : {master::Type::real32, master::Type::real64}) {
        Host host;
        Entries entries(host.get());
        entries.declare(16, type, true);
        entries.declare(16, type, false);
        host.value<std::uint32_t>("out") = 0x12345678;
        // ends with the entry: ASan reports an access behind it
        const auto image = std::make_unique<std::uint8_t[]>(2);
        const std::span<std::uint8_t> areas[] = {{image.get(), 2}};
        entries.pins.transmit(areas);
        entries.pins.show(areas);
        EXPECT_EQ(host.value<std::uint32_t>("in"), 0xffffU);
    }
}

TEST(EthercatEntryPins, Real_of_the_width_of_its_entry_is_a_float) {
    Host host;
    Entries entries(host.get());
    entries.declare(32, master::Type::real32, true);
    entries.declare(32, master::Type::real32, false);
    host.value<double>("out") = -1.5;
    std::array<std::uint8_t, 4> image{};
    const std::span<std::uint8_t> areas[] = {image};
    entries.pins.transmit(areas);
    entries.pins.show(areas);
    EXPECT_EQ(image, (std::array<std::uint8_t, 4>{0, 0, 0xc0, 0xbf}));
    EXPECT_EQ(host.value<double>("in"), -1.5);
}

TEST(EthercatEntryPins, Real_input_that_is_not_finite_keeps_the_last_value_and_is_counted) {
    Host host;
    Entries entries(host.get());
    entries.declare(32, master::Type::real32, false);
    std::array<std::uint8_t, 4> image{};
    const std::span<std::uint8_t> areas[] = {image};
    const auto show = [&](float value) {
        write_bits(image, 0, 32, std::bit_cast<std::uint32_t>(value));
        entries.pins.show(areas);
        return host.value<double>("in");
    };
    EXPECT_EQ(show(2.5F), 2.5);
    EXPECT_EQ(host.value<std::uint32_t>("invalid"), 0U);
    EXPECT_EQ(show(std::numeric_limits<float>::quiet_NaN()), 2.5);
    EXPECT_EQ(show(-std::numeric_limits<float>::infinity()), 2.5);
    EXPECT_EQ(host.value<std::uint32_t>("invalid"), 2U);
    EXPECT_EQ(show(-1.0F), -1.0);
    EXPECT_EQ(host.value<std::uint32_t>("invalid"), 2U);
}

}  // namespace
}  // namespace hal::ethercat
