// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct SimpleTp : hal::Component {
    using Component::Component;
    hal::In<double> target{*this, "target-pos", "target position"};
    hal::Limit max_velocity{*this, "maxvel", "maximum speed"};
    hal::Limit max_acceleration{*this, "maxaccel", "maximum acceleration"};
    hal::In<bool> enable{*this, "enable", "FALSE brakes to a stop"};
    hal::Out<double> position{*this, "current-pos", "current position"};
    hal::Out<double> velocity{*this, "current-vel", "current velocity", {.safe = 0.0}};
    hal::Out<bool> active{*this, "active", "TRUE until the target is reached"};
    hal::Function run{*this, "update", &SimpleTp::update, "computes the next position"};

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const double acceleration = at_least_0(max_acceleration);
        const double change = acceleration * dt;
        const double negligible = change * dt * 0.001;
        const double distance = std::fabs(target) <= huge ? target - position : 0.0;

        const bool going = enable && std::fabs(distance) > negligible;
        const double speed = going ? braking_speed(std::fabs(distance), acceleration, change) : 0.0;
        const double wanted = std::copysign(std::min(speed, at_least_0(max_velocity)), distance);
        const double slowest = velocity - change;
        const double fastest = velocity + change;
        velocity = std::clamp(wanted, slowest, fastest) + 0.0;  // never -0
        position = position + velocity * dt;
        active = going || velocity != 0.0;
    }

private:
    static constexpr double huge = 1e20;  // beyond it sums would lose all digits, or overflow

    static double at_least_0(double limit) noexcept {
        return limit > 0.0 ? std::min(limit, huge) : 0.0;
    }

    /// The speed from which braking by `change` in each cycle ends at `distance`: v * v + 2 v
    /// change = 2 a distance.
    static double braking_speed(double distance, double acceleration, double change) noexcept {
        return std::sqrt(2.0 * acceleration * distance + change * change) - change;
    }
};

}  // namespace

HAL_COMPONENT(SimpleTp, "simple_tp",
              "Trajectory planner for one axis: trapezoidal speed to a target", R"(
Moves `current-pos` to `target-pos` with at most `maxvel` and `maxaccel`, and stops there without overshoot. The target and the limits
may change at any time: the axis reverses or decelerates within `maxaccel`. While `enable` is FALSE, or the target is NaN or
beyond 1e20, it brakes with `maxaccel` and stops. After a stop of the thread it starts from rest. The initial position is 0. It stops within a thousandth of the distance of the first cycle of
an acceleration, `maxaccel` * T * T for a thread of period T.

**Differences from LinuxCNC:** A `maxvel` or `maxaccel` that is negative counts as 0: no motion, no change of the speed. For NaN its last valid value applies (LinuxCNC:
NaN in `current-pos`, or motion away from the target).

    loadrt simple_tp names=tp
    addf tp.update servo
    setp tp.maxvel 20
    setp tp.maxaccel 100
    net jog-target => tp.target-pos
    net jog-enable => tp.enable
    net jog-pos    <= tp.current-pos
)")
