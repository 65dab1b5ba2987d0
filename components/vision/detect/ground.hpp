// SPDX-License-Identifier: MIT
// The ground in front of a camera on a mast.
#pragma once

#include "vision/detect/homography.hpp"

namespace hal::vision {

/// Mounting of a camera that looks forward and down, without roll.
struct Mast {
    double focal = 280.0;    ///< px
    double height = 0.3;     ///< above the ground, m
    double pitch = 0.6;      ///< downward tilt, rad; above 0
    double forward = 0.0;    ///< distance in front of the robot's centre, m
};

/// Returns the ground for frames of this size, px: positions in mm from the robot's centre, x
/// forward and y to the left. [setup]
Ground ground_before(const Mast& mast, int width, int height);

/// Calls Ground::map() and converts the position to m. [any]
inline bool place(const Ground& ground, double u, double v, double& x, double& y) noexcept {
    if (!ground.map(u, v, x, y)) return false;
    x *= 1e-3;
    y *= 1e-3;
    return true;
}

}  // namespace hal::vision
