// SPDX-License-Identifier: MIT
// Measures a line on the floor: lateral offset, heading and curvature.
#pragma once

#include <vector>

#include "vision/capture/frame.hpp"
#include "vision/detect/ground.hpp"

namespace hal::vision {

struct LineRules {
    bool dark = true;          ///< darker than the floor; else lighter
    /// m; candidates narrower than half or wider than twice this width are rejected
    double width = 0.02;
    double ahead = 0.3;          ///< m: distance at which offset and heading are measured
    /// m: maximum distance; farther away a parabola does not describe the line
    double reach = 0.6;
    double contrast = 20.0;      ///< minimum difference from the floor, of 255
    double min_quality = 0.4;  ///< minimum fraction of the bands that agree
    int bands = 12;           ///< strips of the picture that are searched, 3..32
};

struct LinePoint {
    double u = 0.0;
    double v = 0.0;
    double x = 0.0;
    double y = 0.0;  ///< px, m
    int band = 0;
};

struct LineSeen {
    bool found = false;
    /// m to the left of the robot's centre, at the distance `ahead`
    double offset = 0.0;
    double heading = 0.0;    ///< rad to the left, at the distance `ahead`
    double curvature = 0.0;  ///< 1/m, positive: to the left
    double quality = 0.0;    ///< fraction of the bands that agree
    std::vector<LinePoint> points;           ///< of the bands that agree
};

/// Finds in each band the centres of segments that contrast with the floor and have the width of
/// the line, and fits the parabola
///     y = offset + slope (x - ahead) + bend (x - ahead)²
/// on which most bands agree (M. Fischler and R. Bolles, *Random sample consensus*, CACM 24, 1981,
/// with all triples instead of random ones), refined by least squares over those bands. [any]
/// allocates memory
LineSeen find_line(const Frame& frame, const Ground& ground, const LineRules& rules);

}  // namespace hal::vision
