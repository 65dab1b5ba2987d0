// SPDX-License-Identifier: MIT
// Portable grey and pix maps, PGM and PPM of Netpbm: P2 P3 P5 P6, 8 or 16 bits (pgm(5), ppm(5)).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "vision/capture/source.hpp"

namespace hal::vision {

/// Reads the first picture of `bytes` into `frame`, 16-bit samples shortened to 8. Nothing when it
/// is well; the problem otherwise, and the frame is undefined. Bounded: whatever the bytes, it
/// takes no more memory than a frame may have. [any]
std::optional<Problem> read_pnm(const std::uint8_t* bytes, std::size_t count, Frame& frame);

/// The frame as P5 or P6. [any]
std::string write_pnm(const Frame& frame);

}  // namespace hal::vision
