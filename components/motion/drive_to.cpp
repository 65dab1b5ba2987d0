// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"

namespace {

struct DriveTo : hal::Component {
    using Component::Component;

    hal::In<bool>   enable{*this, "enable", "FALSE: the robot is asked to stand still", {.initial = true}};
    hal::In<double> target_x{*this, "target-x", "where to drive", {.unit = "m"}};
    hal::In<double> target_y{*this, "target-y", "where to drive", {.unit = "m"}};
    hal::In<double> x{*this, "x", "where the robot is", {.unit = "m"}};
    hal::In<double> y{*this, "y", "where the robot is", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "where it looks: 0 along x, growing to the left", {.unit = "rad"}};

    hal::Param<double> distance_gain{*this, "distance-gain", "speed per way that is left", {.initial = 1.5, .unit = "1/s"}};
    hal::Param<double> heading_gain{*this, "heading-gain", "speed of turning per angle that is left", {.initial = 4.0, .unit = "1/s"}};
    hal::Param<double> max_speed{*this, "max-speed", "forwards", {.initial = 0.5, .unit = "m/s"}};
    hal::Param<double> tolerance{*this,
                                 "tolerance",
                                 "the target is reached within this; the robot sets off again beyond twice of it",
                                 {.initial = 0.01, .unit = "m"}};

    hal::Out<double> linear{*this, "linear", "wanted speed forwards", {.unit = "m/s", .safe = 0.0, .finite = true}};
    hal::Out<double> angular{*this, "angular", "wanted speed of turning to the left", {.unit = "rad/s", .safe = 0.0, .finite = true}};
    hal::Out<double> distance{*this, "distance", "way that is left", {.unit = "m", .finite = true}};
    hal::Out<bool>   reached{*this, "reached", "the robot is at the target"};
    hal::Out<bool>   invalid{*this, "invalid", "an input is no number, or a length beyond 1e9 m: the robot is asked to stand still"};

    hal::Function run{*this, "", &DriveTo::update, "wanted speeds from target and pose"};

    void update(hal::Cycle) noexcept {
        const double dx = target_x - x, dy = target_y - y, left = std::hypot(dx, dy), within = std::fabs(tolerance);
        invalid = !(left < 1e9 && std::fabs(heading) < 1e9 && std::isfinite(within));
        if (invalid) return stand(0.0, false);
        const bool there = left <= (reached ? 2 * within : within);
        if (there || !enable) return stand(left, there);
        const double error = std::remainder(std::atan2(dy, dx) - heading, 2 * std::numbers::pi);
        // It turns first, and drives the faster the better it looks at the target.
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
From the pose of diff_drive and a target it makes the speeds diff_drive takes: the robot turns towards the target, drives the faster the
better it looks at it, and stands still within `tolerance`. The target may move.

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
