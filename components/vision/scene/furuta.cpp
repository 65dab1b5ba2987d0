// SPDX-License-Identifier: MIT
// The Furuta pendulum as a camera in front of it sees it.
#include "vision/scene/render.hpp"

namespace hal::vision::scene {

namespace {

struct Place {
    // x to the camera, y to the right, z up; 0 is the motor's axis at the height of the arm
    double x, y, z;
};

/// A camera on the x axis's side that looks at the origin.
struct View {
    explicit View(const Settings& s)
        : middle{0.5 * (s.width - 1), 0.5 * (s.height - 1)},
          focal(s.focal),
          x(s.distance),
          z(s.camera_height),
          far(std::hypot(x, z)) {}
    double depth(Place p) const noexcept { return ((x - p.x) * x + (z - p.z) * z) / far; }
    Point point(Place p) const noexcept {
        const double down = (p.x * z - p.z * x) / far;
        const double d = std::max(depth(p), 0.01);
        return {middle.u + focal * p.y / d, middle.v + focal * down / d};
    }
    double size(double of, Place where) const noexcept {
        return focal * of / std::max(depth(where), 0.01);
    }
    Capsule rod(Place a, Place b, double radius) const noexcept {
        return {point(a), point(b), size(radius, a), size(radius, b)};
    }

    Point middle;
    double focal, x, z, far;
};

constexpr int moments = 5;

}  // namespace

void draw_furuta(Canvas& canvas, const Settings& settings, const State& from, const State& to) {
    constexpr double arm_length = 0.2;
    constexpr double rod_length = 0.3;
    constexpr double ball = 0.013;
    const View view(settings);
    canvas.background({200, 196, 190}, {150, 148, 146});

    std::array<Capsule, moments> arm, rod, pivot_ball, tip_ball;
    for (int i = 0; i < moments; ++i) {
        const double part = (static_cast<double>(i) + 0.5) / moments;
        const auto between = [&](std::size_t of) { return from[of] + part * (to[of] - from[of]); };
        const double q = between(at::arm);
        const double a = between(at::pendulum);
        // the arm turns about z; the pendulum swings in the plane across it, 0 hanging
        const Place pivot{arm_length * std::cos(q), arm_length * std::sin(q), 0.0};
        const Place tip{pivot.x - rod_length * std::sin(a) * std::sin(q),
                        pivot.y + rod_length * std::sin(a) * std::cos(q),
                        -rod_length * std::cos(a)};
        const auto n = static_cast<std::size_t>(i);
        arm[n] = view.rod({0.0, 0.0, 0.0}, pivot, 0.008);
        rod[n] = view.rod(pivot, tip, 0.004);
        pivot_ball[n] = view.rod(pivot, pivot, ball);
        tip_ball[n] = view.rod(tip, tip, ball);
    }
    const std::array<Capsule, 1> post{view.rod({0.0, 0.0, -0.03}, {0.0, 0.0, -0.4}, 0.03)};
    const auto stand = [&] { canvas.capsule(post, {70, 66, 62}); };
    const bool behind = std::cos(to[at::arm]) < 0.0;
    if (!behind) {
        stand();
    }
    canvas.capsule(arm, {110, 110, 112});
    canvas.capsule(rod, {90, 92, 95});
    canvas.capsule(tip_ball, {60, 200, 40});
    canvas.capsule(pivot_ball, {40, 30, 220});
    if (behind) {
        stand();
    }
}

}  // namespace hal::vision::scene
