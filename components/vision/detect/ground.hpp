// SPDX-License-Identifier: MIT
// The ground before a camera on a mast.
#pragma once

#include "vision/detect/homography.hpp"

namespace hal::vision {

/// How a camera stands: looking forward and down, not rolled.
struct Mast {
    double focal = 280.0;    ///< px
    double height = 0.3;     ///< above the ground, m
    double pitch = 0.6;      ///< how far it looks down, rad; above 0
    double forward = 0.0;    ///< in front of the robot's middle, m
};

/// The ground, in mm, x forward and y to the left of the robot's middle, in frames of this size. [setup]
Ground ground_before(const Mast& mast, int width, int height);

/// Ground::map() in m. [any]
inline bool place(const Ground& ground, double u, double v, double& x, double& y) noexcept {
    if (!ground.map(u, v, x, y)) return false;
    x *= 1e-3, y *= 1e-3;
    return true;
}

}  // namespace hal::vision
