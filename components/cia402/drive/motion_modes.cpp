// SPDX-License-Identifier: MIT
#include "cia402/drive/motion_modes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hal::cia402 {

namespace {

constexpr double max_stop_time = 0.5;  // s, for an axis that is moved by its load

std::uint16_t when(bool on, std::uint16_t bit) noexcept { return on ? bit : std::uint16_t{0}; }

/// What the base of a relative set-point is, bits 1 and 0 of 60F2h.
enum class RelativeTo : std::uint8_t { last_target, demand, position };

}  // namespace

void MotionModes::power_up() noexcept {
    homed_ = false;
    mode_ = static_cast<Mode>(values_.mode);
    values_.mode_display = values_.mode;
}

bool MotionModes::select() noexcept {
    const auto requested = static_cast<Mode>(values_.mode);
    if (requested == mode_) return false;
    if (requested != Mode::none && (values_.supported_modes & bit_of(requested)) == 0) return false;
    mode_ = requested;
    values_.mode_display = values_.mode;
    return true;
}

void MotionModes::restart() noexcept {
    profile_.clear();
    set_points_.clear();
    records_.clear();
    interpolator_.hold(motion().position);
    active_ = acknowledged_ = halted_ = has_target_ = fresh_ = reached_ = record_lost_ = false;
    guard_ = 0;
    control_.edges = 0;
    last_target_ = train_.position();
    homing_phase_ = HomingPhase::idle;
    reached_time_ = stop_time_ = still_time_ = 0;
}

// Common to all modes.

/// Returns the motion that a ramp or profile advances. Restarts it where something else has moved
/// the reference in between.
Motion& MotionModes::unsmoothed(bool position_matters) noexcept {
    Motion now = motion();
    if (!position_matters) {
        now.position = 0;
    }
    const double corner = train_.scale().corner_time();
    const bool continues = position_matters ? smoother_.gave(now) : smoother_.gave_velocity(now);
    const bool stands = smoother_.settled() && smoother_.raw().velocity == 0;
    if (!continues || (stands && smoother_.time() != std::min(corner, Smoother::max_time))) {
        smoother_.begin(now, corner);
    }
    return smoother_.raw();
}

double MotionModes::stop_rate(Stop stop) const noexcept {
    const AxisScale& scale = train_.scale();
    double rate = 0;
    if (mode_ == Mode::velocity) {
        rate = scale.rate_of(stop == Stop::quick_stop ? values_.vl_quick_stop
                                                      : values_.vl_deceleration);
    } else if (stop == Stop::quick_stop) {
        rate = scale.deceleration(values_.quick_stop_deceleration);
    } else if (mode_ == Mode::homing) {
        rate = scale.deceleration(values_.homing_acceleration);
    } else {
        rate = scale.deceleration(values_.profile_deceleration);
    }
    return rate > 0 ? rate : train_.motor().resolution * 1000.0;
}

void MotionModes::ramp_to_zero(Stop stop, double dt) noexcept {
    train_.close(Control::position);
    const double rate = stop_rate(stop);
    ramp(motion(), 0, rate, rate, dt);
}

bool MotionModes::step_stop(Stop stop, double dt) noexcept {
    if (stop == Stop::current_limit || stop == Stop::voltage_limit) {  // limited by the torque only
        train_.close(Control::velocity);
        train_.hold();
    } else {
        ramp_to_zero(stop, dt);
    }
    if (motion().velocity != 0) {
        begin_stop();
        return false;
    }
    stop_time_ += dt;
    still_time_ = train_.standing() ? still_time_ + dt : 0;
    return still_time_ * 1000 >= values_.velocity_threshold_time || stop_time_ > max_stop_time;
}

void MotionModes::hold() noexcept {
    train_.close(Control::position);
    train_.hold();
    last_target_ = train_.position();
}

