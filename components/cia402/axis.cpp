// SPDX-License-Identifier: MIT
#include "axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hal::cia402 {

namespace {

constexpr double farthest_count = 4e18;        // of a position that does not wrap
// for so many cycles the display in flight may be the old one
constexpr unsigned mode_change_cycles = 3;
// after a stop, the feedback may be from before it during this time
constexpr Time restart_window = one_second;

bool in_fault(State s) noexcept { return s == State::fault || s == State::fault_reaction_active; }
bool by_position(Mode m) noexcept {
    return m == Mode::cyclic_position || m == Mode::interpolated_position;
}
bool by_velocity(Mode m) noexcept {
    return m == Mode::profile_velocity || m == Mode::velocity || m == Mode::cyclic_velocity;
}
bool by_torque(Mode m) noexcept { return m == Mode::profile_torque || m == Mode::cyclic_torque; }
/// Returns true for modes with a halt bit (bit 8).
bool can_halt(Mode m) noexcept {
    return m != Mode::cyclic_position && m != Mode::cyclic_velocity && m != Mode::cyclic_torque;
}

/// Returns half the range of a counter with `bits` valid bits; 0 and more than 32 count as 32.
double half_range(unsigned bits) noexcept {
    const bool is_whole = bits == 0 || bits > 32;
    return std::ldexp(1.0, is_whole ? 31 : static_cast<int>(bits) - 1);
}

/// Returns true for a count that is half the range of the counter away from another one, or more:
/// the counter shows the same for both directions. Also for NaN.
bool is_ambiguous(double count, double from, unsigned bits) noexcept {
    return !(std::fabs(count - from) < half_range(bits));
}

/// Falls smoothly from 1 to 0 while x goes from 0 to 1.
double falling(double x) noexcept { return x >= 1.0 ? 0.0 : 1.0 - x * x * (3.0 - 2.0 * x); }

}  // namespace

void Axis::fail(Cause cause, Request request) noexcept {
    failure_ = {};
    failure_.cause = cause;
    failure_.request = request;
    failure_.state = walk_.state();
    failure_.statusword = in_.statusword;
    failure_.error_code = in_.error_code;
    failure_.mode = orders_.mode;
    failure_.shown = in_.mode;
    wanted_ = false;
}

void Axis::fail(Cause cause, double value, double limit) noexcept {
    fail(cause, Request::run);
    failure_.value = value;
    failure_.limit = limit;
}

const AxisOrders& Axis::act(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    follow_restart(now);
    decide(command, rules);
    walk(command, rules, now);
    select_mode(command, rules, now);
    home(command, rules, now);
    if (enabled_ && !disable_sent_) {  // seen disabled, then enabled: the feedback is new
        restart_ = Restart::no;
    }
    active_ = enabled_ && mode_shown_ && home_ == Home::no;
    move(command, rules, now);
    if (failure_) {
        stop_now(command, rules, now);
        enabled_ = active_ = false;
    }
    was_enable_ = command.enable;
    was_reset_ = command.reset;
    was_home_ = command.home;
    was_operational_ = in_.operational;
    return orders_;
}

/// Commands the drive to stop in the cycle that found a failure, after its state machine was
/// stepped for an axis without one.
void Axis::stop_now(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    if (!in_.operational || walk_.wanted() != State::operation_enabled) return;
    want_state(state_of(in_.statusword), command.quick_stop);
    orders_.controlword = walk_.step(in_.statusword, in_.error_code, now, rules.limits);
}

void Axis::set_missing(Cause half) noexcept {
    if (half == missing_) return;
    if (failed_while_off_ && failure_.cause == missing_) {
        failure_ = {};
    }
    missing_ = half;
    failed_while_off_ = false;
    if (half != Cause::none && !failure_) {
        failed_while_off_ = !wanted_ && !enabled_;
        fail(half, Request::run);
    }
}

void Axis::interrupt() noexcept {
    wanted_ = enabled_ = active_ = following_ = holds_target_ = false;
    restart_ = Restart::pending;
    home_ = Home::no;
    set_points_.clear();
    walk_.restart_timeout();
}

void Axis::follow_restart(Time now) noexcept {
    if (restart_ == Restart::pending) {
        restart_ = Restart::recent;
        restarted_at_ = now;
        // The outputs of a stopped thread disable the drive, which may still be braking.
        note_disable(now);
    } else if (restart_ == Restart::recent && now - restarted_at_ >= restart_window) {
        restart_ = Restart::no;
    }
}

