// SPDX-License-Identifier: MIT
// From a pixel to the place on the ground that it shows.
#pragma once

#include <array>
#include <cmath>

namespace hal::vision {

/// A homography: (x, y, w) = h (u, v, 1), row by row, and the place is (x / w, y / w), m; x forward, y to the left.
struct Ground {
    std::array<double, 9> h{};

    bool operator==(const Ground&) const = default;
    /// False: the pixel shows no ground (above the horizon, or there is no homography). [any]
    bool place(double u, double v, double& x, double& y) const noexcept {
        const double w = h[6] * u + h[7] * v + h[8];
        if (!(w > 1e-9)) return false;
        x = (h[0] * u + h[1] * v + h[2]) / w, y = (h[3] * u + h[4] * v + h[5]) / w;
        return std::isfinite(x + y);
    }
    /// With a sign that makes w positive at the pixel (u, v), which is known to show ground: a homography has none of its own. [any]
    Ground signed_at(double u, double v) const noexcept {
        Ground to = *this;
        if (h[6] * u + h[7] * v + h[8] < 0.0)
            for (double& value : to.h) value = -value;
        return to;
    }
};

/// That of a camera `height` above the ground and `forward` of the robot's middle which looks forward and down by `pitch`, without roll. [any]
inline Ground mounted(double focal, double middle_u, double middle_v, double height, double pitch, double forward) noexcept {
    const double cos = std::cos(pitch), sin = std::sin(pitch);
    // w = sin + (v - mv) / f cos,  x w = height (cos - (v - mv) / f sin) + forward w,  y w = -height (u - mu) / f
    const double w_v = cos / focal, w_0 = sin - middle_v * cos / focal;
    return {{0.0, -height * sin / focal + forward * w_v, height * (cos + middle_v * sin / focal) + forward * w_0,  //
             -height / focal, 0.0, height * middle_u / focal,  //
             0.0, w_v, w_0}};
}

}  // namespace hal::vision
