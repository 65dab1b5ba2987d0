// SPDX-License-Identifier: MIT
// What the axis shall do next: stops, limits, and the modes whose set-points it makes itself. drive_cyclic.cpp has the others.
#include <algorithm>
#include <cmath>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

namespace {
constexpr double turns(double per_minute) noexcept { return per_minute / 60; }
}  // namespace

void DriveAxis::read_units() noexcept {
    const double increments = objects_.position_encoder.value() * objects_.gear.value() / objects_.feed.value();
    units_.speed = increments * objects_.velocity_factor.value();
    units_.acceleration = increments * objects_.acceleration_factor.value();
    units_.position = (objects_.polarity & 0x80) != 0 ? -increments : increments;
    units_.velocity = (objects_.polarity & 0x40) != 0 ? -units_.speed : units_.speed;
}

double DriveAxis::highest_speed() const noexcept {
    const double limit = objects_.max_motor_speed != 0 ? std::min<double>(objects_.max_motor_speed, settings_.motor.highest_speed)
                                                       : settings_.motor.highest_speed;
    return turns(limit) * settings_.motor.resolution;
}
double DriveAxis::acceleration(std::uint32_t wanted) const noexcept {
    const auto limit = objects_.max_acceleration;
    return units_.acceleration * (limit != 0 && (wanted == 0 || wanted > limit) ? limit : wanted);
}
double DriveAxis::deceleration(std::uint32_t wanted) const noexcept {
    const auto limit = objects_.max_deceleration;
    return units_.acceleration * (limit != 0 && (wanted == 0 || wanted > limit) ? limit : wanted);
}
Profile::Limits DriveAxis::profile_limits() const noexcept {
    auto speed = objects_.profile_velocity;
    if (objects_.max_profile_velocity != 0) speed = std::min(speed, objects_.max_profile_velocity);
    return {std::min(speed * units_.speed, highest_speed()), acceleration(objects_.profile_acceleration),
            deceleration(objects_.profile_deceleration), 0};
}
/// Over which time the corners of a ramp are taken off, so that the steeper one keeps the jerk of 60A4h:1; 0: corners stay.
double DriveAxis::corner_time() const noexcept {
    const double jerk = objects_.profile_jerk * units_.acceleration;
    if (objects_.motion_profile_type != jerk_limited || !(jerk > 0)) return 0;
    return std::max(acceleration(objects_.profile_acceleration), deceleration(objects_.profile_deceleration)) / jerk;
}
/// What a ramp or profile is to move on. Where something else moved the reference meanwhile it begins anew from there.
Motion& DriveAxis::unsmoothed(bool position_matters) noexcept {
    Motion now = ref_;
    if (!position_matters) now.position = 0;
    const bool other = position_matters ? !smoother_.gave(now) : !smoother_.gave_velocity(now);
    if (other || (smoother_.settled() && smoother_.raw().velocity == 0 && smoother_.time() != std::min(corner_time(), Smoother::longest)))
        smoother_.begin(now, corner_time());
    return smoother_.raw();
}
double DriveAxis::period() const noexcept {
    double result = objects_.interpolation_period;
    for (int n = objects_.interpolation_exponent; n < 0; ++n) result /= 10;
    return result;
}

// Positions of the user have 32 bits, or the range of 607Bh, and go round; the axis goes on.

std::int32_t DriveAxis::shown(double encoder) const noexcept {
    const auto value = whole(user(encoder));
    const std::int64_t low = objects_.range_min, span = std::int64_t{objects_.range_max} - low + 1;
    if (span <= 1) return static_cast<std::int32_t>(value);
    const auto rest = (value - low) % span;
    return static_cast<std::int32_t>(low + (rest < 0 ? rest + span : rest));
}

double DriveAxis::absolute(std::int32_t target, double near) const noexcept {
    const double turn_start = std::round(user(near)) - shown(near);
    const double span = static_cast<double>(objects_.range_max) - objects_.range_min + 1;
    if (span <= 1) return encoder(turn_start + target);
    const double low = objects_.range_min, at = user(near);
    double wanted = turn_start + low + std::fmod(target - low, span);
    if (target < low) wanted += span;
    switch (objects_.positioning_option >> 6 & 3) {  // how a rotary axis goes there
    case 1: wanted -= wanted > at ? span : 0; break;
    case 2: wanted += wanted < at ? span : 0; break;
    case 3: wanted -= span * std::round((wanted - at) / span); break;
    default: break;
    }
    return encoder(wanted);
}

