// SPDX-License-Identifier: MIT
// The time of a frame on the bus: exact, from its bits and stuffing, and worst case, from its
// length.
#pragma once

#include <cstdint>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// Bits of a frame from start of frame to the end of the intermission (3 bits), including stuff
/// bits (ISO 11898-1). For an FD frame with bit-rate switch, `data` counts the bits sent at the
/// data rate; otherwise it is 0.
struct Bits {
    unsigned nominal = 0;
    unsigned data = 0;
    unsigned total() const noexcept { return nominal + data; }
};
inline constexpr unsigned intermission_bits = 3;

/// Returns the exact number of bits of a frame. [realtime]
Bits frame_bits(const Frame&) noexcept;
/// Returns the largest number of bits of a frame of this shape, whatever its data. [realtime]
Bits worst_case_bits(unsigned length, bool extended, bool fd = false, bool bit_rate_switch = false,
                     bool remote = false) noexcept;

/// Returns the time of `bits` in ns, rounded up; 0 when `bit_rate` is 0. A `data_rate` of 0 means
/// the nominal one. Rates in bit/s. [realtime]
std::int64_t duration_ns(Bits bits, std::uint32_t bit_rate, std::uint32_t data_rate = 0) noexcept;

/// Returns a rank that orders frames as arbitration does: the smaller one wins; equal ones cannot
/// be distinguished while arbitrating. [realtime]
std::uint32_t arbitration_rank(const Frame&) noexcept;

#pragma GCC visibility pop

}  // namespace hal::can