void MotionModes::step(double dt) noexcept {
    if (control_.has(control::halt) && !cyclic()) return step_halted(dt);
    if (halted_) {
        leave_halt();
    }
    const Motion before = motion();
    step_mode(dt);
    control_.edges = 0;
    if (mode_ != Mode::profile_position && mode_ != Mode::homing) {
        guard_limits(before, dt);
    }
}

void MotionModes::step_halted(double dt) noexcept {
    halted_ = true;
    if (mode_ == Mode::homing) {
        search_.step(train_.plant(), motion().velocity,
                     values_.homing_zero_speed * train_.scale().speed());
    }
    if (mode_ == Mode::profile_position && control_.rose(control::new_set_point)) {
        accept_set_point();
    }
    control_.edges = 0;
    step_stop(static_cast<Stop>(values_.halt_option), dt);
}

void MotionModes::leave_halt() noexcept {
    halted_ = false;
    stop_time_ = 0;
    if (active_) {
        start_set_point(active_set_point_);
    }
    if (homing_phase_ == HomingPhase::back) {
        go_back_home();
    }
    interpolator_.hold(motion().position);
}

void MotionModes::step_mode(double dt) noexcept {
    switch (mode_) {
    case Mode::profile_position: return profile_position(dt);
    case Mode::velocity: return vl_velocity(dt);
    case Mode::profile_velocity: return profile_velocity(dt);
    case Mode::profile_torque: return profile_torque(dt);
    case Mode::homing: return homing(dt);
    case Mode::interpolated_position: return interpolated_position(dt);
    case Mode::cyclic_position: return cyclic_position(dt);
    case Mode::cyclic_velocity: return cyclic_velocity(dt);
    case Mode::cyclic_torque: return cyclic_torque(dt);
    case Mode::none: step_stop(Stop::slow_down, dt); return;
    }
}

std::uint16_t MotionModes::status_bits(const Monitored& monitored) const noexcept {
    using namespace status;
    unsigned bits = when(reached_, target_reached);
    const bool follows = has_target_ && guard_ == 0;
    switch (mode_) {
    case Mode::profile_position: {
        const bool idle = train_.reference.motion.velocity == 0 && train_.standing();
        // For a set of set-points the last one counts.
        const bool there = active_ ? reached_ && set_points_.empty() : idle;
        bits = when(there, target_reached) | when(acknowledged_, set_point_acknowledge) |
               when(monitored.following_error, following_error);
        break;
    }
    case Mode::profile_velocity:
        bits |= when(monitored.speed_zero, speed_is_zero) | when(monitored.slipping, max_slippage);
        break;
    case Mode::profile_torque: break;
    case Mode::homing: {
        const bool attained =
            homing_phase_ == HomingPhase::back || homing_phase_ == HomingPhase::done;
        bits |= when(attained, homing_attained) |
                when(homing_phase_ == HomingPhase::error, homing_error);
        break;
    }
    case Mode::interpolated_position: bits |= when(active_, interpolation_active); break;
    case Mode::cyclic_position:
        bits = when(follows, follows_command) | when(monitored.following_error, following_error);
        break;
    case Mode::cyclic_velocity:
    case Mode::cyclic_torque: bits = when(follows, follows_command); break;
    case Mode::velocity:
    case Mode::none: bits = 0; break;
    }
    if (halted_ && !cyclic()) {
        bits &= ~unsigned{target_reached};
        bits |= when(still_time_ > 0, target_reached);
    }
    return static_cast<std::uint16_t>(bits);
}

// Profile position.

void MotionModes::accept_set_point() noexcept {
    if (acknowledged_) return;
    const bool immediately = control_.has(control::change_immediately);
    const bool pending = active_ || !set_points_.empty();
    if (!immediately && pending && set_points_.full()) return;
    SetPoint next{requested_target(immediately, pending), train_.scale().profile_limits()};
    next.limits.end_velocity = values_.end_velocity * train_.scale().speed();
    next.target = train_.within_limits(next.target);
    last_target_ = next.target;
    acknowledged_ = true;
    if (immediately) {
        set_points_.clear();
    }
    if (immediately || !pending) return start_set_point(next);
    set_points_.push(next);
    const bool passes = control_.has(control::change_on_set_point);
    if (passes && set_points_.size() == 1 && !halted_) {
        pass_without_stop(next);
    }
}

