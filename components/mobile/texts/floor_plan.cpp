// SPDX-License-Identifier: MIT
#include "mobile/texts/floor_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mobile/texts/number_line.hpp"

namespace hal::mobile {

namespace {

constexpr double nowhere = std::numeric_limits<double>::infinity();

double distance_to(const Wall& w, double x, double y) noexcept {
    const double dx = w.x2 - w.x1;
    const double dy = w.y2 - w.y1;
    const double square = dx * dx + dy * dy;
    const double t =
        square > 0.0 ? std::clamp(((x - w.x1) * dx + (y - w.y1) * dy) / square, 0.0, 1.0) : 0.0;
    return std::hypot(x - (w.x1 + t * dx), y - (w.y1 + t * dy));
}

}  // namespace

void FloorPlan::read(std::string_view text) {
    for (text::Lines lines(text); const auto line = lines.next();) {
        const auto words = text::words_of(*line);
        const auto& key = words[0].text;
        const auto reject = [&](const std::string& sentence, const std::string& help) {
            text::add(problems, words[0].at.offset, words[0].at.offset + words[0].at.length,
                      sentence, help);
        };
        std::array<double, 4> n{};
        const bool is_wall = key == "wall";
        const bool is_box = key == "box";
        const bool is_circle = key == "circle";

        const bool is_beacon = key == "beacon";
        if (!is_wall && !is_box && !is_circle && !is_beacon) {
            reject("unknown key '" + key.substr(0, 60) + "'",
                   "a floor plan has lines wall, box, circle and beacon");
            continue;
        }
        const std::size_t count = is_wall || is_box ? 4 : 3;
        const std::string form =
            key + (count == 4 ? " X1 Y1 X2 Y2" : " X Y RADIUS") + ", in metres";
        if (!read_numbers(words, 1, std::span(n.data(), count), form, problems)) continue;
        if (count == 3 && !(n[2] > 0.0)) {
            text::add(problems, words[3].at.offset, words[3].at.offset + words[3].at.length,
                      "the radius is not above 0", "write " + form);
            continue;
        }
        if (walls.size() + discs.size() + beacons.size() + (is_box ? 4 : 1) > max_shapes) {
            reject("more than " + std::to_string(max_shapes) + " shapes",
                   "a box counts as four walls; leave something out");
            return;
        }
        if (is_wall) {
            walls.push_back({n[0], n[1], n[2], n[3]});
        }
        if (is_circle) {
            discs.push_back({n[0], n[1], n[2]});
        }
        if (is_beacon) {
            beacons.push_back({n[0], n[1], n[2]});
        }
        if (is_box) {
            const double x[] = {n[0], n[2], n[2], n[0], n[0]}, y[] = {n[1], n[1], n[3], n[3], n[1]};
            for (int i = 0; i < 4; ++i) {
                walls.push_back({x[i], y[i], x[i + 1], y[i + 1]});
            }
        }
    }
}

Hit FloorPlan::cast(double x, double y, double angle, double reach) const noexcept {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    Hit hit{reach, 0.0};
    bool any = false;
    for (const Wall& w : walls) {
        // (x, y) + t (c, s) = (x1, y1) + u (dx, dy)
        const double dx = w.x2 - w.x1;
        const double dy = w.y2 - w.y1;
        const double cross = c * dy - s * dx;
        if (std::fabs(cross) < 1e-12) continue;
        const double t = ((w.x1 - x) * dy - (w.y1 - y) * dx) / cross;

        const double u = ((w.x1 - x) * s - (w.y1 - y) * c) / cross;
        if (!(t >= 0.0 && t < hit.distance && u >= 0.0 && u <= 1.0)) continue;
        hit = {t, std::fabs(cross) / std::hypot(dx, dy)};
        any = true;
    }
    for (const Disc& d : discs) {
        const double along = (d.x - x) * c + (d.y - y) * s;
        const double aside = (d.x - x) * s - (d.y - y) * c;
        const double half = d.radius * d.radius - aside * aside;
        if (half < 0.0) continue;
        const double t = along - std::sqrt(half);
        if (!(t >= 0.0 && t < hit.distance)) continue;
        hit = {t, std::sqrt(half) / d.radius};
        any = true;
    }
    return any ? hit : Hit{nowhere, 0.0};
}

double FloorPlan::clearance(double x, double y) const noexcept {
    double min = nowhere;
    for (const Wall& w : walls) {
        min = std::fmin(min, distance_to(w, x, y));
    }
    for (const Disc& d : discs) {
        min = std::fmin(min, std::hypot(x - d.x, y - d.y) - d.radius);
    }
    return min;
}

}  // namespace hal::mobile
