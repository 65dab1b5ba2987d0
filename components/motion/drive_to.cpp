// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"

namespace {

struct DriveTo : hal::Component {
    using Component::Component;

    hal::In<bool>   enable{*this, "enable", "FALSE commands standstill", {.initial = true}};
    hal::In<double> target_x{*this, "target-x", "x of the target", {.unit = "m"}};
    hal::In<double> target_y{*this, "target-y", "y of the target", {.unit = "m"}};
    hal::In<double> x{*this, "x", "x of the robot", {.unit = "m"}};
    hal::In<double> y{*this, "y", "y of the robot", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "heading of the robot: 0 along x, positive to the left", {.unit = "rad"}};

    hal::Param<double> distance_gain{*this, "distance-gain", "forward speed per remaining distance", {.initial = 1.5, .unit = "1/s"}};
    hal::Param<double> heading_gain{*this, "heading-gain", "turning speed per remaining angle", {.initial = 4.0, .unit = "1/s"}};
    hal::Param<double> max_speed{*this, "max-speed", "maximum forward speed", {.initial = 0.5, .unit = "m/s"}};
    hal::Param<double> tolerance{*this,
                                 "tolerance",
                                 "distance within which the target is reached; beyond twice this distance the robot starts again",
                                 {.initial = 0.01, .unit = "m"}};

    hal::Out<double> linear{*this, "linear", "requested forward speed", {.unit = "m/s", .safe = 0.0, .finite = true}};
    hal::Out<double> angular{*this, "angular", "requested turning speed, positive to the left", {.unit = "rad/s", .safe = 0.0, .finite = true}};
    hal::Out<double> distance{*this, "distance", "remaining distance", {.unit = "m", .finite = true}};
    hal::Out<bool>   reached{*this, "reached", "TRUE at the target"};
    hal::Out<bool>   invalid{*this, "invalid", "TRUE: an input is NaN, infinite or beyond 1e9 m; standstill is commanded"};

    hal::Function run{*this, "", &DriveTo::update, "computes the requested speeds from target and pose"};

    void update(hal::Cycle) noexcept {
        const double dx = target_x - x, dy = target_y - y, left = std::hypot(dx, dy), within = std::fabs(tolerance);
        invalid = !(left < 1e9 && std::fabs(heading) < 1e9 && std::isfinite(within));
        if (invalid) return stand(0.0, false);
        const bool there = left <= (reached ? 2 * within : within);
        if (there || !enable) return stand(left, there);
        const double error = std::remainder(std::atan2(dy, dx) - heading, 2 * std::numbers::pi);
        // Turn first; the forward speed rises as the heading error falls.
        const double ahead = std::max(0.0, std::cos(error));
        const double fastest = std::isfinite(max_speed) ? std::fabs(max_speed) : 0.0;
        linear = finite(std::clamp(distance_gain * left, -fastest, fastest) * ahead * ahead);
        angular = finite(heading_gain * error);
        distance = left;
        reached = false;
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }
    void          stand(double left, bool there) noexcept {
        linear = 0.0;
        angular = 0.0;
        distance = left;
        reached = there;
    }
};

}  // namespace

HAL_COMPONENT(DriveTo, "drive_to", "Drives a two-wheeled robot to a point", R"(
Computes the speeds for `diff_drive` from its pose and a target: the robot turns towards the target, drives faster as the heading error
falls, and stops within `tolerance`. The target may move.

    loadrt drive_to names=pilot
    loadrt diff_drive names=base
    addf base.odometry servo
    addf pilot servo
    addf base.command servo
    net x       base.x       => pilot.x
    net y       base.y       => pilot.y
    net heading base.heading => pilot.heading
    net ahead   pilot.linear  => base.linear
    net turn    pilot.angular => base.angular
)")
