// SPDX-License-Identifier: MIT
#include "axis_planner.hpp"
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct SimpleTp : hal::Component {
    using Component::Component;
    hal::In<double>  target{*this, "target-pos", "target position"};
    hal::Limit       max_velocity{*this, "maxvel", "maximum speed"};
    hal::Limit       max_acceleration{*this, "maxaccel", "maximum acceleration"};
    hal::In<bool>    enable{*this, "enable", "FALSE brakes to a stop"};
    hal::Out<double> position{*this, "current-pos", "current position"};
    hal::Out<double> velocity{*this, "current-vel", "current velocity"};
    hal::Out<bool>   active{*this, "active", "TRUE until the target is reached"};
    hal::Function    run{*this, "update", &SimpleTp::update, "computes the next position"};

    void update(hal::Cycle cycle) noexcept {
        const double goal = target;
        const bool going = enable && std::fabs(goal) <= plan::huge;
        axis_.step(going ? &goal : nullptr, max_velocity, max_acceleration, cycle.seconds());
        position = axis_.position();
        velocity = axis_.velocity();
        active = !axis_.resting() || (going && !axis_.at(goal));
    }

private:
    plan::Axis axis_;
};

}  // namespace

HAL_COMPONENT(SimpleTp, "simple_tp", "Trajectory planner for one axis: trapezoidal speed to a target", R"(
Moves `current-pos` to `target-pos` with at most `maxvel` and `maxaccel`, and stops there without overshoot. The target and the limits
may change at any time: the axis reverses or decelerates within `maxaccel`. While `enable` is FALSE, or the target is NaN or
beyond 1e20, it brakes with `maxaccel` and stops. The initial position is 0. If `maxaccel` is not positive, the speed cannot change.

It brakes as late as whole periods allow, so it arrives a few periods earlier than LinuxCNC's.

    loadrt simple_tp names=tp
    addf tp.update servo
    setp tp.maxvel 20
    setp tp.maxaccel 100
    net jog-target => tp.target-pos
    net jog-enable => tp.enable
    net jog-pos    <= tp.current-pos
)")
