// SPDX-License-Identifier: MIT
// Measures both angles of a Furuta pendulum in a picture: a red ball marks the pendulum's pivot, a
// green ball its end.
#pragma once

#include "vision/detect/spots.hpp"

namespace hal::vision {

/// Position of the camera and dimensions of the pendulum. Lengths in m.
struct PendulumView {
    double focal_u = 280.0;
    double focal_v = 280.0;    ///< px
    double middle_u = 159.5;
    double middle_v = 119.5;  ///< principal point, px
    double distance = 1.2;                      ///< from the motor's axis
    /// above the arm; the camera looks at the axis at the arm's height
    double height = 0.3;
    /// from the axis to the pivot's ball, and from there to the end's ball
    double arm_length = 0.2;
    double rod_length = 0.3;
};

struct PendulumLimits {
    Hue pivot{0.0, 40.0};
    Hue tip{120.0, 40.0};
    int threshold = 30;      ///< minimum weight of a ball's colour, of 255
    int min_area = 12;     ///< minimum area of a ball, px
    double max_residual = 1.5; ///< px
    double max_sigma = 0.005;  ///< rad
};

struct PendulumSeen {
    bool found = false;
    /// rad, -pi to pi; the arm points at the camera at 0, the pendulum hangs at 0
    double arm = 0.0;
    double pendulum = 0.0;
    /// distance of the balls from their positions for these angles, rms px
    double residual = 0.0;
    double rival = 0.0;                ///< the residual of the second-best solution
    /// larger standard deviation of the two angles, if that of a ball's centre is 0.05 px
    double sigma = 0.0;
    Spot pivot_ball, tip_ball;
};

/// Computes the two angles from the centres of the two balls, by Gauss-Newton iteration from the
/// minima of a grid on
///     sum |centre - projection(arm, pendulum)|²
/// Sets `found` if both balls are detected, the residual is within its limit, the solution is
/// unique (it is not when the arm is across the camera's axis: a pendulum that swings towards the
/// camera looks like one that swings away) and sigma is within its limit. [any] allocates memory
PendulumSeen find_pendulum(const Frame& frame, const PendulumView& view,
                           const PendulumLimits& limits);

/// Computes the angles from the positions of the balls, px. Returns false if no angles fit. [any]
bool fit_pendulum(const PendulumView& view, double pivot_u, double pivot_v, double tip_u,
                  double tip_v, PendulumSeen& seen);

}  // namespace hal::vision
