// SPDX-License-Identifier: MIT
// A floor with a line, bottles and cans as a robot's camera sees it.
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "vision/scene/render.hpp"

namespace hal::vision::scene {

namespace {

/// A camera above the robot's middle that looks forward and down.
struct Lookout {
    explicit Lookout(const Settings& s)
        : middle{0.5 * (s.width - 1), 0.5 * (s.height - 1)},
          focal(s.focal),
          height(s.camera_height),
          cos(std::cos(s.pitch)),
          sin(std::sin(s.pitch)) {}
    /// x forward, y left, z up from below the camera. False: not in front of it.
    bool point(double x, double y, double z, Point& to) const noexcept {
        const double ahead = x * cos + (height - z) * sin;
        const double down = -x * sin + (height - z) * cos;
        to = {middle.u - focal * y / ahead, middle.v + focal * down / ahead};
        return ahead > 0.02;
    }
    /// Where a pixel looks at the floor. False: above the horizon.
    bool floor(double u, double v, double& x, double& y) const noexcept {
        const double right = (u - middle.u) / focal;
        const double down = (v - middle.v) / focal;

        const double fall = sin + down * cos;
        if (fall < 1e-3) return false;
        const double far = height / fall;
        x = far * (cos - down * sin);
        y = -far * right;
        return true;
    }

    Point middle;
    double focal, height, cos, sin;
};

struct Cylinder {
    double radius, height;
    Colour colour;
};
constexpr Cylinder bottle{0.030, 0.200, {50, 170, 40}};
constexpr Cylinder can{0.033, 0.115, {40, 30, 200}};

void draw_line(Canvas& canvas, const Lookout& camera, const State& state) {
    const double width = state[at::line_width];
    const double amplitude = state[at::line_amplitude];

    const double wave = 2.0 * std::numbers::pi / std::max(state[at::line_length], 0.01);
    const double robot_x = state[at::x];
    const double robot_y = state[at::y];
    const double cos = std::cos(state[at::heading]);

    const double sin = std::sin(state[at::heading]);
    const bool dark = state[at::line_dark] != 0.0;
    const double gap = state[at::line_gap];
    if (!(width > 0.0)) return;
    canvas.paint(0, 0, canvas.width(), canvas.height(),
                 dark ? Colour{40, 40, 40} : Colour{230, 230, 230}, [&](double u, double v) {
        double x = 0.0;
        double y = 0.0;
        double x1 = 0.0;
        double y1 = 0.0;
        double x2 = 0.0;
        double y2 = 0.0;
        if (!camera.floor(u, v, x, y)) return 0.0;
        const double world_x = robot_x + x * cos - y * sin;
        const double world_y = robot_y + x * sin + y * cos;
        double middle = 0.0;
        double slope = 0.0;
        if (amplitude != 0.0) {
            middle = amplitude * std::sin(wave * world_x);

            slope = amplitude * wave * std::cos(wave * world_x);
        }
        const double stretch = std::hypot(1.0, slope);
        const double off = (world_y - middle) / stretch;
        if (std::fabs(off) > 0.5 * width + 0.2 || !camera.floor(u + 1.0, v, x1, y1) ||
            !camera.floor(u, v + 1.0, x2, y2)) {
            return 0.0;
        }
        if (gap > 0.0 && world_x - 0.5 * std::floor(world_x * 2.0) < gap) return 0.0;
        // how far `off` goes in a pixel along u and along v
        const double across_x = (sin - slope * cos) / stretch;

        const double across_y = (slope * sin + cos) / stretch;
        const double by_u = across_x * (x1 - x) + across_y * (y1 - y);

        const double by_v = across_x * (x2 - x) + across_y * (y2 - y);
        const double pixel = std::max(std::hypot(by_u, by_v), 1e-6);
        return std::clamp((0.5 * width - std::fabs(off)) / pixel + 0.5, 0.0, 1.0);
    });
}

void draw_object(Canvas& canvas, const Lookout& camera, const Cylinder& of, double x, double y) {
    std::vector<cv::Point2f> rims;
    Point p;
    for (const double z : {0.0, of.height}) {
        for (int i = 0; i < 32; ++i) {
            const double turn = i * std::numbers::pi / 16.0;
            if (!camera.point(x + of.radius * std::cos(turn), y + of.radius * std::sin(turn), z,
                              p)) {
                return;
            }
            rims.emplace_back(static_cast<float>(p.u), static_cast<float>(p.v));
        }
    }
    std::vector<cv::Point2f> hull;
    cv::convexHull(rims, hull, false);  // its y goes up: clockwise as seen
    std::vector<Point> corners;
    for (const auto& h : hull) {
        corners.push_back({static_cast<double>(h.x), static_cast<double>(h.y)});
    }
    canvas.polygon(corners, of.colour);
}

}  // namespace

void draw_floor(Canvas& canvas, const Settings& settings, const State& state) {
    const Lookout camera(settings);
    const bool dark_line = state[at::line_dark] != 0.0;
    if (dark_line) {
        canvas.background({196, 200, 204}, {214, 218, 222});
    } else {
        canvas.background({40, 44, 48}, {54, 58, 62});
    }
    draw_line(canvas, camera, state);
    struct Standing {
        const Cylinder* what;
        double x, y;
    };
    std::vector<Standing> standing;
    const double cos = std::cos(state[at::heading]);
    const double sin = std::sin(state[at::heading]);
    for (std::size_t i = 0; i < static_cast<std::size_t>(settings.objects); ++i) {
        const std::size_t from = at::objects + at::of_object * i;
        const long kind = std::lround(std::clamp(state[from], 0.0, 2.0));
        const double dx = state[from + 1] - state[at::x];
        const double dy = state[from + 2] - state[at::y];
        if (kind != 0) {
            standing.push_back(
                {kind == 1 ? &bottle : &can, dx * cos + dy * sin, -dx * sin + dy * cos});
        }
    }
    // the farthest first: a nearer one hides it
    std::sort(standing.begin(), standing.end(), [](const Standing& a, const Standing& b) {
        return std::hypot(a.x, a.y) > std::hypot(b.x, b.y);
    });
    for (const Standing& s : standing) {
        draw_object(canvas, camera, *s.what, s.x, s.y);
    }
}

}  // namespace hal::vision::scene
