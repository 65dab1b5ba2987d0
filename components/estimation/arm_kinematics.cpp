// SPDX-License-Identifier: MIT
#include "estimation/arm_kinematics.hpp"

HAL_COMPONENT(hal::estimation::ArmKinematics, "arm_kinematics",
              "Forward and inverse kinematics of a serial arm with up to 8 joints", R"(
`dh` is the arm's Denavit-Hartenberg table, a row per joint: a, alpha, d, theta (m, rad), and a
fifth column with 1 for a prismatic joint. `pose` is x y z roll pitch yaw; roll, pitch and yaw
rotate about the fixed axes x, y and z, in this order.

`command` holds the joint positions that reach `target`. Each cycle runs `iterations` steps of
damped least squares from the solution of the previous cycle, so a target that moves smoothly is
tracked; `solved` is TRUE once `error` is within `tolerance`. While `follow` is TRUE, the solution
starts at the measured joints. With fewer than 6 joints, set `position-only`.

No command moves faster than `max-speed`. Near a singularity, and where the target is out of reach,
a joint may have to turn far for a short way of the target: the commands then lag behind it with
this speed, and `solved` is FALSE. The same happens when the target jumps.

If an input is NaN or infinite, all outputs keep their values and `solved` becomes FALSE.

    loadrt arm_kinematics names=scara dh=0.3,0,0,0;0.2,0,0,0
    addf scara.update servo
    setp scara.position-only TRUE
    net shoulder => scara.joint-0
    net elbow    => scara.joint-1
    net reach    => scara.target-0
    net turn     <= scara.command-0
)")
