// SPDX-License-Identifier: MIT
// Detects coloured objects on the ground and their positions.
#pragma once

#include <span>
#include <vector>

#include "vision/detect/ground.hpp"
#include "vision/detect/spots.hpp"
#include "vision/detect/tracks.hpp"

namespace hal::vision {

/// A kind of object: an upright cylinder of one colour.
struct BlobKind {
    Hue hue;
    double radius = 0.033;  ///< m
    bool operator==(const BlobKind& o) const noexcept {
        return hue.degrees == o.hue.degrees && hue.tolerance == o.hue.tolerance &&
               radius == o.radius;
    }
};

struct BlobRules {
    int threshold = 40;     ///< minimum weight of the colour, of 255
    int min_area = 40;    ///< px
    double max_distance = 3;  ///< m: maximum distance of objects
};

/// Detects the objects of each kind; the axis of an object is `radius` behind its lower end. Skips
/// an object cut by the lower edge of the picture, because its position on the ground is not
/// visible. [any] allocates memory
std::vector<Sighting> find_blobs(const Frame& frame, const Ground& ground,
                                 std::span<const BlobKind> kinds, const BlobRules& rules);

}  // namespace hal::vision
