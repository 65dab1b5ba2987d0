// SPDX-License-Identifier: MIT
// Square markers in a frame, and where they stand before the camera.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vision/capture/camera.hpp"
#include "vision/capture/frame.hpp"

namespace hal::vision {

/// A pose in the camera's frame: x right, y down, z ahead. Angles of R = Rz(yaw) Ry(pitch) Rx(roll), from the marker's axes (x right, y
/// up, z out of its face) to the camera's.
struct Pose {
    double x_mm = 0, y_mm = 0, z_mm = 0;
    double roll_deg = 0, pitch_deg = 0, yaw_deg = 0;
};

struct Marker {
    int                                  id = -1;
    std::array<std::array<double, 2>, 4> corners{};  ///< px, from its top left one on in the sense of the clock
    Pose                                 pose;
    double                               error_px = 0;   ///< distance of the pose's corners from those seen, root mean square
    double ambiguity = 0;  ///< 0: only this pose fits; 1: its mirror image about the line of sight fits as well
};

/// Finds markers of one ArUco dictionary (S. Garrido-Jurado et al., 2014) by OpenCV, and their poses as those of planes (T. Collins and
/// A. Bartoli, 2014), refined by least squares. A small or distant square fits two poses nearly equally well: both are followed from frame
/// to frame, and the one with the smaller error over the last frames is returned.
class MarkerDetector {
public:
    /// `dictionary`: "4x4_50" ... "7x7_1000". Throws std::invalid_argument with the list of names. [setup]
    MarkerDetector(const std::string& dictionary, std::optional<Camera> camera);
    ~MarkerDetector();

    /// Those with an id that is wanted (`id` < 0: all), in order of id; poses for a side of `size_mm`, where there is a camera. Throws
    /// std::exception. [one thread at a time]
    std::vector<Marker> find(const Frame& frame, int id, double size_mm);

    /// How many markers the dictionary has.
    int count() const;

private:
    struct Inside;
    std::unique_ptr<Inside> inside_;
};

}  // namespace hal::vision