/// Updates position, velocity and torque in user units; without a node they keep their values.
void Axis::observe(const AxisFeedback& in, const AxisRules& rules, Time now) noexcept {
    in_ = in;
    const double dt =
        started_ ? static_cast<double>(now - last_) / static_cast<double>(one_second) : 0.0;
    last_ = now;
    started_ = true;
    if (!in.operational || !rules.position.sound()) {
        velocity_ = torque_ = 0.0;
        return;
    }
    const bool continues = counter_.known() && !jumped_;
    counter_.follow(in.position, rules.counter_bits);
    const double before = position_;
    position_ = rules.position.to_user(static_cast<double>(counter_.count()));
    last_position_ = continues ? before : position_;
    jumped_ = false;
    if (in.has_vl_velocity && in.mode == Mode::velocity && rules.vl.sound()) {
        velocity_ = rules.vl.to_user(in.vl_velocity);
    } else if (in.has_velocity && rules.velocity.sound()) {
        velocity_ = rules.velocity.to_user(in.velocity);
    } else {
        velocity_ = dt > 0.0 ? (position_ - last_position_) / dt : 0.0;
    }
    torque_ = rules.torque.sound() ? rules.torque.to_user(in.torque) : 0.0;
}

/// Returns the first factor that is 0 or no number; nullptr: all are sound.
static const Factor* unsound_factor(const AxisRules& rules) noexcept {
    for (const Factor* factor :
         {&rules.position, &rules.velocity, &rules.acceleration, &rules.torque, &rules.vl}) {
        if (!factor->sound()) return factor;
    }
    return nullptr;
}

/// Returns the limit of a supervision that is negative; 0: none is.
static double negative_limit(const AxisRules& rules) noexcept {
    return std::min({rules.max_step, rules.max_following_error, 0.0});
}

/// Decides whether the axis is to be enabled.
void Axis::decide(const AxisCommand& command, const AxisRules& rules) noexcept {
    const bool whole = missing_ == Cause::none;
    const bool enable_edge = command.enable && !was_enable_ && whole;
    const bool reset_edge = command.reset && !was_reset_ && whole;
    if (reset_edge || (enable_edge && rules.auto_reset)) {
        failure_ = {};
        if (in_.operational && in_fault(state_of(in_.statusword))) {
            walk_.reset_fault();
        }
    }
    if (enable_edge && !failure_) {
        request_enable(rules);
    }
    if (!command.enable || command.quick_stop || !whole) {
        wanted_ = false;
    }
    if (!in_.operational) {
        lose_drive();
    }
}

void Axis::request_enable(const AxisRules& rules) noexcept {
    wanted_ = true;
    if (const Factor* const factor = unsound_factor(rules)) {
        fail(Cause::bad_factor, Request::enable);
        failure_.value = factor->ratio();
    } else if (const double limit = negative_limit(rules); limit < 0.0) {
        fail(Cause::bad_limit, Request::enable);
        failure_.value = limit;
    }
}

/// The loss of a drive that the axis uses is a failure, except while the bus returns from a stop.
void Axis::lose_drive() noexcept {
    if (wanted_ && was_operational_ && restart_ == Restart::no) {
        fail(Cause::lost, enabled_ ? Request::run : Request::enable);
    }
    restart_ = Restart::no;
    homed_ = false;
}

/// Notes that the drive is commanded off, and may not have executed it yet.
void Axis::note_disable(Time now) noexcept {
    disable_sent_ = true;
    disable_sent_at_ = now;
}

void Axis::walk(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    if (!in_.operational) {
        // Its feedback is lost; it may still receive. A quick stop brakes, and enables nothing.
        walk_.want(State::switch_on_disabled, Request::disable);
        enabled_ = false;
        orders_.controlword = command::quick_stop;
        note_disable(now);
        return;
    }
    const State state = state_of(in_.statusword);
    watch_enabled(state, rules, now);
    want_state(state, command.quick_stop);
    orders_.controlword = walk_.step(in_.statusword, in_.error_code, now, rules.limits);
    take_failures(state);
    const bool was_enabled = std::exchange(enabled_, wanted_ && walk_.reached());
    if (enabled_ && !was_enabled) {
        holds_target_ = false;
    }
}

/// Fails when an enabled drive left operation enabled by itself.
void Axis::watch_enabled(State state, const AxisRules& rules, Time now) noexcept {
    const State before = walk_.state();
    // The drive may still be executing the disable command from before this enabling.
    const bool late = disable_sent_ && now - disable_sent_at_ < rules.limits.step;
    if (enabled_ && wanted_ && state != State::operation_enabled && (in_fault(state) || !late)) {
        fail(in_fault(state) ? Cause::drive_fault : Cause::left, Request::run);
        failure_.state = state;
        failure_.before = before;
    }
    if (state != State::operation_enabled) {
        disable_sent_ = false;
    } else if (!wanted_) {
        note_disable(now);
    }
}

