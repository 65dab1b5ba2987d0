// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Steptest : axis_test::Mover {
    using Mover::Mover;
    hal::In<double> max_acceleration{*this, "maxaccel", "maximum acceleration"};
    hal::Function   step{*this, "", &Steptest::update, "computes the commanded position"};

    void update(hal::Cycle cycle) noexcept {
        // Far enough ahead that a follower with these limits reaches maxvel and does not brake before the next cycle.
        const double v = std::fabs(max_velocity), braking = max_acceleration > 0.0 ? v * v / (2.0 * max_acceleration) : 0.0;
        move(2.0 * v * cycle.seconds() + braking, cycle.seconds());
    }
};

}  // namespace

HAL_COMPONENT(Steptest, "steptest", "Moves an axis with a step generator, to test speed and acceleration", R"(
While `run` is TRUE `position-cmd` alternates between the two ends `run-low` and `run-high`, at the distance
`amplitude` from the initial position on the sides selected by `dir`. It changes after `position-fb` has been within `epsilon` of the end for `pause`
seconds. A jog commands a position ahead of the axis, by two cycles at `maxvel` plus the braking distance. Otherwise the command is
the feedback. The step generator that follows limits the motion with its own `maxvel` and `maxaccel`.

    loadrt steptest names=try
    addf try servo
    setp try.maxvel 50
    setp try.maxaccel 400
    setp try.amplitude 20
    net x-cmd <= try.position-cmd
    net x-fb  => try.position-fb
    net go    => try.run
)")
