// SPDX-License-Identifier: MIT
// Maps a pixel to the point of a plane that is visible there.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vision/capture/camera.hpp"

namespace hal::vision {

/// A point of the plane and the pixel that shows it.
struct GroundPoint {
    double u = 0;
    double v = 0;
    double x = 0;
    double y = 0;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;  ///< bytes of the text
};

struct GroundText {
    std::vector<GroundPoint> points;
    std::vector<CameraProblem> problems;
};

/// Parses rows of four numbers, u v x y. A row ends with the line or at `;`; a space, comma or
/// colon separates numbers; `#` begins a comment. 4..1000 rows. [setup]
GroundText read_ground(std::string_view text);

/// A homography (R. Hartley and A. Zisserman, Multiple View Geometry, 2nd edition, 4.1): w (x, y,
/// 1) = H (u', v', 1), where u', v' is the undistorted pixel.
class Ground {
public:
    /// Computes the best fit. Collinear or coinciding points are problems, which are added to
    /// `text`; then the result is invalid. [setup]
    Ground(GroundText& text, const std::optional<Camera>& camera);
    Ground() = default;

    /// Maps a pixel to a position on the plane. Returns false, leaving `x` and `y` unchanged, if
    /// the pixel is NaN, or at or above the horizon. [realtime]
    bool map(double u, double v, double& x, double& y) const noexcept;
    /// Returns the root mean square error of the points, in their unit.
    double error() const { return error_; }

private:
    void fit(GroundText& text, const std::optional<Camera>& camera);
    void undistort(double& u, double& v) const noexcept;
    std::array<double, 9> h_{1, 0, 0, 0, 1, 0, 0, 0, 1};
    Camera camera_;
    bool distorted_ = false;
    // w of pixels closer to the horizon than that is taken for 0
    double error_ = 0;
    double min_w_ = 0;
};

}  // namespace hal::vision