double DriveAxis::nearest(std::int32_t target, double near) const noexcept {
    const double span = static_cast<double>(objects_.range_max) - objects_.range_min + 1, round = span > 1 ? span : 4294967296.0;
    return encoder(target + round * std::round((user(near) - target) / round));
}

Range DriveAxis::software_limits() const noexcept {
    using Limits = std::numeric_limits<std::int32_t>;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto low = objects_.software_min, high = objects_.software_max;
    if (low >= high) return {-infinity, infinity};
    const double from = low == Limits::min() ? -infinity : low, to = high == Limits::max() ? infinity : high;
    return units_.position > 0 ? Range{encoder(from), encoder(to)} : Range{encoder(to), encoder(from)};
}

double DriveAxis::within_limits(double target) noexcept {
    const auto limits = software_limits();
    const double result = std::clamp(target, limits.from, limits.to);
    if (result != target) limited_ = true;
    return result;
}

bool DriveAxis::blocked(int direction) const noexcept {
    return (direction > 0 ? plant_.positive_limit() : plant_.negative_limit()).holds(plant_.place());
}

// What every mode uses.

void DriveAxis::follow() noexcept {
    loop_ = Control::off;
    ref_ = {measured_, now_speed(), 0};
    demand_before_ = measured_;
    torque_ref_ = 0;
    integral_ = 0;
}

void DriveAxis::take(Control loop) noexcept {
    if (loop == loop_) return;
    if (loop_ != Control::position) ref_.position = demand_before_ = measured_;
    if (loop_ == Control::off || loop_ == Control::torque) {
        ref_.velocity = standing() ? 0 : now_speed();
        integral_ = plant_.torque() / settings_.motor.inertia;
    }
    if (loop == Control::torque) torque_ref_ = plant_.torque();
    ref_.acceleration = 0;
    loop_ = loop;
}

bool DriveAxis::standing() const noexcept {
    const double threshold = objects_.velocity_threshold * units_.speed;
    return std::abs(now_speed()) <= (threshold > 0 ? threshold : settings_.motor.resolution / 100.0);
}

double DriveAxis::stop_rate(Stop stop) const noexcept {
    const auto vl = [&](const Ramp& r) { return turns(r.speed) / std::max<double>(r.time, 1) * settings_.motor.resolution; };
    double rate = 0;
    if (stop == Stop::quick_stop)
        rate = mode_ == Mode::velocity ? vl(objects_.vl_quick_stop) : deceleration(objects_.quick_stop_deceleration);
    else if (mode_ == Mode::velocity) rate = vl(objects_.vl_deceleration);
    else if (mode_ == Mode::homing) rate = deceleration(objects_.homing_acceleration);
    else rate = deceleration(objects_.profile_deceleration);
    return rate > 0 ? rate : settings_.motor.resolution * 1000.0;
}

bool DriveAxis::stop_step(Stop stop, double dt) noexcept {
    if (stop == Stop::current_limit || stop == Stop::voltage_limit) {  // as fast as the torque allows
        take(Control::velocity);
        ref_ = {measured_, 0, 0};
    } else {
        take(Control::position);
        ramp(ref_, 0, stop_rate(stop), stop_rate(stop), dt);
    }
    if (ref_.velocity != 0) return stop_time_ = still_time_ = 0, false;
    stop_time_ += dt;
    still_time_ = standing() ? still_time_ + dt : 0;
    return still_time_ * 1000 >= objects_.velocity_threshold_time || stop_time_ > 0.5;
}

void DriveAxis::select_mode() noexcept {
    const auto wanted = static_cast<Mode>(objects_.mode);
    // An SDO cannot ask for another; of a PDO it is not heard.
    if (wanted == mode_ || (wanted != Mode::none && (objects_.supported_modes & bit_of(wanted)) == 0)) return;
    mode_ = wanted;
    objects_.mode_display = objects_.mode;
    restart_mode();
}

void DriveAxis::restart_mode() noexcept {
    profile_.clear();
    set_points_.clear();
    records_.clear();
    interpolator_.hold(ref_.position);
    active_ = acknowledged_ = halted_ = has_target_ = fresh_ = reached_ = record_lost_ = false;
    guard_ = 0;
    edges_ = 0;
    last_target_ = measured_;
    homing_phase_ = HomingPhase::idle;
    following_time_ = reached_time_ = stop_time_ = still_time_ = 0;
}

