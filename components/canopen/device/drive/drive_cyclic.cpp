// SPDX-License-Identifier: MIT
// Modes that follow the set-points of a master: interpolated position, cyclic synchronous position,
// velocity and torque; and homing.
#include <algorithm>
#include <cmath>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

void DriveAxis::interpolated_position(double dt) noexcept {
    take(Control::position);
    const bool enabled = (control_ & control::enable_interpolation) != 0;
    if (!enabled || (!active_ && records_.count == 0)) {
        if (!enabled) {
            active_ = false;
        }
        if (ref_.velocity != 0) {
            ramp(ref_, 0, stop_rate(Stop::slow_down), stop_rate(Stop::slow_down), dt);
        }
        interpolator_.hold(ref_.position);
        active_ = active_ || enabled;
        reached_ = false;
        return;
    }
    active_ = true;
    const double start = ref_.position;
    for (double left = dt; left > 0;) {
        if (interpolator_.arrived() && records_.count != 0) {
            interpolator_.next(ref_.position,
                               within_limits(nearest(records_.front(), ref_.position)), period());
            records_.pop();
        } else if (interpolator_.arrived()) {
            break;
        }
        left = interpolator_.step(ref_, left);
    }
    objects_.buffer_position = static_cast<std::uint16_t>(records_.count);
    ref_.velocity = (ref_.position - start) / dt;
    reached_ = interpolator_.arrived() && records_.count == 0;
}

void DriveAxis::cyclic_position(double dt) noexcept {
    take(Control::position);
    if (fresh_) {
        const double target = nearest(objects_.target_position, ref_.position) +
                              objects_.position_offset * units_.position;
        interpolator_.next(ref_.position, target, period());
        has_target_ = true;
    }
    fresh_ = false;
    // The axis holds until the first set-point after enabling: the value in 607Ah may be stale.
    if (!has_target_) {
        return ramp(ref_, 0, stop_rate(Stop::slow_down), stop_rate(Stop::slow_down), dt);
    }
    interpolator_.step(ref_, dt);
    const double inside = within_limits(ref_.position);
    if (inside != ref_.position) {
        ref_.position = inside;
        ref_.velocity = (inside - demand_before_) / dt;
    }
}

void DriveAxis::cyclic_velocity(double dt) noexcept {
    take(Control::velocity);
    if (fresh_) {
        const double most = highest_speed();
        wanted_ = (static_cast<double>(objects_.target_velocity) + objects_.velocity_offset) *
                  units_.velocity;
        interpolator_.next(ref_.velocity, std::clamp(wanted_, -most, most), period());
        has_target_ = true;
    }
    fresh_ = false;
    if (!has_target_) {
        return ramp(ref_, 0, stop_rate(Stop::slow_down), stop_rate(Stop::slow_down), dt);
    }
    Motion speed{ref_.velocity, 0, 0};
    interpolator_.step(speed, dt);
    ref_.velocity = speed.position;
    ref_.acceleration = speed.velocity;
}

void DriveAxis::cyclic_torque(double dt) noexcept {
    take(Control::torque);
    if (fresh_) {
        wanted_ = torque_of(static_cast<double>(objects_.target_torque) + objects_.torque_offset);
        interpolator_.next(torque_ref_, wanted_, period());
        has_target_ = true;
    }
    fresh_ = false;
    if (!has_target_) {
        torque_ref_ = 0;
        return;
    }
    Motion torque{torque_ref_, 0, 0};
    interpolator_.step(torque, dt);
    torque_ref_ = torque.position;
}

void DriveAxis::go_back_home() noexcept {
    const double rate = stop_rate(Stop::slow_down);

    const double slow = objects_.homing_zero_speed * units_.speed;
    profile_.plan(ref_, last_target_,
                  {slow > 0 ? std::min(slow, highest_speed()) : 1, rate, rate, 0});
}

void DriveAxis::homing(double dt) noexcept {
    take(Control::position);
    const double rate = stop_rate(Stop::slow_down);
    const double fast = std::min(objects_.homing_switch_speed * units_.speed, highest_speed());

    const double slow = std::min(objects_.homing_zero_speed * units_.speed, highest_speed());
    const bool wanted = (control_ & control::start_homing) != 0;

    const bool under_way =
        homing_phase_ == HomingPhase::search || homing_phase_ == HomingPhase::back;
    if (!wanted && under_way) {
        homing_phase_ = HomingPhase::idle;
    }
    if ((edges_ & control::start_homing) != 0 && !under_way) {
        const int method = objects_.homing_method;
        const bool moves = method < 35;
        const bool searches = method < 33;
        const bool possible =
            search_.begin(method, plant_) && (!moves || slow > 0) && (!searches || fast > 0);
        homing_phase_ = possible ? HomingPhase::search : HomingPhase::error;
    }
    reached_ = false;
    double velocity = 0;
    if (homing_phase_ == HomingPhase::search) {
        const auto order = search_.step(plant_, ref_.velocity, slow);
        switch (order.act) {
        case HomingSearch::Act::fast: velocity = order.direction * fast; break;
        case HomingSearch::Act::slow: velocity = order.direction * slow; break;
        case HomingSearch::Act::failed: homing_phase_ = HomingPhase::error; break;
        case HomingSearch::Act::stop_at_home: {
            const double home = search_.home() - encoder_zero_;
            origin_ = home - objects_.home_offset * units_.position;
            homed_ = true;
            homing_phase_ = HomingPhase::back;
            last_target_ = home;
            go_back_home();
            break;
        }
        }
    }
    if (homing_phase_ == HomingPhase::back) {
        profile_.step(ref_, dt);
        const bool there = std::abs(last_target_ - measured_) <=
                           std::max(1.0, objects_.position_window * std::abs(units_.position));
        if (!profile_.done() || !there || !standing()) return;
        homing_phase_ = HomingPhase::done;
    }
    ramp(ref_, velocity, rate, rate, dt);
    reached_ = homing_phase_ != HomingPhase::search && ref_.velocity == 0 && standing();
}

}  // namespace hal::canopen::cia402
