// SPDX-License-Identifier: MIT
// A position from the bearings of three beacons (V. Pierlot, M. Van Droogenbroeck, *A new three
// object triangulation algorithm for mobile robot positioning*, IEEE Transactions on Robotics 30,
// 2014: "ToTal"). With coordinates relative to beacon 2, marked ':
//
//     T12 = cot(a2 - a1),  T23 = cot(a3 - a2),  T31 = (1 - T12 T23) / (T12 + T23)
//     x12 = x1' + T12 y1',  y12 = y1' - T12 x1'      centre of the circle through robot, beacons 1 and 2, doubled
//     x23 = x3' - T23 y3',  y23 = y3' + T23 x3'      2 and 3
//     x31 = x3' + x1' + T31 (y3' - y1'),  y31 = y3' + y1' - T31 (x3' - x1')
//     k   = x1' x3' + y1' y3' + T31 (x1' y3' - x3' y1')
//     D   = (x12 - x23) (y23 - y31) - (y12 - y23) (x23 - x31)
//     x   = x2 + k (y12 - y23) / D,  y = y2 + k (x23 - x12) / D
//
// Where D is 0 the three circles are the same: the robot is on the circle through the beacons, or
// the beacons are collinear with it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hal::mobile {

struct Place {
    double x, y;
};
struct Fix {
    double x = 0.0;
    double y = 0.0;
    double heading = 0.0;
    double d = 0.0;  ///< |D|, m^2: the error of the position grows with its inverse
    bool valid = false;
};

inline double wrapped(double angle) noexcept { return std::remainder(angle, 2 * std::numbers::pi); }

/// Adds the mean of the three headings that the bearings give at this position. The fix is valid if
/// they agree within 0.1 rad.
inline void add_heading(Fix& fix, const std::array<Place, 3>& beacons,
                        const std::array<double, 3>& bearings) noexcept {
    double cosines = 0.0;
    double sines = 0.0;
    double first = 0.0;
    bool agree = true;
    for (std::size_t i = 0; i < beacons.size(); ++i) {
        const double direction = std::atan2(beacons[i].y - fix.y, beacons[i].x - fix.x);
        const double heading = direction - bearings[i];
        if (i == 0) {
            first = heading;
        }
        agree = agree && std::fabs(wrapped(heading - first)) < 0.1;
        cosines += std::cos(heading);
        sines += std::sin(heading);
    }
    fix.heading = std::atan2(sines, cosines);
    fix.valid = agree;
}

/// Returns the pose from which the beacons have these bearings, relative to the heading, rad.
/// Invalid where |D| is below `min_d`, or where the bearings contradict each other by more than
/// 0.1 rad. [any]
inline Fix triangulate(const std::array<Place, 3>& beacons, const std::array<double, 3>& bearings,
                       double min_d) noexcept {
    // An angle of 0 or pi between two beacons has no cotangent; its largest useful value places the
    // centre far away.
    const auto cot = [](double angle) { return std::clamp(1.0 / std::tan(angle), -1e8, 1e8); };
    const auto [b1, b2, b3] = beacons;
    const double x1 = b1.x - b2.x;
    const double y1 = b1.y - b2.y;
    const double x3 = b3.x - b2.x;
    const double y3 = b3.y - b2.y;
    const double t12 = cot(bearings[1] - bearings[0]);
    const double t23 = cot(bearings[2] - bearings[1]);
    const double sum = t12 + t23;

    const double t31 = std::clamp((1.0 - t12 * t23) / (sum != 0.0 ? sum : 1e-12), -1e8, 1e8);
    const double x12 = x1 + t12 * y1;
    const double y12 = y1 - t12 * x1;
    const double x23 = x3 - t23 * y3;
    const double y23 = y3 + t23 * x3;
    const double x31 = x3 + x1 + t31 * (y3 - y1);
    const double y31 = y3 + y1 - t31 * (x3 - x1);
    const double k = x1 * x3 + y1 * y3 + t31 * (x1 * y3 - x3 * y1);
    const double d = (x12 - x23) * (y23 - y31) - (y12 - y23) * (x23 - x31);
    Fix fix;
    fix.d = std::fabs(d);
    if (!(fix.d >= min_d && fix.d > 0.0)) return fix;
    fix.x = b2.x + k * (y12 - y23) / d;
    fix.y = b2.y + k * (x23 - x12) / d;
    if (!std::isfinite(fix.x + fix.y)) return fix;
    add_heading(fix, beacons, bearings);
    return fix;
}

}  // namespace hal::mobile
