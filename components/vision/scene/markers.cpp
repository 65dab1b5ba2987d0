// SPDX-License-Identifier: MIT
// ArUco markers in space. The patterns are OpenCV's, the picture is not: each pixel looks through
// sixteen points at the marker's plane.
#include <optional>
#include <vector>

#include <opencv2/aruco.hpp>

#include "vision/scene/render.hpp"

namespace hal::vision::scene {

namespace {

constexpr int cells = 6;  // of a marker of 4x4 with its black rim

cv::Mat pattern_of(int id) {
    cv::Mat pattern;
    cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50), id, cells,
                          pattern, 1);
    return pattern;
}

/// Yaw after pitch after roll, about the camera's axes z, y, x.
cv::Matx33d turned(double roll, double pitch, double yaw) {
    const cv::Matx33d x(1, 0, 0, 0, std::cos(roll), -std::sin(roll), 0, std::sin(roll),
                        std::cos(roll));
    const cv::Matx33d y(std::cos(pitch), 0, std::sin(pitch), 0, 1, 0, -std::sin(pitch), 0,
                        std::cos(pitch));
    const cv::Matx33d z(std::cos(yaw), -std::sin(yaw), 0, std::sin(yaw), std::cos(yaw), 0, 0, 0, 1);
    return z * y * x;
}

/// A marker in the space of the camera.
struct Placed {
    int id;
    double size;
    cv::Vec3d middle;
    cv::Matx33d turn;  ///< from the marker's axes to the camera's
};

constexpr double half = 0.5 + 1.0 / cells;  // of a marker with a white cell around it, in sizes

/// Returns the markers of the dictionary that the state places, the farthest first.
std::vector<Placed> placed_markers(const Settings& settings, const State& state) {
    std::vector<Placed> placed;
    for (std::size_t i = 0; i < static_cast<std::size_t>(settings.markers); ++i) {
        const std::size_t from = at::markers + at::of_marker * i;
        const double id = std::round(state[from]);
        const double size = state[from + 1];
        if (id >= 0.0 && id < 50.0 && size > 0.0) {
            placed.push_back({static_cast<int>(id),
                              size,
                              {state[from + 2], state[from + 3], state[from + 4]},
                              turned(state[from + 5], state[from + 6], state[from + 7])});
        }
    }
    std::sort(placed.begin(), placed.end(),
              [](const Placed& a, const Placed& b) { return a.middle[2] > b.middle[2]; });
    return placed;
}

/// A rectangle of the picture, in pixels.
struct Box {
    double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
};

/// Returns the box around a marker with a pixel of margin; nothing when a part of the marker is
/// behind the camera. `centre`: where the camera's axis meets the picture.
std::optional<Box> box_around(const Placed& marker, double focal, const cv::Vec2d& centre) {
    Box box;
    for (int corner = 0; corner < 4; ++corner) {
        const cv::Vec3d on_marker((corner & 1 ? half : -half) * marker.size,
                                  (corner & 2 ? half : -half) * marker.size, 0.0);
        const cv::Vec3d p = marker.turn * on_marker + marker.middle;
        if (!(p[2] > 0.01)) return std::nullopt;
        const double u = centre[0] + focal * p[0] / p[2];
        const double v = centre[1] + focal * p[1] / p[2];
        box.left = std::min(box.left, u - 1.0);
        box.right = std::max(box.right, u + 1.0);
        box.top = std::min(box.top, v - 1.0);
        box.bottom = std::max(box.bottom, v + 1.0);
    }
    return box;
}

/// Returns the matrix from a pixel to the marker's plane, in sizes: the inverse of its homography.
cv::Matx33d pixel_to_plane(const Placed& marker, double focal, const cv::Vec2d& centre) {
    const cv::Matx33d to_picture(focal, 0, centre[0], 0, focal, centre[1], 0, 0, 1);
    const cv::Matx33d plane(marker.turn(0, 0), marker.turn(0, 1), marker.middle[0],
                            marker.turn(1, 0), marker.turn(1, 1), marker.middle[1],
                            marker.turn(2, 0), marker.turn(2, 1), marker.middle[2]);
    const cv::Matx33d back = (to_picture * plane).inv();
    return cv::Matx33d::diag({1.0 / marker.size, 1.0 / marker.size, 1.0}) * back;
}

/// Colours a pixel by sixteen points in it. Returns the share of them that is on the marker.
double shade_pixel(double u, double v, const cv::Matx33d& to_plane, const cv::Mat& pattern,
                   Colour& colour) {
    int hits = 0;
    int white = 0;
    for (int n = 0; n < 16; ++n) {
        const cv::Vec3d p =
            to_plane * cv::Vec3d(u - 0.375 + 0.25 * (n % 4), v - 0.375 + 0.25 * (n / 4), 1.0);
        const double x = p[0] / p[2];
        const double y = p[1] / p[2];
        if (std::fabs(x) > half || std::fabs(y) > half) continue;
        // the pattern's rows go down as the marker's y goes up
        const int column = static_cast<int>(std::floor((x + 0.5) * cells));
        const int row = static_cast<int>(std::floor((0.5 - y) * cells));
        ++hits;
        white += column < 0 || column >= cells || row < 0 || row >= cells ||
                 pattern.at<std::uint8_t>(row, column) >= 128;
    }
    if (hits > 0) {
        colour.fill(static_cast<std::uint8_t>(12 + 238 * white / hits));
    }
    return hits / 16.0;
}

}  // namespace

void draw_markers(Canvas& canvas, const Settings& settings, const State& state) {
    canvas.background({170, 172, 176}, {190, 192, 196});
    const cv::Vec2d centre(0.5 * (settings.width - 1), 0.5 * (settings.height - 1));
    for (const Placed& marker : placed_markers(settings, state)) {
        const std::optional<Box> box = box_around(marker, settings.focal, centre);
        if (!box) continue;
        const cv::Mat pattern = pattern_of(marker.id);
        const cv::Matx33d to_plane = pixel_to_plane(marker, settings.focal, centre);
        canvas.shade(box->left, box->top, box->right, box->bottom,
                     [&](double u, double v, Colour& colour) {
            return shade_pixel(u, v, to_plane, pattern, colour);
        });
    }
}

}  // namespace hal::vision::scene
