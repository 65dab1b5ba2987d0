// SPDX-License-Identifier: MIT
// The raw bits of the fields of a CAN message; a value that is out of the range of its field is
// limited to it.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace hal::messages {

/// Returns the value, limited to an unsigned field of 1 to 4 bytes. [realtime]
inline std::uint64_t unsigned_bits(std::uint32_t value, std::uint32_t bytes) noexcept {
    return std::min<std::uint64_t>(value, (std::uint64_t{1} << (8 * bytes)) - 1);
}

/// Returns the value, limited to a signed field of 1 to 4 bytes; the bits above the field are those
/// of its sign. [realtime]
inline std::uint64_t signed_bits(std::int32_t value, std::uint32_t bytes) noexcept {
    const std::int64_t half = std::int64_t{1} << (8 * bytes - 1);
    return static_cast<std::uint64_t>(std::clamp<std::int64_t>(value, -half, half - 1));
}

/// Returns the value as a float, limited to its largest finite one; infinity and NaN are kept.
/// [realtime]
inline std::uint64_t single_bits(double value) noexcept {
    constexpr double most = std::numeric_limits<float>::max();
    return std::bit_cast<std::uint32_t>(
        static_cast<float>(std::isfinite(value) ? std::clamp(value, -most, most) : value));
}

}  // namespace hal::messages