/// Gives the state machine the state that the drive is to reach.
void Axis::want_state(State state, bool quick_stop) noexcept {
    const bool powered = state == State::operation_enabled || state == State::quick_stop_active;
    const bool failed_in_motion =
        state == State::operation_enabled && failure_ && failure_.cause != Cause::not_enabled;
    if (wanted_) {
        walk_.want(State::operation_enabled, Request::enable);
    } else if ((powered && quick_stop) || failed_in_motion) {
        walk_.want(State::quick_stop_active, Request::quick_stop);
    } else {
        walk_.want(State::switch_on_disabled, quick_stop ? Request::quick_stop : Request::disable);
    }
}

/// Takes over the failures of the state machine, and faults of a drive that was off.
void Axis::take_failures(State state) noexcept {
    if (walk_.failure() && !failure_) {
        adopt_failure(walk_.failure());
    }
    if (state == State::fault && !failure_ && !walk_.resetting() && !wanted_) {
        fail(Cause::drive_fault, Request::enable);
    }
    if (failure_.cause == Cause::drive_fault && failure_.error_code == 0 && in_fault(state)) {
        failure_.error_code = in_.error_code;  // received later than the statusword
    }
}

/// Commands the mode and checks that the drive displays it.
void Axis::select_mode(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    const bool homing = home_ == Home::entering || home_ == Home::running;
    Mode wanted = command.mode != Mode::none ? command.mode : in_.mode;
    if (homing) {
        wanted = Mode::homing;
    }
    if (wanted != orders_.mode) {
        mode_since_ = now;
    }
    orders_.mode = wanted;
    mode_shown_ = !in_.has_mode || in_.mode == wanted;
    if (mode_shown_ || !enabled_) {
        mode_since_ = now;
    } else if (now - mode_since_ >= rules.limits.step && !failure_) {
        fail(Cause::mode_rejected, Request::mode);
        failure_.after = now - mode_since_;
    }
}

void Axis::home(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    if (command.home && !was_home_) {
        request_homing();
    }
    if (!enabled_) {
        home_ = Home::no;
    }
    ++home_cycles_;
    // for some cycles the displayed mode in flight may be the old one
    const bool shown = mode_shown_ && home_cycles_ > mode_change_cycles;
    switch (home_) {
    case Home::no: return;
    case Home::leaving:
        if (shown) {
            home_ = Home::no;
        }
        return;
    case Home::entering:
        if (!command.home) return leave_homing();
        if (orders_.mode != Mode::homing || !shown) return;
        home_ = Home::running;
        homing_run_.begin();
        break;
    case Home::running:
        if (!command.home) return leave_homing();
        break;
    }
    run_homing(command, rules, now);
}

void Axis::request_homing() noexcept {
    if (enabled_) {
        home_ = Home::entering;
        home_cycles_ = 0;
        homed_ = false;
    } else if (!failure_) {
        fail(Cause::not_enabled, Request::home);
    }
}

void Axis::leave_homing() noexcept {
    home_ = Home::leaving;
    home_cycles_ = 0;
}

void Axis::run_homing(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    switch (homing_run_.step(in_.statusword, command.halt, now, rules.limits.step, rules.homing)) {
    case HomingRun::Result::running: orders_.controlword |= control::start_homing; break;
    case HomingRun::Result::attained:
        homed_ = jumped_ = true;
        counter_.put(in_.position);
        position_ = rules.position.to_user(static_cast<double>(counter_.count()));
        leave_homing();
        break;
    case HomingRun::Result::failed:
        adopt_failure(homing_run_.failure());
        home_ = Home::no;
        break;
    }
}

/// Takes over the failure of a part.
void Axis::adopt_failure(const Failure& failure) noexcept {
    failure_ = failure;
    wanted_ = false;
}

/// Returns true for a position that is beyond the counter, or not a number.
bool Axis::is_too_far(double position, const AxisRules& rules) noexcept {
    return !(std::fabs(position * rules.position.ratio()) < farthest_count);
}

/// Fails because of a step of the command; of the first one when the axis was to be enabled.
void Axis::reject_step(double step, double max_step) noexcept {
    fail(Cause::step_rejected, step, max_step);
    if (following_) return;
    failure_.request = Request::enable;
    failure_.step = Step::enable_operation;
}

