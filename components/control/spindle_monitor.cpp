// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

/// The state, which the user may set.
class StateParam : public hal::Param<std::uint32_t> {
public:
    using Param::Param;
    void enter(std::uint32_t state) noexcept { put(state); }
};

struct SpindleMonitor : hal::Component {
    using Component::Component;
    hal::In<bool> is_on{*this, "spindle-is-on", "TRUE while the spindle is commanded to run"};
    hal::In<double> command{*this, "spindle-command", "commanded speed"};
    hal::In<double> feedback{*this, "spindle-feedback", "measured speed"};
    hal::Out<bool> at_speed{
        *this, "spindle-at-speed",
        "TRUE after the commanded speed was reached, until the spindle is switched off"};
    hal::Out<bool> underspeed{
        *this, "spindle-underspeed",
        "TRUE after the speed has dropped again, until the spindle is switched off"};
    StateParam level{*this, "level", "state: 0 off, 1 accelerating, 2 reached its speed"};
    hal::Param<double> threshold{*this, "threshold", "permitted deviation from the command"};
    hal::Function run{*this, "", &SpindleMonitor::update, "monitors the speed"};

    void update(hal::Cycle) noexcept {
        switch (level) {
        case off:
            at_speed = false;
            underspeed = false;
            if (is_on) {
                level.enter(accelerating);
            }
            break;
        case accelerating:
            if (is_on && std::fabs(command - feedback) < threshold) {
                level.enter(reached);
                at_speed = true;
            }
            if (!is_on) {
                level.enter(off);
            }
            break;
        case reached:
            if (is_on && has_dropped()) {
                underspeed = true;
            }
            if (!is_on) {
                level.enter(off);
            }
            break;
        default: level.enter(off); break;
        }
    }

private:
    static constexpr std::uint32_t off = 0;
    static constexpr std::uint32_t accelerating = 1;
    static constexpr std::uint32_t reached = 2;

    /// In the direction of the command; a NaN counts as dropped.
    bool has_dropped() const noexcept {
        const double missing = command < 0.0 ? feedback - command : command - feedback;
        return !(missing <= threshold);
    }
};

}  // namespace

HAL_COMPONENT(SpindleMonitor, "spindle_monitor",
              "Detects when a spindle reaches its speed and when it drops below it", R"(
With the spindle on, `spindle-at-speed` becomes TRUE when the speed is within `threshold` of the
command. If the speed then drops more than `threshold` below the command, or is NaN,
`spindle-underspeed` becomes TRUE. Both remain TRUE until the spindle is off. Each change of `level`
takes a cycle, and both are cleared one cycle after it becomes 0.

**Differences from LinuxCNC:** Speeds are compared in the direction of the command: with a command
of -100, a speed of -80 is an underspeed and -110 is not (LinuxCNC: the other way round); a NaN
speed is one.

    loadrt spindle_monitor names=watch
    addf watch servo
    setp watch.threshold 20
    net spindle-on    => watch.spindle-is-on
    net spindle-cmd   => watch.spindle-command
    net spindle-speed => watch.spindle-feedback
    net may-cut       <= watch.spindle-at-speed
    net stalled       <= watch.spindle-underspeed
)")
