// SPDX-License-Identifier: MIT
// The cards that can be emulated, a row each.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesa/hostmot2/module.hpp"

namespace hal::mesa {

struct CardModel {
    std::string_view type;      ///< "7i92"
    std::string_view reported;  ///< name in memory space 7
    std::string_view board;     ///< name in the IDROM, 8 characters
    std::uint32_t idrom_type;
    std::uint8_t ports;
    std::uint8_t pins;  ///< of a port
    std::span<const ModuleDescriptor> modules;
    std::span<const std::uint32_t> descriptors;  ///< of all pins
    std::uint8_t default_remotes;                ///< bit n: a 7I76 on channel n
};

std::span<const CardModel> card_models() noexcept;
/// Returns nullptr for an unknown type. [any]
const CardModel* find_card_model(std::string_view type) noexcept;
/// Returns all types. [setup]
std::vector<std::string> card_types();

}  // namespace hal::mesa