/// Follows the position command in csp and ip, after blending out its distance from the axis at
/// enabling.
void Axis::follow_position(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    const double asked = command.position;
    if (is_too_far(asked, rules)) return fail(Cause::bad_command, asked, 0.0);
    const double step = std::fabs(asked - (following_ ? joined_ : position_));
    if (rules.max_step > 0.0 && step > rules.max_step) {
        return reject_step(step, rules.max_step);
    }
    if (!following_) {
        following_ = true;
        offset_ = rules.max_step > 0.0 || rules.blend <= 0 ? 0.0 : position_ - asked;
        joined_at_ = now;
    }
    joined_ = asked;
    const double before = commanded_;
    commanded_ = asked;
    if (offset_ != 0.0) {
        const double left =
            falling(static_cast<double>(now - joined_at_) / static_cast<double>(rules.blend));
        commanded_ += offset_ * left;
        offset_ = left == 0.0 ? 0.0 : offset_;
    }
    const double ratio = rules.position.ratio();
    const auto measured = static_cast<double>(counter_.count());
    if (is_too_far(commanded_, rules) ||
        is_ambiguous(commanded_ * ratio, measured, rules.counter_bits) ||
        is_ambiguous(commanded_ * ratio, before * ratio, rules.counter_bits)) {
        return fail(Cause::bad_command, commanded_, 0.0);
    }
    const auto count = static_cast<std::int64_t>(std::llround(commanded_ * ratio));
    orders_.target_position =
        Counter::low_bits(static_cast<std::uint32_t>(count), rules.counter_bits);
    const double error = std::fabs(commanded_ - position_);
    if (rules.max_following_error > 0.0 && error > rules.max_following_error) {
        fail(Cause::following_error, error, rules.max_following_error);
    }
}

/// Lets the position sent to the drive follow the measured one while the drive does not follow it.
/// A drive that still obeys its last target keeps it: the measured position would be a step back by
/// the lag.
void Axis::follow_target(bool by_cycle) noexcept {
    const bool obeys = walk_.state() == State::operation_enabled &&
                       by_position(in_.has_mode ? in_.mode : orders_.mode);
    holds_target_ = (active_ && by_cycle) || (holds_target_ && obeys);
    if (!holds_target_ && orders_.mode != Mode::profile_position) {
        orders_.target_position = in_.position;
    }
}

/// Follows the commanded position in the modes that take one in each cycle.
void Axis::move_by_position(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    const bool by_cycle = by_position(orders_.mode);
    const bool follows = active_ && !command.halt && by_cycle;
    if (!follows) {
        following_ = false;
    } else if (!failure_) {
        follow_position(command, rules, now);
    }
    if (failure_) {
        active_ = false;
        following_ = false;
    }
    follow_target(by_cycle);
    if (!active_ || !by_cycle) {
        commanded_ = position_;
    }
    orders_.interpolation = orders_.target_position;
}

/// Returns true for a set-point that the drive could not distinguish from one in the other
/// direction, or that is not a number.
bool Axis::is_unreachable(const AxisCommand& command, double count,
                          const AxisRules& rules) const noexcept {
    if (command.relative) return is_ambiguous(count, 0.0, 32);
    const auto measured = static_cast<double>(counter_.count());
    const double from = command.immediate ? measured : last_set_point_;
    return is_ambiguous(count, from, rules.counter_bits) || is_too_far(command.position, rules);
}

/// Queues the position of a command that begins now as a set-point.
void Axis::queue_set_point(const AxisCommand& command, const AxisRules& rules) noexcept {
    const double count = command.position * rules.position.ratio();
    if (!active_) {
        if (!failure_) {
            fail(Cause::not_enabled, Request::go);
        }
        return;
    }
    if (is_unreachable(command, count, rules)) {
        fail(Cause::bad_command, command.position, 0.0);
        failure_.request = Request::go;
        return;
    }
    SetPoint p;
    p.target = Counter::low_bits(static_cast<std::uint32_t>(std::llround(count)),
                                 command.relative ? 32 : rules.counter_bits);
    p.relative = command.relative;
    p.immediate = command.immediate;
    p.blend = command.blend;
    if (set_points_.push(p)) {
        last_set_point_ = command.relative ? last_set_point_ + count : count;
        return;
    }
    if (p.immediate) {  // the sum of the distances is out of range
        fail(Cause::bad_command, command.position, 0.0);
        failure_.request = Request::go;
    } else {
        fail(Cause::set_point_lost, Request::go);
    }
    active_ = false;
}