double MotionModes::requested_target(bool immediately, bool pending) const noexcept {
    const double demand = train_.reference.motion.position;
    if (!control_.has(control::relative)) {
        const double near = pending && !immediately ? last_target_ : demand;
        return train_.scale().absolute(values_.target_position, near);
    }
    const double way = values_.target_position * train_.scale().position();
    switch (static_cast<RelativeTo>(values_.positioning_option & 3)) {
    case RelativeTo::demand: return demand + way;
    case RelativeTo::position: return train_.position() + way;
    case RelativeTo::last_target: break;
    }
    return last_target_ + way;
}

/// Passes the present target as fast as the next allows, if the direction is the same.
void MotionModes::pass_without_stop(const SetPoint& next) noexcept {
    const double ahead = active_set_point_.target - unsmoothed(true).position;
    const double further = next.target - active_set_point_.target;
    if (ahead * further <= 0 || profile_.done()) return;
    active_set_point_.limits.end_velocity =
        std::min({active_set_point_.limits.velocity, next.limits.velocity,
                  std::sqrt(2 * next.limits.deceleration * std::abs(further))});
    profile_.plan(unsmoothed(true), active_set_point_.target, active_set_point_.limits);
}

void MotionModes::start_set_point(const SetPoint& next) noexcept {
    active_set_point_ = next;
    active_ = true;
    reached_ = false;
    reached_time_ = 0;
    train_.close(Control::position);
    profile_.plan(unsmoothed(true), next.target, next.limits);
}

void MotionModes::profile_position(double dt) noexcept {
    if (control_.rose(control::new_set_point)) {
        accept_set_point();
    }
    if (!control_.has(control::new_set_point) && !set_points_.full()) {
        acknowledged_ = false;
    }
    train_.close(Control::position);
    const double velocity = motion().velocity;
    if (velocity != 0 && train_.blocked(velocity > 0 ? 1 : -1)) {
        profile_.clear();
        set_points_.clear();
        active_ = false;
        train_.reference.limited = true;
    }
    if (!active_) {
        return ramp_to_zero(train_.reference.limited ? Stop::quick_stop : Stop::slow_down, dt);
    }
    follow_set_points(dt);
    watch_arrival(dt);
}

void MotionModes::follow_set_points(double dt) noexcept {
    if (reached_ && !set_points_.empty()) {
        start_set_point(set_points_.pop());
    }
    Motion& raw = unsmoothed(true);
    double left = profile_.step(raw, dt);
    while (profile_.done() && active_set_point_.limits.end_velocity > 0 && !set_points_.empty() &&
           left > 0) {
        start_set_point(set_points_.pop());
        left = profile_.step(raw, left);
    }
    // with an end velocity and no further set-point, it keeps moving
    if (profile_.done()) {
        raw.position += raw.velocity * left;
    }
    motion() = smoother_.step(dt);
}

void MotionModes::watch_arrival(double dt) noexcept {
    const bool rests = smoother_.raw().velocity == 0;
    if (!profile_.done() || (rests && !smoother_.settled())) return;
    const double distance = std::abs(active_set_point_.target - train_.position());
    const bool there = values_.position_window == no_window ||
                       distance <= values_.position_window * std::abs(train_.scale().position());
    const bool passes = motion().velocity != 0;
    reached_time_ = there || passes ? reached_time_ + dt : 0;
    reached_ = reached_time_ * 1000 >= values_.position_window_time || passes;
}

// Profile velocity, vl, profile torque.

