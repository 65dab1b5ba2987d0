// SPDX-License-Identifier: MIT
// ArUco markers in space. The patterns are OpenCV's, the picture is not: each pixel looks through
// sixteen points at the marker's plane.
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

}  // namespace

void draw_markers(Canvas& canvas, const Settings& settings, const State& state) {
    canvas.background({170, 172, 176}, {190, 192, 196});
    struct Placed {
        int id;
        double size;
        cv::Vec3d middle;
        cv::Matx33d turn;
    };
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
    const double middle_u = 0.5 * (settings.width - 1);
    const double middle_v = 0.5 * (settings.height - 1);
    for (const Placed& marker : placed) {
        const cv::Mat pattern = pattern_of(marker.id);
        const double rim = 1.0 / cells;
        const double half = 0.5 + rim;  // a cell of white around it, in sizes
        double left = 1e9;
        double top = 1e9;
        double right = -1e9;
        double bottom = -1e9;
        bool whole = true;
        for (int corner = 0; corner < 4; ++corner) {
            const cv::Vec3d on((corner & 1 ? half : -half) * marker.size,
                               (corner & 2 ? half : -half) * marker.size, 0.0),
                p = marker.turn * on + marker.middle;
            whole = whole && p[2] > 0.01;
            const double u = middle_u + settings.focal * p[0] / p[2];

            const double v = middle_v + settings.focal * p[1] / p[2];
            left = std::min(left, u - 1.0);
            right = std::max(right, u + 1.0);

            top = std::min(top, v - 1.0);
            bottom = std::max(bottom, v + 1.0);
        }
        if (!whole) {
            continue;  // partly behind the camera
        }
        // from a pixel to the marker's plane: the inverse of its homography
        const cv::Matx33d to_picture(settings.focal, 0, middle_u, 0, settings.focal, middle_v, 0, 0,
                                     1);
        const cv::Matx33d plane(marker.turn(0, 0), marker.turn(0, 1), marker.middle[0],
                                marker.turn(1, 0), marker.turn(1, 1), marker.middle[1],
                                marker.turn(2, 0), marker.turn(2, 1), marker.middle[2]);
        const cv::Matx33d back = (to_picture * plane).inv();
        const cv::Matx33d step =
            cv::Matx33d::diag({1.0 / marker.size, 1.0 / marker.size, 1.0}) * back;
        canvas.shade(left, top, right, bottom, [&](double u, double v, Colour& colour) {
            int hits = 0;
            int white = 0;
            for (int n = 0; n < 16; ++n) {
                const cv::Vec3d p =
                    step * cv::Vec3d(u - 0.375 + 0.25 * (n % 4), v - 0.375 + 0.25 * (n / 4), 1.0);
                const double at_x = p[0] / p[2];
                const double at_y = p[1] / p[2];
                if (std::fabs(at_x) > half || std::fabs(at_y) > half) continue;
                // the pattern's rows go down as the marker's y goes up
                const int column = static_cast<int>(std::floor((at_x + 0.5) * cells));

                const int row = static_cast<int>(std::floor((0.5 - at_y) * cells));
                ++hits;
                white += column < 0 || column >= cells || row < 0 || row >= cells ||
                         pattern.at<std::uint8_t>(row, column) >= 128;
            }
            if (hits > 0) {
                colour.fill(static_cast<std::uint8_t>(12 + 238 * white / hits));
            }
            return hits / 16.0;
        });
    }
}

}  // namespace hal::vision::scene
