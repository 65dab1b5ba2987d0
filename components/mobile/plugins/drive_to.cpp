// SPDX-License-Identifier: MIT
#include "mobile/to_target.hpp"

namespace {

struct DriveTo : hal::Component {
    using Component::Component;

    hal::mobile::ToTarget go{*this,
                             {0.01,
                              "distance within which the target is reached; beyond twice this "
                              "distance the robot starts again"}};
    hal::Param<double> heading_gain{*this,
                                    "heading-gain",
                                    "turning speed per remaining angle",
                                    {.initial = 4.0, .unit = "1/s"}};

    hal::Function run{*this, "", &DriveTo::update,
                      "computes the requested speeds from target and pose"};

    void update(hal::Cycle) noexcept {
        if (!go.valid() || !go.under_way(2.0)) return;
        const double error = go.wanted();
        go.linear = go.finite(go.speed(error));
        go.angular = go.finite(heading_gain * error);
    }
};

}  // namespace

HAL_COMPONENT(DriveTo, "drive_to", "Drives a two-wheeled robot to a point", R"(
Computes the speeds for `diff_drive` from its pose and a target: the robot turns towards the target,
drives faster as the heading error falls, and stops within `tolerance`. The target may move.

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
