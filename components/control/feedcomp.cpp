// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Feedcomp : hal::Component {
    using Component::Component;
    hal::Out<double> out{*this, "out", "in, scaled with the velocity"};
    hal::In<double> in{*this, "in", "value for the velocity feed"};
    hal::In<bool> enable{*this, "enable", "FALSE copies in to out"};
    hal::In<double> vel{*this, "vel", "current velocity"};
    hal::Param<double> feed{*this, "feed", "velocity at which out equals in; must not be 0"};
    hal::Function run{*this, "", &Feedcomp::update, "computes out"};

    void update(hal::Cycle) noexcept { out = enable && feed != 0.0 ? in * (vel / feed) : in.get(); }
};

}  // namespace

HAL_COMPONENT(Feedcomp, "feedcomp",
              "Scales a value with the velocity, so that its effect per length stays the same", R"(
    out = in * vel / feed    while enable is TRUE and feed is not 0
    out = in                 else

For a laser or an extruder whose output must decrease while the machine decelerates in a corner.
With `feed` 0, `out` is `in` (LinuxCNC: infinity).

    loadrt feedcomp names=laser
    addf laser servo
    setp laser.feed 40
    setp laser.enable TRUE
    net power    => laser.in
    net velocity => laser.vel
    net pwm      <= laser.out
)")
