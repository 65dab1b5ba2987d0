// SPDX-License-Identifier: MIT
// One frame as a msgpack map in the exact format of python-can: eleven keys and no more, or its
// receiver fails.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "link/can.hpp"

namespace hal::can::canudp {

using Datagram = std::array<std::uint8_t, 256>;

/// Encodes a valid frame. Returns the size. [realtime]
std::size_t encode(const Frame&, std::int64_t real_time_ns, Datagram& out) noexcept;
/// Decodes a map with the keys in any order and integers of any width; unknown keys are skipped.
/// Returns false, with an unspecified frame, for anything but a valid frame. [realtime]
bool decode(std::span<const std::uint8_t> in, Frame&) noexcept;

}  // namespace hal::can::canudp
