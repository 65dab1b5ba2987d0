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
    hal::In<bool>      is_on{*this, "spindle-is-on", "TRUE while the spindle is commanded to run"};
    hal::In<double>    command{*this, "spindle-command", "commanded speed"};
    hal::In<double>    feedback{*this, "spindle-feedback", "measured speed"};
    hal::Out<bool>     at_speed{*this, "spindle-at-speed", "TRUE after the commanded speed was reached, until the spindle is switched off"};
    hal::Out<bool>     underspeed{*this, "spindle-underspeed", "TRUE after the speed has dropped again, until the spindle is switched off"};
    StateParam         level{*this, "level", "state: 0 off, 1 accelerating, 2 at speed, 3 underspeed"};
    hal::Param<double> threshold{*this, "threshold", "permitted deviation from the command"};
    hal::Function      run{*this, "", &SpindleMonitor::update, "monitors the speed"};

    void update(hal::Cycle) noexcept {
        if (!is_on || level > fallen) level.enter(off);
        if (is_on && level == off) level.enter(gaining);
        const double wanted = std::fabs(command), speed = command < 0.0 ? -feedback : feedback.get();
        if (level == gaining && std::fabs(speed - wanted) < threshold) level.enter(reached);
        if (level == reached && !(speed >= wanted - threshold)) level.enter(fallen);  // also for NaN
        at_speed = level >= reached;
        underspeed = level == fallen;
    }

private:
    static constexpr std::uint32_t off = 0, gaining = 1, reached = 2, fallen = 3;
};

}  // namespace

HAL_COMPONENT(SpindleMonitor, "spindle_monitor", "Detects when a spindle reaches its speed and when it drops below it", R"(
With the spindle on, `spindle-at-speed` becomes TRUE when the speed is within `threshold` of the command. If the speed then
drops more than `threshold` below the command, or is NaN, `spindle-underspeed` becomes TRUE. Both remain TRUE until the spindle is off.

Speeds are compared in the direction of the command: with a command of -100, a speed of -110 is above it (LinuxCNC reports underspeed).

    loadrt spindle_monitor names=watch
    addf watch servo
    setp watch.threshold 20
    net spindle-on    => watch.spindle-is-on
    net spindle-cmd   => watch.spindle-command
    net spindle-speed => watch.spindle-feedback
    net may-cut       <= watch.spindle-at-speed
    net stalled       <= watch.spindle-underspeed
)")
