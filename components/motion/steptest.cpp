// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Steptest : axis_test::Mover {
    using Mover::Mover;
    hal::In<double> max_acceleration{*this, "maxaccel", "largest acceleration"};
    hal::Function   step{*this, "", &Steptest::update, "computes the position to go to"};

    void update(hal::Cycle cycle) noexcept {
        // So far ahead that a follower with these limits reaches maxvel and need not brake before the next cycle.
        const double v = std::fabs(max_velocity), braking = max_acceleration > 0.0 ? v * v / (2.0 * max_acceleration) : 0.0;
        move(2.0 * v * cycle.seconds() + braking, cycle.seconds());
    }
};

}  // namespace

HAL_COMPONENT(Steptest, "steptest", "Moves an axis with a step generator, to try speed and acceleration", R"(
While `run` is TRUE `position-cmd` is one end of a way around the position where it began, then the other: `run-low` and `run-high`,
`amplitude` to the sides that `dir` says. It changes when `position-fb` is within `epsilon` of the end and has rested there for `pause`
seconds. A jog commands a position ahead of the axis, by two cycles at `maxvel` and the way that braking takes. Else the command is
the position. The trapezoid is made by the step generator behind it, with its own `maxvel` and `maxaccel`.

    loadrt steptest names=try
    addf try servo
    setp try.maxvel 50
    setp try.maxaccel 400
    setp try.amplitude 20
    net x-cmd <= try.position-cmd
    net x-fb  => try.position-fb
    net go    => try.run
)")