void MotionModes::profile_velocity(double dt) noexcept {
    train_.close(Control::velocity);
    const AxisScale& scale = train_.scale();
    const auto limits = scale.profile_limits();
    double max = scale.max_speed();
    if (values_.max_profile_velocity != 0) {
        max = std::min(max, values_.max_profile_velocity * scale.speed());
    }
    const double requested = values_.target_velocity * scale.velocity();
    const double target = std::clamp(requested, -max, max);
    if (target != requested) {
        train_.reference.limited = true;
    }
    requested_ = target;
    ramp(unsmoothed(false), target, limits.acceleration, limits.deceleration, dt);
    const Motion from = motion();
    motion() = smoother_.step(dt);
    motion().position = from.position + (from.velocity + motion().velocity) / 2 * dt;
    const double window = values_.velocity_window * scale.speed();
    reached_time_ = std::abs(target - train_.speed()) <= window ? reached_time_ + dt : 0;
    reached_ = reached_time_ * 1000 >= values_.velocity_window_time && reached_time_ > 0;
}

/// Returns the requested speed of vl within its limits, increments/s.
double MotionModes::vl_request() noexcept {
    double speed = static_cast<double>(values_.vl_target) * values_.vl_set_point_numerator /
                   values_.vl_set_point_denominator * values_.vl_dimension_numerator /
                   values_.vl_dimension_denominator;
    if (speed != 0) {
        const double amount = std::clamp<double>(std::abs(speed), values_.vl_min,
                                                 std::max(values_.vl_min, values_.vl_max));
        if (amount != std::abs(speed)) {
            train_.reference.limited = true;
        }
        speed = std::copysign(amount, speed);
    }
    const double max = train_.scale().max_speed();
    const int sign = (values_.polarity & 0x40) != 0 ? -1 : 1;
    return std::clamp(per_second(speed) * train_.motor().resolution * sign, -max, max);
}

void MotionModes::vl_velocity(double dt) noexcept {
    train_.close(Control::velocity);
    const AxisScale& scale = train_.scale();
    double target = vl_request();
    if (!control_.has(control::reference_ramp)) {
        target = 0;
    }
    requested_ = target;
    if (!control_.has(control::enable_ramp)) {
        const double rate = scale.rate_of(values_.vl_quick_stop);
        ramp(motion(), 0, rate, rate, dt);
    } else if (control_.has(control::unlock_ramp)) {
        ramp(motion(), target, scale.rate_of(values_.vl_acceleration),
             scale.rate_of(values_.vl_deceleration), dt);
    } else {
        motion().acceleration = 0;
    }
    reached_ = motion().velocity == target;
}

void MotionModes::profile_torque(double dt) noexcept {
    train_.close(Control::torque);
    const AxisScale& scale = train_.scale();
    double& torque = train_.reference.torque;
    const double target = scale.torque(values_.target_torque);
    const double slope = scale.torque(values_.torque_slope);
    requested_ = target;
    const double change = slope > 0 ? slope * dt : std::abs(target - torque);
    torque += std::clamp(target - torque, -change, change);
    reached_ = torque == target && std::abs(train_.plant().torque() - target) <= scale.torque(20);
}

// Modes that follow the set-points of a master.

void MotionModes::record_written() noexcept {
    if (mode_ != Mode::interpolated_position) return;
    // by a PDO; an SDO is rejected
    if (records_full()) {
        record_lost_ = true;
    } else {
        records_.push(values_.interpolation_record);
    }
}

void MotionModes::clear_records() noexcept {
    records_.clear();
    record_lost_ = false;
}

void MotionModes::interpolated_position(double dt) noexcept {
    train_.close(Control::position);
    const bool enabled = control_.has(control::enable_interpolation);
    active_ = active_ && enabled;
    if (enabled && (active_ || !records_.empty())) return follow_records(dt);
    if (motion().velocity != 0) {
        ramp_to_zero(Stop::slow_down, dt);
    }
    interpolator_.hold(motion().position);
    active_ = enabled;
    reached_ = false;
}