/// Exchanges set-points with the drive in profile position mode.
void Axis::move_by_set_points(const AxisCommand& command, const AxisRules& rules,
                              Time now) noexcept {
    const bool by_set_points = orders_.mode == Mode::profile_position;
    if (set_points_.done()) {
        last_set_point_ = static_cast<double>(counter_.count());
    }
    if (!by_set_points || !active_) {
        set_points_.clear();
        last_set_point_ = static_cast<double>(counter_.count());
        const bool is_reached = (in_.statusword & status::target_reached) != 0;
        target_reached_ = is_reached && !(by_set_points && set_points_.discarded());
    }
    const bool later = enabled_ && !active_;  // during a mode change or homing
    const bool begins = command.go && !was_go_;
    if (!later || !command.go) {
        was_go_ = command.go;
    }
    if (begins && by_set_points && !later) {
        queue_set_point(command, rules);
    }
    if (!active_ || !by_set_points) return;
    orders_.controlword |=
        set_points_.step(in_.statusword, now, rules.limits.step, orders_.target_position);
    target_reached_ = set_points_.done();
    if (set_points_.failure()) {
        adopt_failure(set_points_.failure());
        active_ = false;
    }
}

/// Sets the targets of velocity and torque, their feed-forward and the ramps.
void Axis::set_velocity_and_torque(const AxisCommand& command, const AxisRules& rules) noexcept {
    const Mode mode = orders_.mode;
    const bool still = !active_ || (command.halt && !can_halt(mode));
    const bool feeds_torque = following_ || (!still && mode == Mode::cyclic_velocity);
    const auto velocity = rules.velocity.to_drive<std::int32_t>(command.velocity);
    const auto torque = rules.torque.to_drive<std::int16_t>(command.torque);
    orders_.target_velocity = !still && by_velocity(mode) ? velocity : 0;
    orders_.vl_target_velocity = 0;
    orders_.target_torque = !still && by_torque(mode) ? torque : std::int16_t{0};
    orders_.velocity_offset = following_ ? velocity : 0;
    orders_.torque_offset = feeds_torque ? torque : std::int16_t{0};
    if (!still && mode == Mode::velocity) {
        orders_.vl_target_velocity = rules.vl.to_drive<std::int16_t>(command.velocity);
    }
    orders_.profile_velocity = rules.velocity.amount(command.profile_velocity);
    orders_.profile_acceleration = rules.acceleration.amount(command.profile_acceleration);
    orders_.profile_deceleration = rules.acceleration.amount(command.profile_deceleration);
}

/// Sets the upper bits of the controlword that belong to the mode.
void Axis::set_mode_bits(const AxisCommand& command) noexcept {
    constexpr std::uint16_t ramps =
        control::enable_ramp | control::unlock_ramp | control::reference_ramp;
    const Mode mode = orders_.mode;
    if (active_ && mode == Mode::velocity && !command.halt) {
        orders_.controlword |= ramps;
    }
    if (following_ && mode == Mode::interpolated_position) {
        orders_.controlword |= control::enable_interpolation;
    }
    if (command.halt && enabled_ && can_halt(mode)) {
        orders_.controlword |= control::halt;
    }
}

namespace {

/// Returns whether the drive's object of type T can hold a command in user units. [realtime]
template <class T>
bool fits(double user, const Factor& factor) noexcept {
    const double exact = std::fabs(user * factor.ratio());
    return exact <= static_cast<double>(std::numeric_limits<T>::max());
}

}  // namespace

/// Fails when the commands, the factors or the limits of an axis in motion are invalid.
void Axis::check_numbers(const AxisCommand& command, const AxisRules& rules) noexcept {
    if (const Factor* const f = unsound_factor(rules)) {
        fail(Cause::bad_factor, f->ratio(), 0.0);
    } else if (const double limit = negative_limit(rules); limit < 0.0) {
        fail(Cause::bad_limit, limit, 0.0);
    } else if (!fits<std::int32_t>(command.velocity, rules.velocity) ||
               (orders_.mode == Mode::velocity &&
                !fits<std::int16_t>(command.velocity, rules.vl))) {
        fail(Cause::bad_command, command.velocity, 0.0);
    } else if (!fits<std::int16_t>(command.torque, rules.torque)) {
        fail(Cause::bad_command, command.torque, 0.0);
    }
}

/// Sets the targets and the upper bits of the controlword that belong to the mode.
void Axis::move(const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
    if (active_) {
        check_numbers(command, rules);
    }
    move_by_position(command, rules, now);
    move_by_set_points(command, rules, now);
    set_velocity_and_torque(command, rules);
    set_mode_bits(command);
}

}  // namespace hal::cia402
