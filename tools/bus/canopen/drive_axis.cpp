// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_axis.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

namespace hal::tools {

using namespace cia402;

namespace {

constexpr std::int64_t stall_ns = 2'000'000'000;  // without a count before arrival: stalled

bool is_cyclic(Mode mode) {
    return mode == Mode::cyclic_position || mode == Mode::cyclic_velocity ||
           mode == Mode::cyclic_torque || mode == Mode::interpolated_position;
}

}  // namespace

void SdoAxis::allow(std::int64_t ns) {
    timeout_ns_ = ns;
    deadline_ns_ = monotonic_ns() + ns;
    in_motion_ = false;
}

bool SdoAxis::target_reached() const {
    return (feedback_.statusword & status::target_reached) != 0;
}

/// Adopts a drive that is already running by an earlier command.
bool SdoAxis::adopt() {
    forget_emergencies();
    if (adopted_) return true;
    if (!look()) return false;
    std::int64_t velocity = 0;
    std::int64_t torque = 0;
    bool missing = false;
    if (!read(object::target_velocity, 0, velocity, true, &missing) && !missing) return false;
    missing = false;
    if (!read(object::target_torque, 0, torque, true, &missing) && !missing) return false;
    // the cyclic set-points of the other modes are missing
    command_.mode = is_cyclic(feedback_.mode) ? Mode::profile_position : feedback_.mode;
    command_.enable = state() == State::operation_enabled;
    command_.velocity = rules.velocity.to_user(static_cast<double>(velocity));
    command_.torque = rules.torque.to_user(static_cast<double>(torque));
    adopted_ = true;
    return true;
}

bool SdoAxis::cycle() {
    if (!look()) return false;
    return write_orders(machine_.step(feedback_, command_, rules, monotonic_ns()));
}

bool SdoAxis::cycles(unsigned count) {
    for (unsigned n = 0; n < count; ++n) {
        if (!cycle()) return false;
    }
    return true;
}

template <typename Value>
bool SdoAxis::write_changed(std::optional<Value>& written, Value value, std::uint16_t index) {
    if (written == value) return true;
    if (!write(index, 0, static_cast<std::int64_t>(value), sizeof value)) return false;
    written = value;
    return true;
}

/// Writes the set-point of the mode.
bool SdoAxis::write_target(const AxisOrders& orders) {
    switch (orders.mode) {
    case Mode::profile_position:
        return write_changed(written_.position, orders.target_position, object::target_position);
    case Mode::profile_velocity:
        return write_changed(written_.velocity, orders.target_velocity, object::target_velocity);
    case Mode::profile_torque:
        return write_changed(written_.torque, orders.target_torque, object::target_torque);
    case Mode::velocity:
        return write_changed(written_.vl, orders.vl_target_velocity, object::vl_target_velocity);
    default: return true;
    }
}

/// Writes changed values; the controlword last, because it activates the others.
bool SdoAxis::write_orders(const AxisOrders& orders) {
    const auto mode = static_cast<std::int8_t>(orders.mode);
    if (orders.mode != Mode::none) {
        if (!written_.mode && feedback_.mode == orders.mode) {
            written_.mode = mode;
        }
        if (!write_changed(written_.mode, mode, object::modes_of_operation)) return false;
    }
    if (machine_.active() && !write_target(orders)) return false;
    return write_changed(written_.controlword, orders.controlword, object::controlword);
}

/// Returns false when the axis has stalled before its target.
bool SdoAxis::arrived() {
    if (monotonic_ns() - std::max(rest_since(), began_ns_) < stall_ns) return true;
    return refuse(fmt::format(
        "drive stopped at {:.10g} without reporting target reached (statusword 0x{:04X})",
        position(), feedback_.statusword));
}

/// Reports why the state machine gave up; it has already disabled the axis.
bool SdoAxis::report() {
    const std::int64_t end = monotonic_ns() + rules.limits.stop + rules.limits.step;
    while (machine_.walking() && monotonic_ns() < end && cycle()) {
    }
    const Failure& failure = machine_.failure();
    std::string why = text(failure);
    if (failure.cause == Cause::not_enabled) {
        why += fmt::format("; type: {} on", letter());
    } else if (failure.cause == Cause::drive_fault) {
        why += fmt::format("; remove the cause, then type: {} reset", letter());
    }
    return refuse(why);
}

/// Handles a timeout: stops what the command started.
bool SdoAxis::timed_out() {
    const double seconds = static_cast<double>(timeout_ns_) / 1e9;
    if (!in_motion_) {
        return refuse(fmt::format(
            "not done within {:g} s (timeout; drive is in \"{}\", statusword 0x{:04X}); for more "
            "time add: within {:g}s",
            seconds, to_string(state()), feedback_.statusword, 2 * seconds));
    }
    allow(rules.limits.stop);
    interrupted = nullptr;
    const bool stopped = machine_.enabled() && stop();
    return refuse(fmt::format(
        "not done within {:g} s (timeout); {} at {:.10g}; for more time add: within {:g}s", seconds,
        stopped ? "axis stopped" : "axis not stopped, last seen", position(), 2 * seconds));
}

/// Ends the command by an interruption.
bool SdoAxis::interrupt(Interruption why) {
    if (why == Interruption::end) return false;
    interrupted = nullptr;
    allow(rules.limits.stop);
    const bool stopped = machine_.enabled() && stop();
    return refuse(stopped ? "interrupted; axis stopped" : "interrupted");
}

/// Runs cycles until `ready`; `still` reports when that is no longer possible.
bool SdoAxis::until(const Ready& ready, bool (SdoAxis::*still)()) {
    began_ns_ = monotonic_ns();
    for (;;) {
        if (!cycle()) return false;
        if (machine_.failure()) return report();
        if (ready()) return true;
        if (still && !(this->*still)()) return false;
        const Interruption why = interruption();
        if (why != Interruption::none) return interrupt(why);
        if (monotonic_ns() >= deadline_ns_) return timed_out();
        station_.until([&] { return interruption() != Interruption::none; }, pause_ns);
    }
}

bool SdoAxis::until_target_reached() {
    return until([&] { return target_reached(); }, &SdoAxis::arrived);
}

/// Clears a failure of the state machine; a fault of the drive needs `reset`.
bool SdoAxis::clear_failure() {
    command_.enable = false;
    command_.reset = true;
    if (!cycle()) return false;
    command_.reset = false;
    return true;
}

bool SdoAxis::on() {
    if (!adopt()) return false;
    touched_ = true;
    if (command_.mode == Mode::none || command_.mode == Mode::homing) {
        command_.mode = Mode::profile_position;
    }
    if (state() != State::operation_enabled) {
        command_.velocity = 0.0;
        command_.torque = 0.0;
    }
    if (!look()) return false;
    const State before = state();
    command_.quick_stop = false;
    command_.halt = false;
    command_.reset = false;
    if (before != State::operation_enabled || !machine_.enabled()) {
        if (before != State::fault && machine_.failure() && !clear_failure()) return false;
        command_.enable = before == State::operation_enabled;
        if (!cycle()) return false;
        if (machine_.failure()) return report();
        command_.enable = true;
    }
    return until([&] { return machine_.active(); });
}

bool SdoAxis::off() {
    if (!adopt()) return false;
    command_.enable = false;
    command_.go = false;
    command_.home = false;
    command_.halt = false;
    return until([&] { return !machine_.walking() && state() != State::operation_enabled; });
}

/// Checks that the axis is enabled, and selects the mode.
bool SdoAxis::begin_motion(Mode mode) {
    if (!adopt()) return false;
    if (!look()) return false;
    if (state() == State::fault && !machine_.failure() && !cycle()) return false;
    const bool own_failure = machine_.failure() && machine_.failure().cause != Cause::drive_fault;
    if (own_failure && !clear_failure()) return false;
    if (machine_.failure()) return report();
    if (!command_.enable || state() != State::operation_enabled) {
        return refuse(fmt::format("not enabled (drive is in \"{}\"); type: {} on",
                                  to_string(state()), letter()));
    }
    command_.mode = mode;
    command_.home = false;
    command_.go = false;
    touched_ = true;
    in_motion_ = true;
    return until([&] { return machine_.active(); });
}

bool SdoAxis::go(double position, bool relative, bool wait, bool queued) {
    const double counts = position * rules.position.ratio();
    if (std::fabs(counts) > 2147483647.0) {
        return refuse(
            fmt::format("position {:.10g} is {:.10g} counts, out of the range "
                        "-2147483648..2147483647 of the drive",
                        position, counts));
    }
    if (adopt() && command_.mode != Mode::profile_position) {
        command_.velocity = 0.0;
    }
    if (!begin_motion(Mode::profile_position)) return false;
    command_.position = position;
    command_.relative = relative;
    // several `nowait` are queued in the drive
    command_.immediate = wait || !queued;
    command_.go = true;
    if (!cycle()) return false;
    command_.go = false;
    if (machine_.failure()) return report();
    const auto done = [&] {
        return machine_.set_points() == 0 && (machine_.target_reached() || !wait);
    };
    if (!until(done, wait ? &SdoAxis::arrived : nullptr)) return false;
    if (wait) return true;
    if (!cycles(3)) return false;  // the edge, and its end
    return !machine_.failure() || report();
}

bool SdoAxis::speed(double velocity, bool wait) {
    if (!adopt()) return false;
    const Mode mode = command_.mode == Mode::velocity ? Mode::velocity : Mode::profile_velocity;
    if (command_.mode != mode) {
        command_.velocity = 0.0;
    }
    if (!begin_motion(mode)) return false;
    command_.velocity = velocity;
    command_.halt = false;
    if (!cycles(3)) return false;  // by then the status of the drive is that of this speed
    if (!wait || mode == Mode::velocity) return !machine_.failure() || report();
    return until_target_reached();
}

bool SdoAxis::torque(double permille, bool wait) {
    if (adopt() && command_.mode != Mode::profile_torque) {
        command_.torque = 0.0;
    }
    if (!begin_motion(Mode::profile_torque)) return false;
    command_.torque = permille;
    command_.halt = false;
    if (!cycles(3)) return false;
    if (!wait) return !machine_.failure() || report();
    return until_target_reached();
}

/// Replaces the target by the present position, so that no set-point of the drive is left.
bool SdoAxis::withdraw_set_points() {
    command_.position = machine_.position();
    command_.relative = false;
    command_.immediate = true;
    command_.go = true;
    if (!until([&] { return machine_.set_points() == 0; })) return false;
    if (!cycles(3)) return false;
    command_.go = false;
    return true;
}

/// Halts, then withdraws the motion, so that nothing continues when halt ends.
bool SdoAxis::stop() {
    if (!adopt()) return false;
    if (!look()) return false;
    if (state() != State::operation_enabled) return true;
    command_.enable = true;
    command_.halt = true;
    command_.home = false;
    command_.go = false;
    in_motion_ = false;
    restart_standstill();
    if (!until([&] { return standing(); })) return false;
    command_.velocity = 0.0;
    command_.torque = 0.0;
    const bool has_set_points = command_.mode == Mode::profile_position && machine_.active();
    if (has_set_points && !withdraw_set_points()) return false;
    command_.halt = false;
    const bool by_set_point = command_.mode == Mode::profile_position && machine_.active();
    return until([&] { return !by_set_point || machine_.target_reached(); }, &SdoAxis::arrived);
}

bool SdoAxis::quick_stop() {
    if (!adopt()) return false;
    command_.quick_stop = true;
    command_.home = false;
    command_.go = false;
    if (!until([&] { return !machine_.walking() && standing(); })) return false;
    command_.quick_stop = false;
    command_.enable = false;
    return true;
}

bool SdoAxis::home(std::optional<int> method) {
    if (!adopt()) return false;
    if (method && !choose_homing(*method)) return false;
    command_.velocity = 0.0;
    command_.torque = 0.0;
    if (!begin_motion(Mode::profile_position)) return false;
    command_.home = true;
    if (!until([&] { return machine_.homed(); })) return false;
    command_.home = false;
    return until([&] { return !machine_.homing() && machine_.active(); });
}

bool SdoAxis::reset() {
    if (!adopt()) return false;
    command_.enable = false;
    command_.reset = false;
    if (!cycle()) return false;
    command_.reset = true;
    const bool good = until([&] { return !machine_.fault() && !machine_.walking(); });
    command_.reset = false;
    return good;
}

bool SdoAxis::set_mode(Mode mode) {
    if (!adopt()) return false;
    command_.velocity = 0.0;
    command_.torque = 0.0;
    command_.mode = mode;
    const std::int64_t end = monotonic_ns() + rules.limits.step;
    const auto accepted = [&] { return feedback_.mode == mode || !feedback_.has_mode; };
    if (!until([&] { return accepted() || monotonic_ns() >= end; })) return false;
    if (accepted()) return true;
    return refuse(fmt::format("drive does not accept mode {}, displays {}", abbreviation(mode),
                              abbreviation(feedback_.mode)));
}

bool SdoAxis::wait() {
    if (!adopt()) return false;
    return until([&] { return target_reached() && machine_.set_points() == 0; }, &SdoAxis::arrived);
}

bool SdoAxis::secure(std::string& what) {
    interrupted = nullptr;
    touched_ = false;
    adopted_ = false;
    written_ = {};
    return stop_and_disable(what);
}

bool SdoAxis::moves() {
    if (!touched_ || !look() || state() != State::operation_enabled) {
        return false;
    }
    if (command_.mode == Mode::profile_position) return !target_reached();
    return command_.velocity != 0.0 || command_.torque != 0.0;
}

}  // namespace hal::tools