void MotionModes::follow_records(double dt) noexcept {
    active_ = true;
    const double start = motion().position;
    for (double left = dt; left > 0;) {
        if (interpolator_.arrived()) {
            if (records_.empty()) break;
            const double at = motion().position;
            const double target = train_.scale().nearest(records_.pop(), at);
            interpolator_.next(at, train_.within_limits(target), train_.scale().period());
        }
        left = interpolator_.step(motion(), left);
    }
    values_.buffer_position = static_cast<std::uint16_t>(records_.size());
    motion().velocity = (motion().position - start) / dt;
    reached_ = interpolator_.arrived() && records_.empty();
}

/// Returns true once for a set-point that was written.
bool MotionModes::accept_fresh() noexcept {
    if (!fresh_) return false;
    fresh_ = false;
    has_target_ = true;
    return true;
}

void MotionModes::cyclic_position(double dt) noexcept {
    train_.close(Control::position);
    if (accept_fresh()) {
        const AxisScale& scale = train_.scale();
        const double target = scale.nearest(values_.target_position, motion().position) +
                              values_.position_offset * scale.position();
        interpolator_.next(motion().position, target, scale.period());
    }
    // The axis holds until the first set-point after enabling: the value in 607Ah may be stale.
    if (!has_target_) return ramp_to_zero(Stop::slow_down, dt);
    interpolator_.step(motion(), dt);
    const double inside = train_.within_limits(motion().position);
    if (inside != motion().position) {
        motion().position = inside;
        motion().velocity = (inside - train_.reference.start) / dt;
    }
}

void MotionModes::cyclic_velocity(double dt) noexcept {
    train_.close(Control::velocity);
    if (accept_fresh()) {
        const AxisScale& scale = train_.scale();
        const double max = scale.max_speed();
        requested_ = (static_cast<double>(values_.target_velocity) + values_.velocity_offset) *
                     scale.velocity();
        interpolator_.next(motion().velocity, std::clamp(requested_, -max, max), scale.period());
    }
    if (!has_target_) {
        const double rate = stop_rate(Stop::slow_down);
        return ramp(motion(), 0, rate, rate, dt);
    }
    Motion speed{motion().velocity, 0, 0};
    interpolator_.step(speed, dt);
    motion().velocity = speed.position;
    motion().acceleration = speed.velocity;
}

void MotionModes::cyclic_torque(double dt) noexcept {
    train_.close(Control::torque);
    double& reference = train_.reference.torque;
    if (accept_fresh()) {
        const AxisScale& scale = train_.scale();
        requested_ =
            scale.torque(static_cast<double>(values_.target_torque) + values_.torque_offset);
        interpolator_.next(reference, requested_, scale.period());
    }
    if (!has_target_) {
        reference = 0;
        return;
    }
    Motion torque{reference, 0, 0};
    interpolator_.step(torque, dt);
    reference = torque.position;
}

// Homing.

void MotionModes::go_back_home() noexcept {
    const double rate = stop_rate(Stop::slow_down);
    const double slow = values_.homing_zero_speed * train_.scale().speed();
    const double velocity = slow > 0 ? std::min(slow, train_.scale().max_speed()) : 1;
    profile_.plan(motion(), last_target_, {velocity, rate, rate, 0});
}

/// Starts the search. Returns false for a method that needs a speed that is 0.
bool MotionModes::can_home(double fast, double slow) noexcept {
    const int method = values_.homing_method;
    const bool moves = method < 35;
    const bool searches = method < 33;
    if (!search_.begin(method, train_.plant())) return false;
    return (!moves || slow > 0) && (!searches || fast > 0);
}

/// Returns the velocity of the next step of the search.
double MotionModes::search_velocity(double fast, double slow) noexcept {
    const auto order = search_.step(train_.plant(), motion().velocity, slow);
    switch (order.act) {
    case HomingSearch::Act::fast: return order.direction * fast;
    case HomingSearch::Act::slow: return order.direction * slow;
    case HomingSearch::Act::failed: homing_phase_ = HomingPhase::error; break;
    case HomingSearch::Act::stop_at_home: found_home(); break;
    }
    return 0;
}

