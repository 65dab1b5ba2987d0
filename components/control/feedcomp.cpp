// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Feedcomp : hal::Component {
    using Component::Component;
    hal::Out<double>   out{*this, "out", "in, in proportion to the velocity"};
    hal::In<double>    in{*this, "in", "the value at the velocity feed"};
    hal::In<bool>      enable{*this, "enable", "FALSE: out is in"};
    hal::In<double>    vel{*this, "vel", "velocity now"};
    hal::Param<double> feed{*this, "feed", "velocity at which out is in; not 0"};
    hal::Function      run{*this, "", &Feedcomp::update, "computes out"};

    void update(hal::Cycle) noexcept { out = enable && feed != 0.0 ? in * (vel / feed) : in.get(); }
};

}  // namespace

HAL_COMPONENT(Feedcomp, "feedcomp", "Scales a value with the velocity, so that its effect per length stays the same", R"(
    out = in * vel / feed    while enable is TRUE and feed is not 0
    out = in                 else

For a laser or an extruder that has to give less while the machine slows down in a corner. With `feed` 0, where LinuxCNC's own gives
infinity, the value passes unchanged.

    loadrt feedcomp names=laser
    addf laser servo
    setp laser.feed 40
    setp laser.enable TRUE
    net power    => laser.in
    net velocity => laser.vel
    net pwm      <= laser.out
)")
