// SPDX-License-Identifier: MIT
// Modes whose set-points the axis plans itself: profile position, profile velocity, vl and profile
// torque.
#include <algorithm>
#include <cmath>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

// Profile position.

void DriveAxis::accept_set_point() noexcept {
    if (acknowledged_) return;
    const bool immediately = (control_ & control::change_immediately) != 0;

    const bool pending = active_ || set_points_.count != 0;
    if (!immediately && pending && set_points_.full()) return;
    SetPoint next{0, profile_limits()};
    next.limits.end_velocity = objects_.end_velocity * units_.speed;
    if ((control_ & control::relative) != 0) {
        const int option = objects_.positioning_option & 3;
        const double base = option == 1 ? ref_.position : option == 2 ? measured_ : last_target_;
        next.target = base + objects_.target_position * units_.position;
    } else {
        next.target = absolute(objects_.target_position,
                               pending && !immediately ? last_target_ : ref_.position);
    }
    next.target = within_limits(next.target);
    last_target_ = next.target;
    acknowledged_ = true;
    if (immediately) {
        set_points_.clear();
    }
    if (immediately || !pending) {
        start_set_point(next);
        return;
    }
    set_points_.push(next);
    if ((control_ & control::change_on_set_point) == 0 || set_points_.count != 1 || halted_) return;
    // Passes the present target without a stop, as fast as the next allows, if the direction is the
    // same.
    const double ahead = active_set_point_.target - unsmoothed(true).position;

    const double further = next.target - active_set_point_.target;
    if (ahead * further <= 0 || profile_.done()) return;
    active_set_point_.limits.end_velocity =
        std::min({active_set_point_.limits.velocity, next.limits.velocity,
                  std::sqrt(2 * next.limits.deceleration * std::abs(further))});
    profile_.plan(unsmoothed(true), active_set_point_.target, active_set_point_.limits);
}

void DriveAxis::start_set_point(const SetPoint& next) noexcept {
    active_set_point_ = next;
    active_ = true;
    reached_ = false;
    reached_time_ = 0;
    take(Control::position);
    profile_.plan(unsmoothed(true), next.target, next.limits);
}

void DriveAxis::profile_position(double dt) noexcept {
    if ((edges_ & control::new_set_point) != 0) {
        accept_set_point();
    }
    if ((control_ & control::new_set_point) == 0 && !set_points_.full()) {
        acknowledged_ = false;
    }
    take(Control::position);
    const int direction = ref_.velocity > 0 ? 1 : -1;
    if (ref_.velocity != 0 && blocked(direction)) {
        profile_.clear();
        set_points_.clear();
        active_ = false;
        limited_ = true;
    }
    if (!active_) {
        const auto stop = limited_ ? Stop::quick_stop : Stop::slow_down;
        ramp(ref_, 0, stop_rate(stop), stop_rate(stop), dt);
        return;
    }
    const auto start_next = [&] {
        const SetPoint next = set_points_.front();
        set_points_.pop();
        start_set_point(next);
    };
    if (reached_ && set_points_.count != 0) {
        start_next();
    }
    Motion& raw = unsmoothed(true);
    double left = profile_.step(raw, dt);
    while (profile_.done() && active_set_point_.limits.end_velocity > 0 && set_points_.count != 0 &&
           left > 0) {
        start_next();
        left = profile_.step(raw, left);
    }
    // with an end velocity and no further set-point, it keeps moving
    if (profile_.done()) {
        raw.position += raw.velocity * left;
    }
    ref_ = smoother_.step(dt);
    if (!profile_.done() || (raw.velocity == 0 && !smoother_.settled())) return;
    const bool there = objects_.position_window == no_window ||
                       std::abs(active_set_point_.target - measured_) <=
                           objects_.position_window * std::abs(units_.position);
    if (ref_.velocity == 0 && !there) {
        reached_time_ = 0;
    } else {
        reached_time_ += dt;
    }
    reached_ = reached_time_ * 1000 >= objects_.position_window_time || ref_.velocity != 0;
}

// Profile velocity, vl, profile torque.

void DriveAxis::profile_velocity(double dt) noexcept {
    take(Control::velocity);
    auto limits = profile_limits();
    limits.velocity = highest_speed();
    if (objects_.max_profile_velocity != 0) {
        limits.velocity = std::min(limits.velocity, objects_.max_profile_velocity * units_.speed);
    }
    const double target =
        std::clamp(objects_.target_velocity * units_.velocity, -limits.velocity, limits.velocity);
    if (target != objects_.target_velocity * units_.velocity) {
        limited_ = true;
    }
    wanted_ = target;
    ramp(unsmoothed(false), target, limits.acceleration, limits.deceleration, dt);
    const Motion from = ref_;
    ref_ = smoother_.step(dt);
    ref_.position = from.position + (from.velocity + ref_.velocity) / 2 * dt;
    const double window = objects_.velocity_window * units_.speed;
    reached_time_ = std::abs(target - now_speed()) <= window ? reached_time_ + dt : 0;
    reached_ = reached_time_ * 1000 >= objects_.velocity_window_time && reached_time_ > 0;
}

void DriveAxis::vl_velocity(double dt) noexcept {
    take(Control::velocity);
    const auto rate = [&](const Ramp& r) {
        return per_second(r.speed) / std::max<double>(r.time, 1) * settings_.motor.resolution;
    };
    double wanted = static_cast<double>(objects_.vl_target) * objects_.vl_set_point_numerator /
                    objects_.vl_set_point_denominator * objects_.vl_dimension_numerator /
                    objects_.vl_dimension_denominator;
    if (wanted != 0) {
        const double amount = std::clamp<double>(std::abs(wanted), objects_.vl_min,
                                                 std::max(objects_.vl_min, objects_.vl_max));
        if (amount != std::abs(wanted)) {
            limited_ = true;
        }
        wanted = std::copysign(amount, wanted);
    }
    const double most = highest_speed();
    double target = std::clamp(per_second(wanted) * settings_.motor.resolution *
                                   ((objects_.polarity & 0x40) != 0 ? -1 : 1),
                               -most, most);
    if ((control_ & control::reference_ramp) == 0) {
        target = 0;
    }
    wanted_ = target;
    if ((control_ & control::enable_ramp) == 0) {
        ramp(ref_, 0, rate(objects_.vl_quick_stop), rate(objects_.vl_quick_stop), dt);
    } else if ((control_ & control::unlock_ramp) != 0) {
        ramp(ref_, target, rate(objects_.vl_acceleration), rate(objects_.vl_deceleration), dt);
    } else {
        ref_.acceleration = 0;
    }
    reached_ = ref_.velocity == target;
}

void DriveAxis::profile_torque(double dt) noexcept {
    take(Control::torque);
    const double target = torque_of(objects_.target_torque);

    const double slope = torque_of(objects_.torque_slope);
    wanted_ = target;
    const double change = slope > 0 ? slope * dt : std::abs(target - torque_ref_);
    torque_ref_ += std::clamp(target - torque_ref_, -change, change);
    reached_ = torque_ref_ == target && std::abs(plant_.torque() - target) <= torque_of(20);
}

}  // namespace hal::canopen::cia402
