// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct Orient : hal::Component {
    using Component::Component;
    hal::In<bool> enable{*this, "enable",
                         "a rising edge computes the command; while TRUE the error is monitored"};
    hal::In<std::int32_t> mode{
        *this, "mode",
        "0: shortest direction, 1: clockwise (increasing position), 2: counterclockwise"};
    hal::In<double> position{*this, "position", "position of the spindle", {.unit = "turn"}};
    hal::In<double> angle{*this, "angle", "target angle", {.unit = "deg"}};
    hal::Out<double> command{*this, "command", "commanded position", {.unit = "turn"}};
    hal::Out<double> poserr{*this, "poserr", "position - command", {.unit = "deg"}};
    hal::Out<bool> is_oriented{*this, "is-oriented",
                               "TRUE while enabled, after 101 cycles within tolerance"};
    hal::In<double> tolerance{
        *this, "tolerance", "maximum error for is-oriented", {.initial = 0.5, .unit = "deg"}};
    hal::Function run{*this, "", &Orient::update, "computes command and the error"};

    void update(hal::Cycle) noexcept {
        if (enable_edge_.rises(enable)) {
            has_target_ = choose();
            settled_cycles_ = 0;
        }
        if (!enable) {
            is_oriented = false;
            return;
        }
        poserr = (position - command) * 360.0;
        if (has_target_ && settled_cycles_ < required_cycles && std::fabs(poserr) < tolerance) {
            ++settled_cycles_;
        }
        is_oriented = settled_cycles_ >= required_cycles;
    }

private:
    /// Sets the command. Returns false when there is no target.
    bool choose() noexcept {
        const double target = angle / 360.0;
        if (!std::isfinite(position + target)) return false;
        switch (mode) {
        case 0: command = std::floor(position + 0.5 - target) + target; break;
        case 1: command = std::ceil(position - target) + target; break;
        case 2: command = std::floor(position - target) + target; break;
        default: break;  // invalid mode: hold the last command
        }
        return true;
    }

    static constexpr int required_cycles = 101;
    hal::RisingEdge enable_edge_;
    bool has_target_ = false;
    int settled_cycles_ = 0;  // since the rising edge of enable, within the tolerance
    hal::Retained retained_{*this,
                            {{"was-enabled", enable_edge_},
                             {"has-target", has_target_},
                             {"settled-cycles", settled_cycles_}}};
};

}  // namespace

HAL_COMPONENT(Orient, "orient", "Stops a spindle at an angle: the command for its position loop",
              R"(
A rising edge of `enable` sets the command to a position whose fraction of a turn is `angle` / 360:

| mode | command |
| --- | --- |
| 0 | the nearest; of two equally near, the larger one |
| 1 | the next at or above `position` (clockwise) |
| 2 | the next at or below `position` (counterclockwise) |

In any other mode the command is held. `angle` may be any number of degrees; whole turns are
ignored. While enabled, `poserr` is `position` - `command` in degrees. `is-oriented` becomes TRUE in
the 101st cycle in which it is within `tolerance` and remains TRUE until `enable` is FALSE, so that
a spindle that passes the angle is not reported.

**Differences from LinuxCNC:** if position or angle is NaN or infinite at the edge of `enable`, the
command is held, and `is-oriented` remains FALSE until the next edge (LinuxCNC: NaN).

    loadrt orient names=orient
    loadrt pid names=orient-pid
    addf orient servo
    addf orient-pid.do-pid-calcs servo
    net orient-enable  => orient.enable orient-pid.enable
    net orient-angle   => orient.angle
    net spindle-pos    => orient.position orient-pid.feedback
    net orient-command orient.command => orient-pid.command
)")
