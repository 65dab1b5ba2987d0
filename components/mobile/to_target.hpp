// SPDX-License-Identifier: MIT
// What the components that drive a robot to a point share: target and pose in, speeds out, and when
// it has arrived.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace hal::mobile {

struct Tolerance {
    double initial_m;
    const char* doc;
};

class ToTarget {
public:
    ToTarget(hal::Component& component, const Tolerance& tolerance_)
        : c(component), t(tolerance_) {}

    hal::Component& c;
    const Tolerance t;
    hal::In<bool> enable{c, "enable", "FALSE commands standstill", {.initial = true}};
    hal::In<double> target_x{c, "target-x", "x of the target", {.unit = "m"}};
    hal::In<double> target_y{c, "target-y", "y of the target", {.unit = "m"}};
    hal::In<double> x{c, "x", "x of the robot", {.unit = "m"}};
    hal::In<double> y{c, "y", "y of the robot", {.unit = "m"}};
    hal::In<double> heading{
        c, "heading", "heading of the robot: 0 along x, positive to the left", {.unit = "rad"}};

    hal::Param<double> distance_gain{c,
                                     "distance-gain",
                                     "forward speed per remaining distance",
                                     {.initial = 1.5, .unit = "1/s"}};
    hal::LimitParam max_speed{
        c, "max-speed", "maximum forward speed", {.initial = 0.5, .unit = "m/s"}};
    hal::Param<double> tolerance{c, "tolerance", t.doc, {.initial = t.initial_m, .unit = "m"}};

    hal::Out<double> linear{
        c, "linear", "requested forward speed", {.unit = "m/s", .safe = 0.0, .finite = true}};
    hal::Out<double> angular{c,
                             "angular",
                             "requested turning speed, positive to the left",
                             {.unit = "rad/s", .safe = 0.0, .finite = true}};
    hal::Out<double> distance{c, "distance", "remaining distance", {.unit = "m", .finite = true}};
    hal::Out<bool> reached{c, "reached", "TRUE at the target"};
    hal::Out<bool> invalid{
        c, "invalid", "TRUE: an input is NaN, infinite or beyond 1e6 m; standstill is commanded"};

    /// Returns false, with standstill commanded, when target, pose or tolerance are not usable.
    /// [realtime]
    bool valid() noexcept {
        left_ = std::hypot(target_x - x, target_y - y);
        invalid = !(left_ < 1e6 && std::fabs(heading) < 1e6 && std::isfinite(tolerance));
        if (invalid) {
            left_ = 0.0;
            rest(false);
        }
        return !invalid;
    }
    /// Returns false, with standstill commanded, at the target or without `enable`. A robot that
    /// has arrived starts again beyond `leave` times the tolerance. Needs valid(). [realtime]
    bool under_way(double leave) noexcept {
        const double within = std::fabs(tolerance);
        const bool there = left_ <= (reached ? leave * within : within);
        if (there || !enable) {
            rest(there);
            return false;
        }
        distance = left_;
        reached = false;
        return true;
    }
    double left() const noexcept { return left_; }  ///< remaining distance, m
    /// Returns the direction of the target, relative to the heading, -pi..pi. [realtime]
    double wanted() const noexcept {
        return std::remainder(std::atan2(target_y - y, target_x - x) - heading,
                              2 * std::numbers::pi);
    }
    /// Returns the forward speed that the remaining distance allows, when the robot turns first: it
    /// falls with the angle to its direction. [realtime]
    double speed(double angle) const noexcept {
        const double ahead = std::fmax(0.0, std::cos(angle));

        const double fastest = std::isfinite(max_speed) ? std::fabs(max_speed) : 0.0;
        return std::clamp(distance_gain * left_, -fastest, fastest) * ahead * ahead;
    }
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }

private:
    void rest(bool there) noexcept {
        linear = 0.0;
        angular = 0.0;
        distance = left_;
        reached = there;
    }
    double left_ = 0.0;
};

}  // namespace hal::mobile
