// SPDX-License-Identifier: MIT
// Layer setting services (CiA 305): what master and slave share.
#pragma once

#include <array>
#include <cstdint>

namespace hal::canopen {

/// Vendor, product, revision, serial number: objects 1018h:1–4.
using Identity = std::array<std::uint32_t, 4>;

/// CAN identifiers of LSS.
inline constexpr std::uint32_t lss_slave_to_master = 0x7e4;
inline constexpr std::uint32_t lss_master_to_slave = 0x7e5;
/// The node ID of a node that waits for an LSS master.
inline constexpr std::uint8_t unconfigured = 255;

/// Returns the bit rate in bit/s at `index` in table 0 of CiA 305; 0: reserved, or automatic
/// detection. [any]
constexpr std::uint32_t lss_bit_rate(unsigned index) noexcept {
    constexpr std::array<std::uint32_t, 9> table{1'000'000, 800'000, 500'000, 250'000, 125'000,
                                                 0,         50'000,  20'000,  10'000};
    return index < table.size() ? table[index] : 0;
}
/// Returns the index of a bit rate (bit/s) in table 0 of CiA 305; 255 if it is not in the table.
/// [any]
constexpr std::uint8_t lss_bit_rate_index(std::uint32_t rate) noexcept {
    for (unsigned n = 0; n < 9; ++n) {
        if (rate != 0 && lss_bit_rate(n) == rate) return static_cast<std::uint8_t>(n);
    }
    return 255;
}

}  // namespace hal::canopen
