// SPDX-License-Identifier: MIT
// What a card is: its name, firmware, modules and pins.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bus/mesa/card_client.hpp"
#include "mesa/hostmot2/module.hpp"
#include "mesa/hostmot2/pin.hpp"

namespace hal::tools {

struct CardIdentity {
    std::string name;  ///< as reported
    std::array<std::uint8_t, 6> mac{};
    std::uint16_t lbp_version = 0;
    std::uint16_t firmware_version = 0;
    std::uint16_t received_packets = 0;
    std::uint16_t parse_errors = 0;
    std::uint16_t idrom_address = 0;
    mesa::Idrom idrom;
    std::string board;  ///< of the IDROM
    std::vector<mesa::ModuleDescriptor> modules;
    std::vector<mesa::PinDescriptor> pins;
};

/// Reads name and MAC; returns the problem, or "".
std::string read_name(CardClient& card, CardIdentity& to);
/// Reads everything; returns the problem, or "".
std::string read_identity(CardClient& card, CardIdentity& to);
/// "02:00:00:00:00:01"
std::string mac_text(const std::array<std::uint8_t, 6>& mac);

}  // namespace hal::tools
