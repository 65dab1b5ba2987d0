// SPDX-License-Identifier: MIT
#include "axis_test.hpp"

namespace {

struct Axistest : axis_test::Mover {
    using Mover::Mover;
    hal::Function step{*this, "update", &Axistest::update, "computes the commanded position"};

    void update(hal::Cycle cycle) noexcept {
        if (!free_to_jog(cycle.seconds())) return;
        constexpr double lead = 10.0;
        double jog = 0.0;
        if (jog_plus) {
            jog = lead;
        }
        if (jog_minus) {
            jog = -lead;
        }
        position_cmd = position_fb + jog;
        run_target = position_cmd.get();
    }
};

}  // namespace

HAL_COMPONENT(Axistest, "axistest",
              "Moves an axis through a trajectory planner, to test speed and acceleration", R"(
While `run` is TRUE `position-cmd` alternates between the two ends `run-low` and `run-high`, at the
distance `amplitude` from the initial position on the sides selected by `dir`. It changes after
`position-fb` has been within `epsilon` of the end for `pause` seconds. After `run` the axis returns
to the initial position, and `running` becomes FALSE there. A jog commands a position 10 units ahead
of the axis; `jog-minus` takes precedence. Otherwise the command is the feedback. `maxvel` is not
used, as in LinuxCNC. `run-target` equals `position-cmd` (LinuxCNC: always 0). Put a planner that
limits the motion, for example `simple_tp`, between this component and the axis.

    loadrt axistest names=try
    loadrt simple_tp names=tp
    addf try.update servo
    addf tp.update servo
    setp try.amplitude 20
    net target try.position-cmd => tp.target-pos
    net x-fb   tp.current-pos => try.position-fb
    net go     => try.run
)")
