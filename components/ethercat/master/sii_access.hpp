// SPDX-License-Identifier: MIT
// Access to the EEPROM of a slave (SII) through its registers (ETG.1000.4, clause 6.4).
#pragma once

#include <array>
#include <cstdint>

#include "ethercat/master/channel.hpp"

namespace hal::ethercat::master {

/// Four words of the SII.
struct SiiData {
    bool ok = false;
    std::uint16_t control = 0;  ///< 0502h as last read, for messages
    std::array<std::uint16_t, 4> words{};
};

/// Reads four words from word address `word` on. [realtime]
Task<SiiData> sii_read(Channel&, std::uint16_t station, std::uint32_t word) noexcept;
/// Writes a word; waits until the EEPROM has stored it. [realtime]
Task<bool> sii_write(Channel&, std::uint16_t station, std::uint32_t word,
                     std::uint16_t value) noexcept;

}  // namespace hal::ethercat::master
