// SPDX-License-Identifier: MIT
// Finds coloured spots in a picture and their centres with sub-pixel resolution.
#pragma once

#include <cstdint>
#include <vector>

#include "vision/capture/frame.hpp"

namespace hal::vision {

/// Weight of a colour in a pixel, 0 to 255. With the hue h and the pixel's chroma as a vector
/// (along, across) seen from h, it is
///     along - |across| / tan(tolerance)
/// which is linear in the fraction of the pixel that the colour covers (on grey) and in the
/// brightness: a weighted centre depends on neither.
struct Hue {
    double degrees = 0.0;  ///< 0 red, 120 green, 240 blue
    double tolerance = 40.0;  ///< degrees to either side, 5 to 85
};

struct Spot {
    double u = 0.0;
    double v = 0.0;  ///< centre, px
    double mass = 0.0;  ///< sum of weights / 255: equivalent px of full colour
    int area = 0;  ///< px above the threshold
    int left = 0;
    int top = 0;
    int right = 0;
    int bottom = 0;  ///< first and last px
    /// lower end: the centre of its last rows, and the row where its width falls to half
    double foot_u = 0.0;
    double foot_v = 0.0;
};

/// Computes the weights of a colour frame; those of a grey frame are 0. [any] allocates memory
void weigh(const Frame& frame, Hue hue, std::vector<std::uint8_t>& weights);

/// Returns at most `max` connected spots of at least `min_area` px above `threshold`, the
/// heaviest first. [any] allocates memory
std::vector<Spot> find_spots(const std::vector<std::uint8_t>& weights, int width, int height,
                             int threshold, int min_area, std::size_t max);

}  // namespace hal::vision
