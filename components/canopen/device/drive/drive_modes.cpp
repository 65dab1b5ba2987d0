// SPDX-License-Identifier: MIT
// The next motion of the axis: stops, limits, and the selection of the mode. drive_profiles.cpp has
// the profile modes, drive_cyclic.cpp the modes that follow set-points of the master.
#include <algorithm>
#include <cmath>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

void DriveAxis::read_units() noexcept {
    const double increments =
        objects_.position_encoder.value() * objects_.gear.value() / objects_.feed.value();
    units_.speed = increments * objects_.velocity_factor.value();
    units_.acceleration = increments * objects_.acceleration_factor.value();
    units_.position = (objects_.polarity & 0x80) != 0 ? -increments : increments;
    units_.velocity = (objects_.polarity & 0x40) != 0 ? -units_.speed : units_.speed;
}

double DriveAxis::highest_speed() const noexcept {
    const double limit =
        objects_.max_motor_speed != 0
            ? std::min<double>(objects_.max_motor_speed, settings_.motor.highest_speed)
            : settings_.motor.highest_speed;
    return per_second(limit) * settings_.motor.resolution;
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
    if (objects_.max_profile_velocity != 0) {
        speed = std::min(speed, objects_.max_profile_velocity);
    }
    return {std::min(speed * units_.speed, highest_speed()),
            acceleration(objects_.profile_acceleration),
            deceleration(objects_.profile_deceleration), 0};
}
/// Returns the time over which the corners of a ramp are smoothed so that the steeper one keeps the
/// jerk of 60A4h:1; 0: not smoothed.
double DriveAxis::corner_time() const noexcept {
    const double jerk = objects_.profile_jerk * units_.acceleration;
    if (objects_.motion_profile_type != jerk_limited || !(jerk > 0)) return 0;
    return std::max(acceleration(objects_.profile_acceleration),
                    deceleration(objects_.profile_deceleration)) /
           jerk;
}
/// Returns the motion that a ramp or profile advances. Restarts it where something else has moved
/// the reference in between.
Motion& DriveAxis::unsmoothed(bool position_matters) noexcept {
    Motion now = ref_;
    if (!position_matters) {
        now.position = 0;
    }
    const bool other = position_matters ? !smoother_.gave(now) : !smoother_.gave_velocity(now);
    if (other || (smoother_.settled() && smoother_.raw().velocity == 0 &&
                  smoother_.time() != std::min(corner_time(), Smoother::longest))) {
        smoother_.begin(now, corner_time());
    }
    return smoother_.raw();
}
double DriveAxis::period() const noexcept {
    double result = objects_.interpolation_period;
    for (int n = objects_.interpolation_exponent; n < 0; ++n) {
        result /= 10;
    }
    return result;
}

// User positions have 32 bits, or the range of 607Bh, and wrap; the position of the axis does not.

std::int32_t DriveAxis::shown(double encoder) const noexcept {
    const auto value = whole(user(encoder));
    const std::int64_t low = objects_.range_min;
    const std::int64_t span = std::int64_t{objects_.range_max} - low + 1;
    if (span <= 1) return static_cast<std::int32_t>(value);
    const auto rest = (value - low) % span;
    return static_cast<std::int32_t>(low + (rest < 0 ? rest + span : rest));
}

double DriveAxis::absolute(std::int32_t target, double near) const noexcept {
    const double turn_start = std::round(user(near)) - shown(near);
    const double span = static_cast<double>(objects_.range_max) - objects_.range_min + 1;
    if (span <= 1) return encoder(turn_start + target);
    const double low = objects_.range_min;
    const double at = user(near);
    double wanted = turn_start + low + std::fmod(target - low, span);
    if (target < low) {
        wanted += span;
    }
    switch (objects_.positioning_option >> 6 & 3) {  // direction of a rotary axis
    case 1: wanted -= wanted > at ? span : 0; break;
    case 2: wanted += wanted < at ? span : 0; break;
    case 3: wanted -= span * std::round((wanted - at) / span); break;
    default: break;
    }
    return encoder(wanted);
}

double DriveAxis::nearest(std::int32_t target, double near) const noexcept {
    const double span = static_cast<double>(objects_.range_max) - objects_.range_min + 1,
                 round = span > 1 ? span : 4294967296.0;
    return encoder(target + round * std::round((user(near) - target) / round));
}

Range DriveAxis::software_limits() const noexcept {
    using Limits = std::numeric_limits<std::int32_t>;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto low = objects_.software_min;
    const auto high = objects_.software_max;
    if (low >= high) {
        return {-infinity, infinity};
    }
    const double from = low == Limits::min() ? -infinity : low;

    const double to = high == Limits::max() ? infinity : high;
    return units_.position > 0 ? Range{encoder(from), encoder(to)}
                               : Range{encoder(to), encoder(from)};
}

double DriveAxis::within_limits(double target) noexcept {
    const auto limits = software_limits();
    const double result = std::clamp(target, limits.from, limits.to);
    if (result != target) {
        limited_ = true;
    }
    return result;
}

bool DriveAxis::blocked(int direction) const noexcept {
    return (direction > 0 ? plant_.positive_limit() : plant_.negative_limit())
        .holds(plant_.place());
}

// Common to all modes.

void DriveAxis::follow() noexcept {
    loop_ = Control::off;
    ref_ = {measured_, now_speed(), 0};
    demand_before_ = measured_;
    torque_ref_ = 0;
    integral_ = 0;
}

