// SPDX-License-Identifier: MIT
// A line on the floor: how far it is to the side, where it leads and how it bends.
#pragma once

#include <vector>

#include "vision/capture/frame.hpp"
#include "vision/detect/ground.hpp"

namespace hal::vision {

struct LineRules {
    bool   dark = true;          ///< darker than the floor; else lighter
    double width = 0.02;         ///< m; candidates narrower than half or wider than twice this width are rejected
    double ahead = 0.3;          ///< m: distance at which offset and heading are measured
    double reach = 0.6;          ///< m: maximum distance; farther away a parabola does not describe the line
    double contrast = 20.0;      ///< least difference from the floor, of 255
    double least_quality = 0.4;  ///< part of the bands that has to show it
    int    bands = 12;           ///< strips of the picture that are looked at, 3 to 32
};

struct LinePoint {
    double u = 0.0, v = 0.0, x = 0.0, y = 0.0;  ///< px, m
    int    band = 0;
};

struct LineSeen {
    bool                   found = false;
    double                 offset = 0.0;     ///< m to the left of the robot's middle, `ahead` of it
    double                 heading = 0.0;    ///< rad to the left, there
    double                 curvature = 0.0;  ///< 1/m, positive: to the left
    double                 quality = 0.0;    ///< part of the bands that agree
    std::vector<LinePoint> points;           ///< those that agree
};

/// In each band the middles of what stands out from the floor and is as wide as the line; through them the parabola
///     y = offset + slope (x - ahead) + bend (x - ahead)²
/// that most bands agree with (M. Fischler and R. Bolles, *Random sample consensus*, CACM 24, 1981, with all triples in place of random
/// ones), then least squares over those. [any] takes memory
LineSeen find_line(const Frame& frame, const Ground& ground, const LineRules& rules);

}  // namespace hal::vision
