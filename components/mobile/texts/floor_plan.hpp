// SPDX-License-Identifier: MIT
// A floor with walls and obstacles, for simulated robots and sensors. Lines of the file, in metres:
//
//     wall X1 Y1 X2 Y2
//     box X1 Y1 X2 Y2        two opposite corners
//     circle X Y RADIUS
//     beacon X Y RADIUS      a reflector for lasers; robots and other sensors do not meet it
#pragma once

#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::mobile {

struct Wall {
    double x1, y1, x2, y2;
};
struct Disc {
    double x, y, radius;
};

/// Where a ray meets something first.
struct Hit {
    double distance;  ///< m; infinite: nothing within reach
    double incidence;  ///< cosine of the angle between ray and normal of the surface, 0..1
};

class FloorPlan {
public:
    static constexpr std::size_t max_shapes = 256;

    std::vector<Wall> walls;
    std::vector<Disc> discs, beacons;
    std::vector<text::Problem> problems;  ///< of the file; empty: it was valid

    /// Reads the text of a file. [setup]
    void read(std::string_view text);
    /// Returns what a ray from (x, y) in direction `angle` meets within `reach` m. [realtime]
    Hit cast(double x, double y, double angle, double reach) const noexcept;
    /// Returns the distance from (x, y) to the nearest wall or obstacle, m; negative inside of a
    /// circle, infinite without any. [realtime]
    double clearance(double x, double y) const noexcept;
};

}  // namespace hal::mobile
