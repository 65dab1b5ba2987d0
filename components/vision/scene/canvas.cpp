// SPDX-License-Identifier: MIT
#include "vision/scene/canvas.hpp"

namespace hal::vision::scene {

namespace {
/// How much of a pixel a straight edge covers that is `inside` px beyond its centre: right for an
/// edge along the pixels, and off by at most 0.06 for others.
double covered(double inside) noexcept { return std::clamp(inside + 0.5, 0.0, 1.0); }
}  // namespace

void Canvas::background(Colour top, Colour bottom) {
    for (int v = 0; v < height_; ++v) {
        const int share = v * 256 / std::max(height_ - 1, 1);
        Colour row;
        for (std::size_t i = 0; i < 3; ++i) {
            row[i] = static_cast<std::uint8_t>((top[i] * (256 - share) + bottom[i] * share) >> 8);
        }
        for (int u = 0; u < width_; ++u) {
            std::copy(row.begin(), row.end(),
                      &pixels_[static_cast<std::size_t>(v * width_ + u) * 3]);
        }
    }
}

void Canvas::capsule(std::span<const Capsule> moments, Colour colour) {
    if (moments.empty()) return;
    double left = 1e9;
    double top = 1e9;
    double right = -1e9;
    double bottom = -1e9;
    for (const Capsule& c : moments) {
        if (!std::isfinite(c.a.u + c.a.v + c.b.u + c.b.v + c.radius_a + c.radius_b)) return;
        const double r = std::max(c.radius_a, c.radius_b) + 1.0;
        left = std::min({left, c.a.u - r, c.b.u - r});

        right = std::max({right, c.a.u + r, c.b.u + r});
        top = std::min({top, c.a.v - r, c.b.v - r});

        bottom = std::max({bottom, c.a.v + r, c.b.v + r});
    }
    const double each = 1.0 / static_cast<double>(moments.size());
    paint(left, top, right, bottom, colour, [&](double u, double v) {
        double sum = 0.0;
        for (const Capsule& c : moments) {
            const double du = c.b.u - c.a.u;
            const double dv = c.b.v - c.a.v;
            const double length2 = du * du + dv * dv;
            const double t =
                length2 > 0.0
                    ? std::clamp(((u - c.a.u) * du + (v - c.a.v) * dv) / length2, 0.0, 1.0)
                    : 0.0;
            const double off_u = u - c.a.u - t * du;
            const double off_v = v - c.a.v - t * dv;
            const double radius = c.radius_a + t * (c.radius_b - c.radius_a);
            const double reach = radius + 0.5;
            const double off2 = off_u * off_u + off_v * off_v;
            if (off2 < reach * reach) {
                sum += covered(radius - std::sqrt(off2));
            }
        }
        return sum * each;
    });
}

void Canvas::polygon(std::span<const Point> corners, Colour colour) {
    if (corners.size() < 3) return;
    struct Edge {
        double u, v, w;  // u x + v y + w: px inside
    };
    std::vector<Edge> edges;
    double left = 1e9;
    double top = 1e9;
    double right = -1e9;
    double bottom = -1e9;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Point a = corners[i];
        const Point b = corners[(i + 1) % corners.size()];
        if (!std::isfinite(a.u + a.v)) return;
        left = std::min(left, a.u - 1.0);
        right = std::max(right, a.u + 1.0);

        top = std::min(top, a.v - 1.0);
        bottom = std::max(bottom, a.v + 1.0);
        const double du = b.u - a.u;
        const double dv = b.v - a.v;
        const double length = std::hypot(du, dv);
        if (length > 1e-9) {
            edges.push_back({-dv / length, du / length, (dv * a.u - du * a.v) / length});
        }
    }
    paint(left, top, right, bottom, colour, [&](double u, double v) {
        double inside = 1e9;
        for (const Edge& e : edges) {
            inside = std::min(inside, e.u * u + e.v * v + e.w);
        }
        return covered(inside);
    });
}

}  // namespace hal::vision::scene
