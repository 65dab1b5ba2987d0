// SPDX-License-Identifier: MIT
// Copies of bit fields, as PDOs and complete access need them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace hal::ethercat::devices {

/// Copies whole bytes: most objects have the size of a number, which is one instruction. [realtime]
inline void copy_bytes(std::uint8_t* to, const std::uint8_t* from, std::size_t bytes) noexcept {
    switch (bytes) {
    case 1: std::memcpy(to, from, 1); break;
    case 2: std::memcpy(to, from, 2); break;
    case 4: std::memcpy(to, from, 4); break;
    default: std::memcpy(to, from, bytes); break;
    }
}

/// Copies `bits` bits from `from`, bit `from_bit`, to `to`, bit `to_bit`; bit 0 is the lowest of
/// the first byte. [realtime]
inline void copy_bits(std::uint8_t* to, std::size_t to_bit, const std::uint8_t* from,
                      std::size_t from_bit, std::size_t bits) noexcept {
    if (((to_bit | from_bit | bits) & 7) == 0) {
        copy_bytes(to + to_bit / 8, from + from_bit / 8, bits / 8);
        return;
    }
    for (std::size_t i = 0; i < bits; ++i) {
        const unsigned bit = from[(from_bit + i) / 8] >> ((from_bit + i) % 8) & 1U;
        std::uint8_t& byte = to[(to_bit + i) / 8];
        const unsigned mask = 1U << ((to_bit + i) % 8);
        byte = static_cast<std::uint8_t>(bit != 0 ? byte | mask : byte & ~mask);
    }
}

}  // namespace hal::ethercat::devices
