// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Orient : hal::Component {
    using Component::Component;
    hal::In<bool>         enable{*this, "enable", "a rising edge computes the command; while TRUE the error is monitored"};
    hal::In<std::int32_t> mode{*this, "mode", "0: shortest direction, 1: clockwise (increasing position), 2: counterclockwise"};
    hal::In<double>       position{*this, "position", "position of the spindle", {.unit = "turn"}};
    hal::In<double>       angle{*this, "angle", "target angle", {.unit = "deg"}};
    hal::Out<double>      command{*this, "command", "commanded position", {.unit = "turn"}};
    hal::Out<double>      poserr{*this, "poserr", "position - command", {.unit = "deg"}};
    hal::Out<bool>        is_oriented{*this, "is-oriented", "TRUE while enabled and within tolerance"};
    hal::In<double>       tolerance{*this, "tolerance", "maximum error for is-oriented", {.initial = 0.5, .unit = "deg"}};
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
        default: break;  // invalid mode: hold the last command
        }
    }
    bool was_enabled_ = false;
};

}  // namespace

HAL_COMPONENT(Orient, "orient", "Stops a spindle at an angle: the command for its position loop", R"(
A rising edge of `enable` sets the command to a position whose fraction of a turn is `angle` / 360:

| mode | command |
| --- | --- |
| 0 | the nearest; of two equally near, the smaller one |
| 1 | the next at or above `position` (clockwise) |
| 2 | the next at or below `position` (counterclockwise) |

In any other mode, or if position or angle is NaN or infinite, the command is held. `angle` may be any number of degrees; whole turns
are ignored. While enabled, `poserr` is `position` - `command` in degrees, and `is-oriented` is TRUE while it is within `tolerance`.

    loadrt orient names=orient
    loadrt pid names=orient-pid
    addf orient servo
    addf orient-pid.do-pid-calcs servo
    net orient-enable  => orient.enable orient-pid.enable
    net orient-angle   => orient.angle
    net spindle-pos    => orient.position orient-pid.feedback
    net orient-command orient.command => orient-pid.command
)")
