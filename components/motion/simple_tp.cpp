// SPDX-License-Identifier: MIT
#include "axis_planner.hpp"
#include "hal/component.hpp"

namespace {

struct SimpleTp : hal::Component {
    using Component::Component;
    hal::In<double>  target{*this, "target-pos", "where to go"};
    hal::In<double>  max_velocity{*this, "maxvel", "largest speed"};
    hal::In<double>  max_acceleration{*this, "maxaccel", "largest change of speed per second"};
    hal::In<bool>    enable{*this, "enable", "FALSE: the wanted speed is 0, it brakes"};
    hal::Out<double> position{*this, "current-pos", "where it is"};
    hal::Out<double> velocity{*this, "current-vel", "how fast it moves"};
    hal::Out<bool>   active{*this, "active", "TRUE while it moves or has somewhere to go"};
    hal::Function    run{*this, "update", &SimpleTp::update, "one step on the way"};

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
may change at any moment: it turns round, or slows down, within `maxaccel`. With `enable` FALSE, or while the target is not a number or
beyond 1e20, it brakes with `maxaccel` and stays. It starts at 0. With `maxaccel` not positive the speed cannot change.

It brakes as late as whole periods allow, so it arrives some periods earlier than LinuxCNC's own, which comes in more slowly.

    loadrt simple_tp names=tp
    addf tp.update servo
    setp tp.maxvel 20
    setp tp.maxaccel 100
    net jog-target => tp.target-pos
    net jog-enable => tp.enable
    net jog-pos    <= tp.current-pos
)")