void DriveAxis::make_reference(double dt) noexcept {
    demand_before_ = ref_.position;
    limited_ = false;
    if (!powered() || (state_ == State::fault_reaction_active && !stopping_)) return follow();
    if (release_left_ > 0) {  // the brake still holds
        take(Control::position);
        ref_ = {measured_, 0, 0};
        last_target_ = measured_;
    } else if (stopping_) {
        if (stop_step(stop_, dt)) {
            stopping_ = after_stop_ != State::unknown;  // enter() looks whether there was a ramp
            if (stopping_) enter(after_stop_);
            stop_time_ = 0;
            if (!powered()) follow();
        }
    } else if (state_ == State::operation_enabled) {
        mode_step(dt);
    } else {
        take(Control::position);
        ramp(ref_, 0, stop_rate(Stop::quick_stop), stop_rate(Stop::quick_stop), dt);
    }
}

void DriveAxis::mode_step(double dt) noexcept {
    const bool halt = (control_ & control::halt) != 0 && !cyclic();
    if (halt) {
        halted_ = true;
        if (mode_ == Mode::homing) search_.step(plant_, ref_.velocity, objects_.homing_zero_speed * units_.speed);
        if (mode_ == Mode::profile_position && (edges_ & control::new_set_point) != 0) accept_set_point();
        edges_ = 0;
        stop_step(static_cast<Stop>(objects_.halt_option), dt);
        return;
    }
    if (halted_) {
        halted_ = false;
        stop_time_ = 0;
        if (active_) start_set_point(active_set_point_);
        if (homing_phase_ == HomingPhase::back) go_back_home();
        interpolator_.hold(ref_.position);
    }
    const Motion before = ref_;
    switch (mode_) {
    case Mode::profile_position: profile_position(dt); break;
    case Mode::velocity: vl_velocity(dt); break;
    case Mode::profile_velocity: profile_velocity(dt); break;
    case Mode::profile_torque: profile_torque(dt); break;
    case Mode::homing: homing(dt); break;
    case Mode::interpolated_position: interpolated_position(dt); break;
    case Mode::cyclic_position: cyclic_position(dt); break;
    case Mode::cyclic_velocity: cyclic_velocity(dt); break;
    case Mode::cyclic_torque: cyclic_torque(dt); break;
    case Mode::none: stop_step(Stop::slow_down, dt); break;
    }
    edges_ = 0;
    if (mode_ != Mode::profile_position && mode_ != Mode::homing) guard_limits(before, dt);
}

void DriveAxis::guard_limits(const Motion& before, double dt) noexcept {
    const double rate = stop_rate(Stop::quick_stop);
    if (loop_ == Control::position) wanted_ = ref_.position - (guard_ != 0 ? guarded_.position : before.position);
    if (guard_ == 0) {
        // A set-point that is a position is within the software limits already; the others stop in time.
        const auto limits = loop_ == Control::position ? Range{-HUGE_VAL, HUGE_VAL} : software_limits();
        const double speed = now_speed(), way = 0.5 * speed * speed / rate;
        for (const int direction : {1, -1}) {
            const bool beyond = direction > 0 ? measured_ + (speed > 0 ? way : 0) >= limits.to
                                              : measured_ - (speed < 0 ? way : 0) <= limits.from;
            const bool heads = wanted_ * direction > 0 || (loop_ == Control::velocity && ref_.velocity * direction > 0);
            if (!heads || !(blocked(direction) || beyond)) continue;
            guard_ = direction;
            guarded_ = before;
            if (loop_ == Control::torque) guarded_.velocity = speed, integral_ = plant_.torque() / settings_.motor.inertia;
            if (loop_ != Control::position) guarded_.position = measured_;
        }
        if (guard_ == 0) return;
    } else if (wanted_ * guard_ <= 0 && guarded_.velocity == 0 && (loop_ != Control::position || wanted_ != 0)) {
        guard_ = 0;  // the set-point has gone back
        return;
    }
    limited_ = true;
    demand_before_ = guarded_.position;
    ramp(guarded_, 0, rate, rate, dt);
    loop_ = Control::position;
    ref_ = guarded_;
}

// Profile position.

