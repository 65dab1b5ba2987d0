// SPDX-License-Identifier: MIT
#include "axis_walk.hpp"

#include <iterator>
#include <utility>

namespace hal::cia402 {

namespace {

/// The commanded states, in the order of the columns below.
constexpr State columns[] = {State::switch_on_disabled, State::ready_to_switch_on,
                             State::switched_on, State::operation_enabled,
                             State::quick_stop_active};
constexpr unsigned column_of(State wanted) noexcept {
    for (unsigned i = 0; i < std::size(columns); ++i) {
        if (columns[i] == wanted) return i;
    }
    return 0;
}

using Transition = Walk::Transition;
constexpr Transition there(Step held) { return {held, true}; }

/// The command in a state (row, in the order of State) that leads to the commanded one (column).
/// Leaving operation enabled uses the ramps of the drive; no command leads through fault: only a
/// reset leaves it.
constexpr Transition transitions[9][5] = {
    // off                          ready to switch on         switched on                operation enabled          quick stop
    {there(Step::disable_voltage),
     {Step::wait},
     {Step::wait},
     {Step::wait},
     there(Step::quick_stop)},
    {there(Step::disable_voltage),
     {Step::shutdown},
     {Step::shutdown},
     {Step::shutdown},
     there(Step::quick_stop)},
    {{Step::disable_voltage},
     there(Step::shutdown),
     {Step::switch_on},
     {Step::switch_on},
     there(Step::quick_stop)},
    {{Step::shutdown},
     {Step::shutdown},
     there(Step::switch_on),
     {Step::enable_operation},
     there(Step::quick_stop)},
    {{Step::disable_operation},
     {Step::disable_operation},
     {Step::disable_operation},
     there(Step::enable_operation),
     {Step::quick_stop}},
    {{Step::quick_stop},
     {Step::quick_stop},
     {Step::quick_stop},
     {Step::enable_operation},
     there(Step::quick_stop)},
    {{Step::wait}, {Step::wait}, {Step::wait}, {Step::wait}, {Step::wait}},
    {there(Step::disable_voltage),
     {Step::wait},
     {Step::wait},
     {Step::wait},
     there(Step::disable_voltage)},
    {{Step::wait}, {Step::wait}, {Step::wait}, {Step::wait}, {Step::wait}},
};

constexpr std::uint16_t controlword(Step step) noexcept {
    switch (step) {
    case Step::shutdown: return command::shutdown;
    case Step::switch_on: return command::switch_on;
    case Step::enable_operation: return command::enable_operation;
    case Step::disable_operation: return command::disable_operation;
    case Step::quick_stop: return command::quick_stop;
    case Step::fault_reset: return command::fault_reset;
    case Step::wait:
    case Step::disable_voltage: break;
    }
    return command::disable_voltage;
}

}  // namespace

void Walk::want(State wanted, Request request) noexcept {
    if (wanted == wanted_ && request == request_) return;
    wanted_ = wanted;
    request_ = request;
    failure_ = {};
    step_ = led_ = Step::wait;
    fresh_ = true;
    forced_ = false;
    reached_ = false;
}

void Walk::reset_fault() noexcept {
    resetting_ = edge_low_ = true;
    failure_ = {};
    fresh_ = true;
}

void Walk::fail(Cause cause, std::uint16_t statusword, std::uint16_t error_code,
                Time waited) noexcept {
    failure_ = {};
    failure_.cause = cause;
    failure_.request = resetting_ ? Request::reset : request_;

    failure_.step = cause == Cause::drive_fault ? led_ : step_;
    failure_.state = state_;
    failure_.statusword = statusword;
    failure_.error_code = error_code;
    failure_.after = waited;
}

std::uint16_t Walk::step(std::uint16_t statusword, std::uint16_t error_code, Time now,
                         const Limits& limits) noexcept {
    const bool changed = observe(statusword);
    const Transition transition = choose(statusword, error_code);
    edge_low_ = false;  // a cycle with bit 7 low makes the edge
    reached_ = transition.there && !resetting_;
    const bool off = wanted_ == State::switch_on_disabled;
    if (failure_ && !off) return command::disable_voltage;  // gave up; the caller decides
    if (fresh_ || changed || transition.step != step_) {
        begin(transition.step, now);
    } else if (!reached_ && now - since_ >= timeout(limits)) {
        expire(statusword, error_code, now - since_);
    }
    return controlword(step_);
}

/// Takes the state of the drive. Returns whether it changed.
bool Walk::observe(std::uint16_t statusword) noexcept {
    const State before = std::exchange(state_, state_of(statusword));
    keeps_power_ = keeps_power_ && has_power(state_) && wanted_ != State::operation_enabled;
    const bool faulty = state_ == State::fault || state_ == State::fault_reaction_active;
    if (resetting_ && !faulty) {
        resetting_ = false;
        fresh_ = true;
    }
    if (state_ == before) return false;
    forced_ = false;
    return true;
}

/// Returns the command of this cycle; a fault that nobody resets is a failure.
Walk::Transition Walk::choose(std::uint16_t statusword, std::uint16_t error_code) noexcept {
    const bool in_fault = state_ == State::fault;
    Transition transition = transitions[static_cast<unsigned>(state_)][column_of(wanted_)];
    if (resetting_ && in_fault) {
        transition = {edge_low_ ? Step::wait : Step::fault_reset};
    } else if (in_fault && !transition.there && !failure_) {
        fail(Cause::drive_fault, statusword, error_code, 0);
    }
    if (forced_ && !transition.there) {
        transition.step = Step::disable_voltage;
    }
    return transition;
}

/// Begins a command, and its timeout.
void Walk::begin(Step step, Time now) noexcept {
    since_ = now;
    fresh_ = false;
    step_ = step;
    if (step_ != Step::wait) {
        led_ = step_;
    }
}

Time Walk::timeout(const Limits& limits) const noexcept {
    const bool brakes = step_ == Step::disable_operation || state_ == State::quick_stop_active ||
                        state_ == State::fault_reaction_active;
    return brakes ? limits.stop : limits.step;
}

/// The drive does not follow the command in time.
void Walk::expire(std::uint16_t statusword, std::uint16_t error_code, Time waited) noexcept {
    // 605Ah may keep the drive there, and transition 16 is optional
    const bool optional = state_ == State::quick_stop_active && !forced_;
    if (!optional && !failure_) {
        fail(Cause::stays, statusword, error_code, waited);
    }
    if (!optional && has_power(state_) && wanted_ != State::operation_enabled) {
        keeps_power_ = true;
    }
    if (resetting_) {
        resetting_ = false;
        fresh_ = true;
    }
    if (optional || wanted_ == State::switch_on_disabled) {
        forced_ = true;
        fresh_ = true;
    }
}

}  // namespace hal::cia402