void MotionModes::found_home() noexcept {
    const double home = search_.home() - train_.encoder_zero();
    train_.scale().set_origin(home - values_.home_offset * train_.scale().position());
    homed_ = true;
    homing_phase_ = HomingPhase::back;
    last_target_ = home;
    go_back_home();
}

void MotionModes::homing(double dt) noexcept {
    train_.close(Control::position);
    const AxisScale& scale = train_.scale();
    const double rate = stop_rate(Stop::slow_down);
    const double max = scale.max_speed();
    const double fast = std::min(values_.homing_switch_speed * scale.speed(), max);
    const double slow = std::min(values_.homing_zero_speed * scale.speed(), max);
    const bool was_moving = homing_moves();
    if (!control_.has(control::start_homing) && was_moving) {
        homing_phase_ = HomingPhase::idle;
    }
    if (control_.rose(control::start_homing) && !was_moving) {
        homing_phase_ = can_home(fast, slow) ? HomingPhase::search : HomingPhase::error;
    }
    reached_ = false;
    double velocity = 0;
    if (homing_phase_ == HomingPhase::search) {
        velocity = search_velocity(fast, slow);
    }
    if (homing_phase_ == HomingPhase::back) {
        profile_.step(motion(), dt);
        const double window = std::max(1.0, values_.position_window * std::abs(scale.position()));
        const bool there = std::abs(last_target_ - train_.position()) <= window;
        if (!profile_.done() || !there || !train_.standing()) return;
        homing_phase_ = HomingPhase::done;
    }
    ramp(motion(), velocity, rate, rate, dt);
    reached_ = homing_phase_ != HomingPhase::search && motion().velocity == 0 && train_.standing();
}

// Limit switches and software limits, outside of profile position and homing.

/// Returns the direction in which the axis heads for a limit, 0 for none.
int MotionModes::limit_ahead(double rate) const noexcept {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Control control = train_.reference.control;
    // Position set-points are within the software limits already; the other modes stop in time.
    const auto limits = control == Control::position ? Range{-infinity, infinity}
                                                     : train_.scale().software_limits();
    const double speed = train_.speed();
    const double braking = 0.5 * speed * speed / rate;
    const double furthest = train_.position() + (speed > 0 ? braking : 0);
    const double nearest = train_.position() - (speed < 0 ? braking : 0);
    int found = 0;
    for (const int direction : {1, -1}) {
        const bool beyond = direction > 0 ? furthest >= limits.to : nearest <= limits.from;
        const bool moves =
            control == Control::velocity && train_.reference.motion.velocity * direction > 0;
        const bool heads = requested_ * direction > 0 || moves;
        if (heads && (train_.blocked(direction) || beyond)) {
            found = direction;
        }
    }
    return found;
}

void MotionModes::begin_guard(int direction, const Motion& before) noexcept {
    guard_ = direction;
    guarded_ = before;
    if (train_.reference.control == Control::torque) {
        guarded_.velocity = train_.speed();
        train_.keep_torque();
    }
    if (train_.reference.control != Control::position) {
        guarded_.position = train_.position();
    }
}

void MotionModes::guard_limits(const Motion& before, double dt) noexcept {
    const double rate = stop_rate(Stop::quick_stop);
    Reference& reference = train_.reference;
    const bool by_position = reference.control == Control::position;
    if (by_position) {
        requested_ = reference.motion.position - (guard_ != 0 ? guarded_ : before).position;
    }
    if (guard_ == 0) {
        const int direction = limit_ahead(rate);
        if (direction == 0) return;
        begin_guard(direction, before);
    } else if (requested_ * guard_ <= 0 && guarded_.velocity == 0 &&
               (!by_position || requested_ != 0)) {
        guard_ = 0;  // the set-point has reversed
        return;
    }
    reference.limited = true;
    reference.start = guarded_.position;
    ramp(guarded_, 0, rate, rate, dt);
    reference.control = Control::position;
    reference.motion = guarded_;
}

}  // namespace hal::cia402