void DriveAxis::accept_set_point() noexcept {
    if (acknowledged_) return;
    const bool immediately = (control_ & control::change_immediately) != 0, pending = active_ || set_points_.count != 0;
    if (!immediately && pending && set_points_.full()) return;
    SetPoint next{0, profile_limits()};
    next.limits.end_velocity = objects_.end_velocity * units_.speed;
    if ((control_ & control::relative) != 0) {
        const int option = objects_.positioning_option & 3;
        const double base = option == 1 ? ref_.position : option == 2 ? measured_ : last_target_;
        next.target = base + objects_.target_position * units_.position;
    } else {
        next.target = absolute(objects_.target_position, pending && !immediately ? last_target_ : ref_.position);
    }
    next.target = within_limits(next.target);
    last_target_ = next.target;
    acknowledged_ = true;
    if (immediately) set_points_.clear();
    if (immediately || !pending) {
        start_set_point(next);
        return;
    }
    set_points_.push(next);
    if ((control_ & control::change_on_set_point) == 0 || set_points_.count != 1 || halted_) return;
    // Through the present one without a stop, as fast as the next allows, if it goes on in the same direction.
    const double ahead = active_set_point_.target - unsmoothed(true).position, further = next.target - active_set_point_.target;
    if (ahead * further <= 0 || profile_.done()) return;
    active_set_point_.limits.end_velocity = std::min({active_set_point_.limits.velocity, next.limits.velocity,
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
    if ((edges_ & control::new_set_point) != 0) accept_set_point();
    if ((control_ & control::new_set_point) == 0 && !set_points_.full()) acknowledged_ = false;
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
    if (reached_ && set_points_.count != 0) start_next();
    Motion& raw = unsmoothed(true);
    double left = profile_.step(raw, dt);
    while (profile_.done() && active_set_point_.limits.end_velocity > 0 && set_points_.count != 0 && left > 0) {
        start_next();
        left = profile_.step(raw, left);
    }
    if (profile_.done()) raw.position += raw.velocity * left;  // with an end velocity and nothing after it, it goes on
    ref_ = smoother_.step(dt);
    if (!profile_.done() || (raw.velocity == 0 && !smoother_.settled())) return;
    const bool there = objects_.position_window == no_window ||
                       std::abs(active_set_point_.target - measured_) <= objects_.position_window * std::abs(units_.position);
    if (ref_.velocity == 0 && !there) reached_time_ = 0;
    else reached_time_ += dt;
    reached_ = reached_time_ * 1000 >= objects_.position_window_time || ref_.velocity != 0;
}

// Profile velocity, vl, profile torque.

void DriveAxis::profile_velocity(double dt) noexcept {
    take(Control::velocity);
    auto limits = profile_limits();
    limits.velocity = highest_speed();
    if (objects_.max_profile_velocity != 0) limits.velocity = std::min(limits.velocity, objects_.max_profile_velocity * units_.speed);
    const double target = std::clamp(objects_.target_velocity * units_.velocity, -limits.velocity, limits.velocity);
    if (target != objects_.target_velocity * units_.velocity) limited_ = true;
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
    const auto rate = [&](const Ramp& r) { return turns(r.speed) / std::max<double>(r.time, 1) * settings_.motor.resolution; };
    double wanted = static_cast<double>(objects_.vl_target) * objects_.vl_set_point_numerator / objects_.vl_set_point_denominator *
                    objects_.vl_dimension_numerator / objects_.vl_dimension_denominator;
    if (wanted != 0) {
        const double amount = std::clamp<double>(std::abs(wanted), objects_.vl_min, std::max(objects_.vl_min, objects_.vl_max));
        if (amount != std::abs(wanted)) limited_ = true;
        wanted = std::copysign(amount, wanted);
    }
    const double most = highest_speed();
    double target = std::clamp(turns(wanted) * settings_.motor.resolution * ((objects_.polarity & 0x40) != 0 ? -1 : 1), -most, most);
    if ((control_ & control::reference_ramp) == 0) target = 0;
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
    const double target = torque_of(objects_.target_torque), slope = torque_of(objects_.torque_slope);
    wanted_ = target;
    const double change = slope > 0 ? slope * dt : std::abs(target - torque_ref_);
    torque_ref_ += std::clamp(target - torque_ref_, -change, change);
    reached_ = torque_ref_ == target && std::abs(plant_.torque() - target) <= torque_of(20);
}

}  // namespace hal::canopen::cia402
