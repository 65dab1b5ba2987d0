// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Axistest : axis_test::Mover {
    using Mover::Mover;
    hal::Function step{*this, "update", &Axistest::update, "computes the commanded position"};

    void update(hal::Cycle cycle) noexcept { move(std::fabs(max_velocity), cycle.seconds()); }
};

}  // namespace

HAL_COMPONENT(Axistest, "axistest", "Moves an axis through a trajectory planner, to test speed and acceleration", R"(
While `run` is TRUE `position-cmd` alternates between the two ends `run-low` and `run-high`, at the distance
`amplitude` from the initial position on the sides selected by `dir`. It changes after `position-fb` has been within `epsilon` of the end for `pause`
seconds. A jog commands a position ahead of the axis, by the distance of one second at `maxvel`. Otherwise the command is the feedback.
Put a planner that limits the motion, for example `simple_tp`, between this component and the axis.

    loadrt axistest names=try
    loadrt simple_tp names=tp
    addf try.update servo
    addf tp.update servo
    setp try.amplitude 20
    net target try.position-cmd => tp.target-pos
    net x-fb   tp.current-pos => try.position-fb
    net go     => try.run
)")
