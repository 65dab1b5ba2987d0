// SPDX-License-Identifier: MIT
#include "bus/mesa/card_identity.hpp"

#include <fmt/core.h>

#include "mesa/lbp16/spaces.hpp"

namespace hal::tools {

using namespace mesa;

namespace {

/// Printable characters up to the first NUL.
std::string text_in(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t byte : bytes) {
        if (byte == 0) break;
        text += byte >= 0x20 && byte < 0x7f ? static_cast<char>(byte) : '?';
    }
    return text;
}

std::string fault_text(IdromFault fault) {
    switch (fault) {
    case IdromFault::none: break;
    case IdromFault::type: return "its type is not 2 or 3";
    case IdromFault::width: return "the number of its pins is not ports x pins of a port";
    case IdromFault::no_pins: return "it has no pins";
    case IdromFault::many_pins: return "it has more than 1000 pins";
    case IdromFault::clock: return "a clock is slower than 1 MHz";
    case IdromFault::descriptors: return "its descriptors are not in the registers";
    }
    return {};
}

std::string read_idrom(CardClient& card, CardIdentity& to) {
    const auto head = card.read(Space::hostmot2, cookie_address, Unit::u32, 4);
    if (!head) return card.silence();
    const auto cookie = load<std::uint32_t>(head->data());
    if (cookie != hostmot2_cookie) {
        return fmt::format(
            "the cookie at 0x0100 is 0x{:08X}, not 0x{:08X}: the firmware is not "
            "HostMot2",
            cookie, hostmot2_cookie);
    }
    const std::string name = text_in(std::span(*head).subspan(4, 8));
    if (name != firmware_name) return "the firmware is '" + name + "', not HOSTMOT2";
    to.idrom_address = load<std::uint16_t>(head->data() + 12);
    const auto bytes = card.read(Space::hostmot2, to.idrom_address, Unit::u32, Idrom::size / 4);
    if (!bytes) return card.silence();
    to.idrom = *Idrom::decode(*bytes);
    to.board = text_in(std::span(*bytes).subspan(0x0c, 8));
    const IdromFault fault = fault_of(to.idrom, to.idrom_address);
    if (fault == IdromFault::none) return {};
    return fmt::format("invalid IDROM at 0x{:04X}: {}", to.idrom_address, fault_text(fault));
}

std::string read_descriptors(CardClient& card, CardIdentity& to) {
    const auto modules_at = static_cast<std::uint16_t>(to.idrom_address + to.idrom.modules);
    constexpr std::size_t words = ModuleDescriptor::size / 4;
    const auto modules = card.read(Space::hostmot2, modules_at, Unit::u32, max_modules * words);
    if (!modules) return card.silence();
    for (std::size_t n = 0; n < max_modules; ++n) {
        const auto module =
            ModuleDescriptor::decode(std::span(*modules).subspan(n * ModuleDescriptor::size));
        if (module->tag == Tag::none) break;
        to.modules.push_back(*module);
    }
    const auto pins_at = static_cast<std::uint16_t>(to.idrom_address + to.idrom.pins);
    const auto pins = card.read(Space::hostmot2, pins_at, Unit::u32, to.idrom.width);
    if (!pins) return card.silence();
    for (std::size_t n = 0; n < to.idrom.width; ++n) {
        to.pins.push_back(PinDescriptor::decode(load<std::uint32_t>(pins->data() + 4 * n)));
    }
    return {};
}

}  // namespace

std::string read_name(CardClient& card, CardIdentity& to) {
    Request request;
    request.read(Space::card, card::name, Unit::u16, 10);
    request.read(Space::eeprom, eeprom::mac, Unit::u16, 3);
    request.read(Space::status, status::parse_errors, Unit::u16, 1);
    request.read(Space::status, status::received_packets, Unit::u16, 1);
    const auto reply = card.ask(request);
    if (!reply) return card.silence();
    const std::span<const std::uint8_t> bytes(*reply);
    to.name = text_in(bytes.first(16));
    to.lbp_version = load<std::uint16_t>(bytes.data() + card::lbp_version);
    to.firmware_version = load<std::uint16_t>(bytes.data() + card::firmware_version);
    to.mac = reversed_mac(bytes.subspan(20).first<6>());
    to.parse_errors = load<std::uint16_t>(bytes.data() + 26);
    to.received_packets = load<std::uint16_t>(bytes.data() + 28);
    return {};
}

std::string read_identity(CardClient& card, CardIdentity& to) {
    for (const auto step : {read_name, read_idrom, read_descriptors}) {
        if (std::string problem = step(card, to); !problem.empty()) return problem;
    }
    return {};
}

std::string mac_text(const std::array<std::uint8_t, 6>& mac) {
    return fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", mac[0], mac[1], mac[2], mac[3],
                       mac[4], mac[5]);
}

}  // namespace hal::tools
