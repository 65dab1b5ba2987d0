// SPDX-License-Identifier: MIT
#include "estimation/drive_kinematics.hpp"

HAL_COMPONENT(hal::estimation::DriveKinematics, "drive_kinematics",
              "Wheel speeds and odometry of a robot with two driven wheels", R"(
The two wheels are `track` apart. Joints are the measured wheel speeds, left then right; `pose` is the odometry. `target-0` is the forward speed, `target-1`
the turning speed, and the commands are the wheel speeds for them. `diff_drive` does the same from wheel angles, with a named pin
for each value and with limits of speed and acceleration.

If `target-0`, `target-1` or `track` is NaN, infinite or above 1e9, the wheel commands are 0. With such a measured speed they follow the target, and the odometry
keeps its values. `solved` is FALSE in both cases.

    loadrt drive_kinematics names=base
    addf base.update servo
    setp base.track 0.4
    net forward     => base.target-0
    net left-speed  <= base.command-0
    net right-speed <= base.command-1
)")
