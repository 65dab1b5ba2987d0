// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Axistest : axis_test::Mover {
    using Mover::Mover;
    hal::Function step{*this, "update", &Axistest::update, "computes the position to go to"};

    void update(hal::Cycle cycle) noexcept { move(std::fabs(max_velocity), cycle.seconds()); }
};

}  // namespace

HAL_COMPONENT(Axistest, "axistest", "Moves an axis behind a trajectory planner, to try speed and acceleration", R"(
While `run` is TRUE `position-cmd` is one end of a way around the position where it began, then the other: `run-low` and `run-high`,
`amplitude` to the sides that `dir` says. It changes when `position-fb` is within `epsilon` of the end and has rested there for `pause`
seconds. A jog commands a position ahead of the axis, as far as it goes in a second at `maxvel`. Else the command is the position.
A planner between this and the axis makes the motion, for example `simple_tp`.

    loadrt axistest names=try
    loadrt simple_tp names=tp
    addf try.update servo
    addf tp.update servo
    setp try.amplitude 20
    net target try.position-cmd => tp.target-pos
    net x-fb   tp.current-pos => try.position-fb
    net go     => try.run
)")
