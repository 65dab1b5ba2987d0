// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Orient : hal::Component {
    using Component::Component;
    hal::In<bool>         enable{*this, "enable", "rising edge: chooses the position to go to; TRUE: the error is watched"};
    hal::In<std::int32_t> mode{*this, "mode", "0: the shorter way, 1: clockwise (to larger positions), 2: counterclockwise"};
    hal::In<double>       position{*this, "position", "position of the spindle", {.unit = "turn"}};
    hal::In<double>       angle{*this, "angle", "where to stop", {.unit = "deg"}};
    hal::Out<double>      command{*this, "command", "position to go to", {.unit = "turn"}};
    hal::Out<double>      poserr{*this, "poserr", "position - command", {.unit = "deg"}};
    hal::Out<bool>        is_oriented{*this, "is-oriented", "TRUE while enabled and within tolerance"};
    hal::In<double>       tolerance{*this, "tolerance", "largest error that counts as there", {.initial = 0.5, .unit = "deg"}};
    hal::Function         run{*this, "", &Orient::update, "computes command and the error"};

    void update(hal::Cycle) noexcept {
        if (enable && !was_enabled_) choose();
        was_enabled_ = enable;
        if (!enable) {
            is_oriented = false;
            return;
        }
        poserr = (position - command) * 360.0;
        is_oriented = std::fabs(poserr) < tolerance;
    }

private:
    void choose() noexcept {
        const double target = angle / 360.0, turn = target - std::floor(target);
        const double there = std::floor(position) + turn;
        if (!std::isfinite(there)) return;
        const double up = there >= position ? there : there + 1.0, down = there <= position ? there : there - 1.0;
        switch (mode) {
        case 0: command = up - position < position - down ? up : down; break;
        case 1: command = up; break;
        case 2: command = down; break;
        default: break;  // no such mode: the last command stays
        }
    }
    bool was_enabled_ = false;
};

}  // namespace

HAL_COMPONENT(Orient, "orient", "Stops a spindle at an angle: the command for its position loop", R"(
At the rising edge of `enable` the command is set to a position with the fraction `angle` / 360:

| mode | command |
| --- | --- |
| 0 | the nearest; of two as near, the smaller one |
| 1 | the next at or above `position` (clockwise) |
| 2 | the next at or below `position` (counterclockwise) |

In another mode, or when position or angle is not a finite number, the command stays. `angle` may be any number of degrees; whole turns
are left out. While enabled, `poserr` is `position` - `command` in degrees, and `is-oriented` says that it is within `tolerance`.

    loadrt orient names=orient
    loadrt pid names=orient-pid
    addf orient servo
    addf orient-pid.do-pid-calcs servo
    net orient-enable  => orient.enable orient-pid.enable
    net orient-angle   => orient.angle
    net spindle-pos    => orient.position orient-pid.feedback
    net orient-command orient.command => orient-pid.command
)")
