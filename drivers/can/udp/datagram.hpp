// SPDX-License-Identifier: MIT
// One frame as one msgpack map, exactly the one python-can reads and writes: eleven keys, none more, or its receiver gives up.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "link/can.hpp"

namespace hal::can::canudp {

using Datagram = std::array<std::uint8_t, 256>;

/// A valid frame into `out`; its size. [realtime]
std::size_t encode(const Frame&, std::int64_t real_time_ns, Datagram& out) noexcept;
/// False, and the frame is rubbish, when it is not such a map of a valid frame. Any order of the keys, any width of the integers; keys
/// that are not known are skipped. [realtime]
bool decode(std::span<const std::uint8_t> in, Frame&) noexcept;

}  // namespace hal::can::canudp
