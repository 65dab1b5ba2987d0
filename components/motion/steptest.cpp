// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Steptest : axis_test::Mover {
    using Mover::Mover;
    hal::In<double> max_acceleration{*this, "maxaccel",
                                     "maximum acceleration; not used, as in LinuxCNC"};
    hal::Function step{*this, "", &Steptest::update, "computes the commanded position"};

    void update(hal::Cycle cycle) noexcept {
        if (!free_to_jog(cycle.seconds())) return;
        const double lead = 2.0 * max_velocity * cycle.seconds();
        if (jog_minus) {
            position_cmd = position_fb - lead;
        } else if (jog_plus) {
            position_cmd = position_fb + lead;
        } else if (std::fabs(position_fb - position_cmd) > 0.0005 * lead) {
            position_cmd = position_fb;  // follows while the axis brakes
        }
        run_target = position_cmd.get();
    }
};

}  // namespace

HAL_COMPONENT(Steptest, "steptest",
              "Moves an axis with a step generator, to test speed and acceleration", R"(
While `run` is TRUE `position-cmd` alternates between the two ends `run-low` and `run-high`, at the
distance `amplitude` from the initial position on the sides selected by `dir`. It changes after
`position-fb` has been within `epsilon` of the end for `pause` seconds. After `run` the axis returns
to the initial position, and `running` becomes FALSE there. A jog commands a position two cycles at
`maxvel` ahead of the axis; `jog-minus` takes precedence. Otherwise the command follows the
feedback, until both differ by at most a thousandth of what `maxvel` moves in a cycle. The step
generator that follows limits the motion with its own `maxvel` and `maxaccel`.

`run-target` equals `position-cmd` (LinuxCNC: always 0).

    loadrt steptest names=try
    addf try servo
    setp try.maxvel 50
    setp try.maxaccel 400
    setp try.amplitude 20
    net x-cmd <= try.position-cmd
    net x-fb  => try.position-fb
    net go    => try.run
)")
