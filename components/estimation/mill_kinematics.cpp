// SPDX-License-Identifier: MIT
#include "estimation/mill_kinematics.hpp"

HAL_COMPONENT(hal::estimation::MillKinematics, "mill_kinematics",
              "Forward and inverse kinematics of a five-axis mill with a trunnion table", R"(
X Y Z move the tool. The table rotates the workpiece by C about z, on a trunnion that rotates by A about x; the two axes meet in `pivot`. Joints and commands
0 to 4 are X Y Z A C. Targets are the position of the tool tip and the direction of the tool in the workpiece's frame. Of the two solutions the one nearer to
the last C is chosen, and C takes the shorter way round. With the tool upright C does not move.

Near the upright C has to turn far for a small change of the direction. A and C move at most with `max-speed`: meanwhile the tool lags behind the direction, `solved` is
FALSE, and X Y Z keep the tip at its place on the workpiece.

If an input, the tool length or the pivot is NaN, infinite or above 1e9, all outputs keep their values and `solved` becomes FALSE.

    loadrt mill_kinematics names=mill
    addf mill.update servo
    setp mill.tool-length 0.1
    net tip-x  => mill.target-0
    net tilt-x => mill.target-3
    net x-cmd  <= mill.command-0
    net a-cmd  <= mill.command-3
)")
