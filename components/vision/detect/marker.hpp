// SPDX-License-Identifier: MIT
// Finds square markers in a frame and their poses relative to the camera.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vision/capture/camera.hpp"
#include "vision/capture/frame.hpp"

namespace hal::vision {

/// A pose in the camera's frame: x right, y down, z ahead. Angles of R = Rz(yaw) Ry(pitch)
/// Rx(roll), from the marker's axes (x right, y up, z out of its face) to the camera's.
struct Pose {
    double x_mm = 0;
    double y_mm = 0;
    double z_mm = 0;
    double roll_deg = 0;
    double pitch_deg = 0;
    double yaw_deg = 0;
};

struct Marker {
    int id = -1;
    /// px, clockwise from the marker's top left corner
    std::array<std::array<double, 2>, 4> corners{};
    Pose pose;
    /// reprojection error of the corners, root mean square
    double error_px = 0;
    /// 0: only this pose fits; 1: its mirror image about the line of sight fits as well
    double ambiguity = 0;
};

/// Finds markers of one ArUco dictionary (S. Garrido-Jurado et al., 2014) with OpenCV, and their
/// poses from the plane homography (T. Collins and A. Bartoli, 2014), refined by least squares. A
/// small or distant square fits two poses nearly equally well: the detector follows both from frame
/// to frame and returns the one with the smaller error over the last frames.
class MarkerDetector {
public:
    /// `dictionary`: "4x4_50" ... "7x7_1000". Throws std::invalid_argument with the list of names.
    /// [setup]
    MarkerDetector(const std::string& dictionary, std::optional<Camera> camera);
    ~MarkerDetector();

    /// Returns the markers with this ID (`id` < 0: all), ordered by ID; with poses for a side of
    /// `size_mm` if the camera is calibrated. Throws std::exception. [one thread at a time]
    std::vector<Marker> find(const Frame& frame, int id, double size_mm);

    /// Returns the number of markers in the dictionary.
    int count() const;

private:
    struct Inside;
    std::unique_ptr<Inside> inside_;
};

}  // namespace hal::vision
