// SPDX-License-Identifier: MIT
// Cards by the name that they report in memory space 7.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace hal::mesa {

struct Board {
    std::string_view card;  ///< the name that the card reports, or its beginning
    bool is_prefix;         ///< false: the name has to be equal
    std::string_view name;  ///< in names of pins: "7i92"
    std::uint8_t ports;
    std::uint8_t pins;  ///< of a port
};

std::span<const Board> boards() noexcept;
/// Finds the card of a reported name, up to its first NUL; the longest name that fits. [any]
const Board* board_of(std::string_view card) noexcept;

}  // namespace hal::mesa
