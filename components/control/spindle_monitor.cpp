// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

/// The state, which a user may set.
class StateParam : public hal::Param<std::uint32_t> {
public:
    using Param::Param;
    void enter(std::uint32_t state) noexcept { put(state); }
};

struct SpindleMonitor : hal::Component {
    using Component::Component;
    hal::In<bool>      is_on{*this, "spindle-is-on", "TRUE: the spindle has been told to run"};
    hal::In<double>    command{*this, "spindle-command", "wanted speed"};
    hal::In<double>    feedback{*this, "spindle-feedback", "measured speed"};
    hal::Out<bool>     at_speed{*this, "spindle-at-speed", "TRUE once the wanted speed was reached, until the spindle is switched off"};
    hal::Out<bool>     underspeed{*this, "spindle-underspeed", "TRUE once the speed has fallen again, until the spindle is switched off"};
    StateParam         level{*this, "level", "state: 0 off, 1 gaining speed, 2 at speed, 3 fallen below"};
    hal::Param<double> threshold{*this, "threshold", "how far the speed may be from the command"};
    hal::Function      run{*this, "", &SpindleMonitor::update, "watches the speed"};

    void update(hal::Cycle) noexcept {
        if (!is_on || level > fallen) level.enter(off);
        if (is_on && level == off) level.enter(gaining);
        const double wanted = std::fabs(command), speed = command < 0.0 ? -feedback : feedback.get();
        if (level == gaining && std::fabs(speed - wanted) < threshold) level.enter(reached);
        if (level == reached && !(speed >= wanted - threshold)) level.enter(fallen);  // also when it is not a number
        at_speed = level >= reached;
        underspeed = level == fallen;
    }

private:
    static constexpr std::uint32_t off = 0, gaining = 1, reached = 2, fallen = 3;
};

}  // namespace

HAL_COMPONENT(SpindleMonitor, "spindle_monitor", "Tells when a spindle has reached its speed, and when it has lost it", R"(
With the spindle on, `spindle-at-speed` becomes TRUE when the speed is less than `threshold` away from the command. If the speed then
falls more than `threshold` below it, or is not a number, `spindle-underspeed` becomes TRUE. Both stay until the spindle is off.

Speeds count in the direction of the command: with a command of -100, a speed of -110 is no underspeed. LinuxCNC's own takes it for one.

    loadrt spindle_monitor names=watch
    addf watch servo
    setp watch.threshold 20
    net spindle-on    => watch.spindle-is-on
    net spindle-cmd   => watch.spindle-command
    net spindle-speed => watch.spindle-feedback
    net may-cut       <= watch.spindle-at-speed
    net stalled       <= watch.spindle-underspeed
)")
