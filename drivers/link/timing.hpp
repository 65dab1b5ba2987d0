// SPDX-License-Identifier: MIT
// How long a frame is on the wire: exact, from its bits and their stuffing, and at most, from its length alone.
#pragma once

#include <cstdint>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// Bits of a frame from start of frame to the end of the intermission (3 bits), with the stuff bits its content needs.
/// `data` of an FD frame with bit-rate switch counts the bits sent at the data rate; of all others it is 0.
struct Bits {
    unsigned nominal = 0;
    unsigned data = 0;
    unsigned total() const noexcept { return nominal + data; }
};
inline constexpr unsigned intermission_bits = 3;

/// [realtime]
Bits frame_bits(const Frame&) noexcept;
/// The most bits a frame of this shape can have, whatever it carries. [realtime]
Bits worst_case_bits(unsigned length, bool extended, bool fd = false, bool bit_rate_switch = false, bool remote = false) noexcept;

/// Time of `bits` at these rates, rounded up to whole ns; 0 when `bit_rate` is 0. A `data_rate` of 0 means the nominal one. [realtime]
std::int64_t duration_ns(Bits bits, std::uint32_t bit_rate, std::uint32_t data_rate = 0) noexcept;

/// A value that orders frames as arbitration does: the smaller one wins. Equal: the bus cannot tell them apart while arbitrating.
/// [realtime]
std::uint32_t arbitration_rank(const Frame&) noexcept;

#pragma GCC visibility pop

}  // namespace hal::can