void DriveAxis::take(Control loop) noexcept {
    if (loop == loop_) return;
    if (loop_ != Control::position) {
        ref_.position = demand_before_ = measured_;
    }
    if (loop_ == Control::off || loop_ == Control::torque) {
        ref_.velocity = standing() ? 0 : now_speed();
        integral_ = plant_.torque() / settings_.motor.inertia;
    }
    if (loop == Control::torque) {
        torque_ref_ = plant_.torque();
    }
    ref_.acceleration = 0;
    loop_ = loop;
}

bool DriveAxis::standing() const noexcept {
    const double threshold = objects_.velocity_threshold * units_.speed;
    return std::abs(now_speed()) <=
           (threshold > 0 ? threshold : settings_.motor.resolution / 100.0);
}

double DriveAxis::stop_rate(Stop stop) const noexcept {
    const auto vl = [&](const Ramp& r) {
        return per_second(r.speed) / std::max<double>(r.time, 1) * settings_.motor.resolution;
    };
    double rate = 0;
    if (stop == Stop::quick_stop) {
        rate = mode_ == Mode::velocity ? vl(objects_.vl_quick_stop)
                                       : deceleration(objects_.quick_stop_deceleration);
    } else if (mode_ == Mode::velocity) {
        rate = vl(objects_.vl_deceleration);
    } else if (mode_ == Mode::homing) {
        rate = deceleration(objects_.homing_acceleration);
    } else {
        rate = deceleration(objects_.profile_deceleration);
    }
    return rate > 0 ? rate : settings_.motor.resolution * 1000.0;
}

bool DriveAxis::stop_step(Stop stop, double dt) noexcept {
    if (stop == Stop::current_limit || stop == Stop::voltage_limit) {  // limited by the torque only
        take(Control::velocity);
        ref_ = {measured_, 0, 0};
    } else {
        take(Control::position);
        ramp(ref_, 0, stop_rate(stop), stop_rate(stop), dt);
    }
    if (ref_.velocity != 0) {
        stop_time_ = still_time_ = 0;
        return false;
    }
    stop_time_ += dt;
    still_time_ = standing() ? still_time_ + dt : 0;
    return still_time_ * 1000 >= objects_.velocity_threshold_time || stop_time_ > 0.5;
}

void DriveAxis::select_mode() noexcept {
    const auto wanted = static_cast<Mode>(objects_.mode);
    // An SDO with another mode is rejected; a PDO with one is ignored.
    if (wanted == mode_ ||
        (wanted != Mode::none && (objects_.supported_modes & bit_of(wanted)) == 0)) {
        return;
    }
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
    if (release_left_ > 0) {  // the brake is still closed
        take(Control::position);
        ref_ = {measured_, 0, 0};
        last_target_ = measured_;
    } else if (stopping_) {
        if (stop_step(stop_, dt)) {
            stopping_ = after_stop_ != State::unknown;  // enter() checks whether there was a ramp
            if (stopping_) {
                enter(after_stop_);
            }
            stop_time_ = 0;
            if (!powered()) {
                follow();
            }
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
        if (mode_ == Mode::homing) {
            search_.step(plant_, ref_.velocity, objects_.homing_zero_speed * units_.speed);
        }
        if (mode_ == Mode::profile_position && (edges_ & control::new_set_point) != 0) {
            accept_set_point();
        }
        edges_ = 0;
        stop_step(static_cast<Stop>(objects_.halt_option), dt);
        return;
    }
    if (halted_) {
        halted_ = false;
        stop_time_ = 0;
        if (active_) {
            start_set_point(active_set_point_);
        }
        if (homing_phase_ == HomingPhase::back) {
            go_back_home();
        }
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
    if (mode_ != Mode::profile_position && mode_ != Mode::homing) {
        guard_limits(before, dt);
    }
}

void DriveAxis::guard_limits(const Motion& before, double dt) noexcept {
    const double rate = stop_rate(Stop::quick_stop);
    if (loop_ == Control::position) {
        wanted_ = ref_.position - (guard_ != 0 ? guarded_.position : before.position);
    }
    if (guard_ == 0) {
        // Position set-points are within the software limits already; the other modes stop in time.
        const auto limits =
            loop_ == Control::position ? Range{-HUGE_VAL, HUGE_VAL} : software_limits();
        const double speed = now_speed();
        const double way = 0.5 * speed * speed / rate;
        for (const int direction : {1, -1}) {
            const bool beyond = direction > 0 ? measured_ + (speed > 0 ? way : 0) >= limits.to
                                              : measured_ - (speed < 0 ? way : 0) <= limits.from;
            const bool heads = wanted_ * direction > 0 ||
                               (loop_ == Control::velocity && ref_.velocity * direction > 0);
            if (!heads || !(blocked(direction) || beyond)) continue;
            guard_ = direction;
            guarded_ = before;
            if (loop_ == Control::torque) {
                guarded_.velocity = speed;
                integral_ = plant_.torque() / settings_.motor.inertia;
            }
            if (loop_ != Control::position) {
                guarded_.position = measured_;
            }
        }
        if (guard_ == 0) return;
    } else if (wanted_ * guard_ <= 0 && guarded_.velocity == 0 &&
               (loop_ != Control::position || wanted_ != 0)) {
        guard_ = 0;  // the set-point has reversed
        return;
    }
    limited_ = true;
    demand_before_ = guarded_.position;
    ramp(guarded_, 0, rate, rate, dt);
    loop_ = Control::position;
    ref_ = guarded_;
}

}  // namespace hal::canopen::cia402
