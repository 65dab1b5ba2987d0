// SPDX-License-Identifier: MIT
// Coloured spots in a picture and their middles to a part of a pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "vision/capture/frame.hpp"

namespace hal::vision {

/// How much a pixel is of a colour, 0 to 255. With the hue h and the pixel's chroma as a vector (along, across) seen from h, it is
///     along - |across| / tan(tolerance)
/// which is linear in how much of the pixel the colour covers (on grey), and in the light: a middle weighted with it does not move with
/// either.
struct Hue {
    double degrees = 0.0;  ///< 0 red, 120 green, 240 blue
    double tolerance = 40.0;  ///< degrees to either side, 5 to 85
};

struct Spot {
    double u = 0.0, v = 0.0;  ///< its middle, px
    double mass = 0.0;  ///< sum of weights / 255: px of full colour
    int    area = 0;  ///< px beyond the threshold
    int    left = 0, top = 0, right = 0, bottom = 0;  ///< first and last px
    double foot_u = 0.0, foot_v = 0.0;  ///< where it ends below: the middle of its last rows, and the row where its width falls to half
};

/// Weights of a colour frame; a grey one has none. [any] takes memory
void weigh(const Frame& frame, Hue hue, std::vector<std::uint8_t>& weights);

/// Connected spots of at least `least_area` px beyond `threshold`, heaviest first, at most `most`. [any] takes memory
std::vector<Spot> find_spots(const std::vector<std::uint8_t>& weights, int width, int height, int threshold, int least_area,
                             std::size_t most);

}  // namespace hal::vision
