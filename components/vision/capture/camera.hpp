// SPDX-License-Identifier: MIT
// A camera's calibration: the pinhole model with distortion, and the file it is read from.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::vision {

/// Pinhole and lens: u = fx x' + cx, v = fy y' + cy, with x', y' distorted by k1 k2 p1 p2 k3 (D.
/// Brown, 1966; the order of OpenCV).
struct Camera {
    int width = 0;
    int height = 0;  ///< of its frames
    /// px; the centre of the top left pixel is (0, 0)
    double fx = 0;
    double fy = 0;
    double cx = 0;
    double cy = 0;
    std::array<double, 5> distortion{};
    std::string file;  ///< it was read from
};

using CameraProblem = text::Problem;

struct CameraText {
    Camera camera;
    std::vector<CameraProblem> problems;
};

/// Reads either of two kinds. An own one:
///     size 640 480
///     focal 600 600
///     centre 319.5 239.5
///     distortion 0 0 0 0 0          # k1 k2 p1 p2 k3; may be left out
/// or the YAML that OpenCV's and ROS's calibration write (yaml-cpp reads it): image_width,
/// image_height, camera_matrix, distortion_coefficients. The time is bounded for any text. [setup]
CameraText read_camera(std::string_view text);

}  // namespace hal::vision
