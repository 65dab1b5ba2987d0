// SPDX-License-Identifier: MIT
// Both angles of a Furuta pendulum from a picture of it: a red ball at the pendulum's pivot, a green one at its end.
#pragma once

#include "vision/detect/spots.hpp"

namespace hal::vision {

/// Where the camera stands and what it looks at. Lengths in m.
struct PendulumView {
    double focal_u = 280.0, focal_v = 280.0;    ///< px
    double middle_u = 159.5, middle_v = 119.5;  ///< where the camera's axis meets the picture, px
    double distance = 1.2;                      ///< from the motor's axis
    double height = 0.3;                        ///< above the arm; the camera looks at the axis at the arm's height
    double arm_length = 0.2, rod_length = 0.3;  ///< from the axis to the pivot's ball, from there to the other
};

struct PendulumLimits {
    Hue    pivot{0.0, 40.0}, tip{120.0, 40.0};
    int    threshold = 30;      ///< of a ball's colour, of 255
    int    least_area = 12;     ///< px of a ball
    double most_residual = 1.5; ///< px
    double most_sigma = 0.005;  ///< rad
};

struct PendulumSeen {
    bool   found = false;
    double arm = 0.0, pendulum = 0.0;  ///< rad; the arm's 0 points at the camera, the pendulum hangs at 0, -pi to pi
    double residual = 0.0;             ///< how far the balls are from where these angles put them, rms px
    double rival = 0.0;                ///< the same of the next best angles that are others
    double sigma = 0.0;                ///< standard deviation of the worse of the angles if that of a ball's middle is 0.05 px
    Spot   pivot_ball, tip_ball;
};

/// Two angles from two middles: from the valleys of a grid, P. Gauss's and I. Newton's steps on
///     sum |middle - seen(arm, pendulum)|²
/// `found` when both balls are there and fit, no other angles fit as well (an arm across the camera's axis, where a pendulum that swings
/// to the camera and one that swings away look the same), and they follow well from the middles. [any] takes memory
PendulumSeen find_pendulum(const Frame& frame, const PendulumView& view, const PendulumLimits& limits);

/// The angles that put the balls where they are; false: no such angles. [any]
bool fit_pendulum(const PendulumView& view, double pivot_u, double pivot_v, double tip_u, double tip_v, PendulumSeen& seen);

}  // namespace hal::vision
