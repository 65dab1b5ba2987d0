// SPDX-License-Identifier: MIT
#include "bus/can/drive_axis.hpp"

#include <cmath>
#include <cstring>
#include <fmt/core.h>

#include "canopen/protocol/emcy.hpp"
#include "cia402/error_words.hpp"
#include "cli/output.hpp"

namespace hal::tools {

using namespace canopen::cia402;
using canopen::SdoRequest;

namespace {

constexpr std::int64_t rest_ns = 100'000'000;     // without a count: at standstill
constexpr std::int64_t stall_ns = 2'000'000'000;  // without a count before arrival: stalled

}  // namespace

SdoAxis::SdoAxis(const Options& options, NodeClient& station, std::uint8_t node, unsigned axis)
    : options_(options), station_(station), node_(node), axis_(axis) {
    emergencies_ = station_.network.add(node_).emergencies();
}

bool SdoAxis::refuse(const std::string& sentence) const {
    std::string text = fmt::format("{}: {}", letter(), sentence);
    canopen::RemoteNode& node = station_.network.add(node_);
    if (node.emergencies() > emergencies_) {
        const std::uint16_t code = node.emergency(0).code;
        text += fmt::format("; last EMCY 0x{:04X}: {}", code, error_word(code));
    }
    fail(options_, text);
    return false;
}

bool SdoAxis::read(std::uint16_t index, std::uint8_t sub, std::int64_t& value, bool is_signed,
                   bool* missing) {
    std::uint8_t room[8] = {};
    const std::uint16_t at = of_axis(index, axis_);
    SdoRequest request{.index = at, .sub = sub, .upload = true, .buffer = room};
    if (!station_.transfer(node_, request)) {
        const bool none =
            request.aborted_by_server &&
            (request.abort == canopen::Abort::no_object || request.abort == canopen::Abort::no_sub);
        if (missing && none) {
            *missing = true;
            return false;
        }
        station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", at, sub));
        return false;
    }
    std::uint64_t bits = 0;
    std::memcpy(&bits, room, request.size);
    const unsigned unused = 64 - 8 * static_cast<unsigned>(request.size);
    value = is_signed && unused < 64 ? static_cast<std::int64_t>(bits << unused) >> unused
                                     : static_cast<std::int64_t>(bits);
    return true;
}

bool SdoAxis::write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned bytes) {
    std::uint8_t data[8];
    std::memcpy(data, &value, sizeof data);
    const std::uint16_t at = of_axis(index, axis_);
    SdoRequest request{.index = at, .sub = sub, .data = std::span(data, bytes)};
    if (station_.transfer(node_, request)) return true;
    station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", at, sub));
    return false;
}

bool SdoAxis::look() {
    std::int64_t value = 0;
    bool missing = false;
    if (!read(object::statusword, 0, value, false, &missing)) {
        return missing && refuse(fmt::format("node {} has no such axis: object {:04X} is missing",
                                             node_, of_axis(object::statusword, axis_)));
    }
    feedback_.statusword = static_cast<std::uint16_t>(value);
    const auto optional = [&](bool& there, std::uint16_t index, auto& to) {
        missing = false;
        if (!there) return true;
        if (read(index, 0, value, true, &missing)) {
            to = static_cast<std::remove_reference_t<decltype(to)>>(value);
            return true;
        }
        return missing ? (there = false, true) : false;
    };
    if (!optional(feedback_.has_mode, object::modes_of_operation_display, feedback_.mode)) {
        return false;
    }
    if (!optional(feedback_.has_velocity, object::velocity_actual, feedback_.velocity)) {
        return false;
    }
    if (!optional(has_torque_, object::torque_actual, feedback_.torque)) return false;
    if (!read(object::position_actual, 0, value, true)) return false;
    feedback_.position = static_cast<std::int32_t>(value);
    feedback_.error_code = 0;
    const State state = state_of(feedback_.statusword);
    if ((state == State::fault || state == State::fault_reaction_active) &&
        read(object::error_code, 0, value, false, &missing)) {
        feedback_.error_code = static_cast<std::uint16_t>(value);
    }
    const std::int64_t now = monotonic_ns();
    if (feedback_.position != rest_position_ || rest_since_ == 0) {
        rest_since_ = now;
    }
    rest_position_ = feedback_.position;
    return true;
}

/// Takes over a drive that is already running by an earlier command.
bool SdoAxis::adopt() {
    emergencies_ = station_.network.add(node_).emergencies();
    if (adopted_) return true;
    if (!look()) return false;
    std::int64_t velocity = 0;
    std::int64_t torque = 0;
    bool missing = false;
    if (!read(object::target_velocity, 0, velocity, true, &missing) && !missing) return false;
    missing = false;
    if (!read(object::target_torque, 0, torque, true, &missing) && !missing) return false;
    command_.mode = feedback_.mode;
    command_.enable = state_of(feedback_.statusword) == State::operation_enabled;
    command_.velocity = rules.velocity.to_user(static_cast<double>(velocity));
    command_.torque = rules.torque.to_user(static_cast<double>(torque));
    if (command_.mode == Mode::cyclic_position || command_.mode == Mode::cyclic_velocity ||
        command_.mode == Mode::cyclic_torque || command_.mode == Mode::interpolated_position) {
        command_.mode = Mode::profile_position;  // the cyclic set-points of these modes are missing
    }
    return adopted_ = true;
}

bool SdoAxis::cycle() {
    if (!look()) return false;
    return tell(machine_.step(feedback_, command_, rules, monotonic_ns()));
}

/// Writes changed values; the controlword last, because it activates the others.
bool SdoAxis::tell(const AxisOrders& orders) {
    const auto put = [&](auto& told, auto value, std::uint16_t index) {
        if (told == value) return true;
        if (!write(index, 0, static_cast<std::int64_t>(value), sizeof value)) return false;
        told = value;
        return true;
    };
    const auto mode = static_cast<std::int8_t>(orders.mode);
    if (mode != 0 && !reported_.mode && feedback_.mode == orders.mode) {
        reported_.mode = mode;
    }
    if (mode != 0 && !put(reported_.mode, mode, object::modes_of_operation)) return false;
    if (machine_.active()) {
        if (orders.mode == Mode::profile_position &&
            !put(reported_.position, orders.target_position, object::target_position)) {
            return false;
        }
        if (orders.mode == Mode::profile_velocity &&
            !put(reported_.velocity, orders.target_velocity, object::target_velocity)) {
            return false;
        }
        if (orders.mode == Mode::profile_torque &&
            !put(reported_.torque, orders.target_torque, object::target_torque)) {
            return false;
        }
        if (orders.mode == Mode::velocity &&
            !put(reported_.vl, orders.vl_target_velocity, object::vl_target_velocity)) {
            return false;
        }
    }
    return put(reported_.controlword, orders.controlword, object::controlword);
}

bool SdoAxis::standing() { return monotonic_ns() - rest_since_ >= rest_ns; }

/// Returns true when the axis has stalled before its target.
bool SdoAxis::arrived() {
    if (monotonic_ns() - std::max(rest_since_, moved_at_) < stall_ns) return true;
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

/// Runs cycles until `ready`; `still` reports when that is no longer possible.
bool SdoAxis::until(const Ready& ready, bool (SdoAxis::*still)()) {
    moved_at_ = monotonic_ns();
    for (;;) {
        if (!cycle()) return false;
        if (machine_.failure()) return report();
        if (ready()) return true;
        if (still && !(this->*still)()) return false;
        const Interruption why = interrupted ? interrupted() : Interruption::none;
        if (why == Interruption::end) return false;
        if (why == Interruption::stop) {
            interrupted = nullptr;
            allow(rules.limits.stop);
            const bool stopped = machine_.enabled() && stop();
            return refuse(stopped ? "interrupted; axis stopped" : "interrupted");
        }
        if (monotonic_ns() >= deadline_) return overdue();
        station_.until([&] { return is_interrupted(); }, pause_ns);
    }
}

bool SdoAxis::on() {
    if (!adopt()) return false;
    touched_ = true;
    if (command_.mode == Mode::none || command_.mode == Mode::homing) {
        command_.mode = Mode::profile_position;
    }
    if (state_of(feedback_.statusword) != State::operation_enabled) {
        command_.velocity = command_.torque = 0.0;
    }
    if (!look()) return false;
    const State state = state_of(feedback_.statusword);
    command_.quick_stop = command_.halt = command_.reset = false;
    if (state != State::operation_enabled || !machine_.enabled()) {
        // clears our failure only; a fault of the drive needs `reset`
        if (state != State::fault && machine_.failure()) {
            command_.enable = false;
            command_.reset = true;
            if (!cycle()) return false;
            command_.reset = false;
        }
        command_.enable = state == State::operation_enabled;
        if (!cycle()) return false;
        if (machine_.failure()) return report();
        command_.enable = true;
    }
    return until([&] { return machine_.active(); });
}

bool SdoAxis::off() {
    if (!adopt()) return false;
    command_.enable = command_.go = command_.home = command_.halt = false;
    return until([&] {
        return !machine_.walking() && state_of(feedback_.statusword) != State::operation_enabled;
    });
}

/// Checks that the axis is enabled, and selects the mode.
bool SdoAxis::begin_motion(Mode mode) {
    if (!adopt()) return false;
    if (!look()) return false;
    if (state_of(feedback_.statusword) == State::fault && !machine_.failure()) {
        if (!cycle()) return false;
    }
    if (machine_.failure() && machine_.failure().cause != Cause::drive_fault) {
        command_.enable = false;
        command_.reset = true;
        if (!cycle()) return false;
        command_.reset = false;
    }
    if (machine_.failure()) return report();
    if (!command_.enable || state_of(feedback_.statusword) != State::operation_enabled) {
        return refuse(fmt::format("not enabled (drive is in \"{}\"); type: {} on",
                                  to_string(state_of(feedback_.statusword)), letter()));
    }
    command_.mode = mode;
    command_.home = command_.go = false;
    touched_ = in_motion_ = true;
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
    for (int n = 0; n < 3; ++n) {  // the edge, and its end
        if (!cycle()) return false;
    }
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
    for (int n = 0; n < 3; ++n) {  // by then the status of the drive is that of this speed
        if (!cycle()) return false;
    }
    if (!wait || mode == Mode::velocity) return !machine_.failure() || report();
    return until([&] { return (feedback_.statusword & status::target_reached) != 0; },
                 &SdoAxis::arrived);
}

bool SdoAxis::torque(double permille, bool wait) {
    if (adopt() && command_.mode != Mode::profile_torque) {
        command_.torque = 0.0;
    }
    if (!begin_motion(Mode::profile_torque)) return false;
    command_.torque = permille;
    command_.halt = false;
    for (int n = 0; n < 3; ++n) {
        if (!cycle()) return false;
    }
    if (!wait) return !machine_.failure() || report();
    return until([&] { return (feedback_.statusword & status::target_reached) != 0; },
                 &SdoAxis::arrived);
}

/// Checks that the drive supports a homing method, by 60E3h if it exists.
bool SdoAxis::choose_homing(int method) {
    const auto data = static_cast<std::uint8_t>(method);
    const std::uint16_t at = of_axis(object::homing_method, axis_);
    SdoRequest request{.index = at, .data = std::span(&data, 1)};
    if (station_.transfer(node_, request)) return true;
    using canopen::Abort;
    if (!request.aborted_by_server ||
        (request.abort != Abort::value && request.abort != Abort::too_high &&
         request.abort != Abort::too_low)) {
        station_.fail_transfer(node_, request, fmt::format("{:04X}:0", at));
        return false;
    }
    std::string known;
    std::int64_t count = 0;
    std::int64_t one = 0;
    bool missing = false;
    if (read(object::supported_homing_methods, 0, count, false, &missing)) {
        for (unsigned sub = 1; sub <= count && sub < 255; ++sub) {
            if (!read(object::supported_homing_methods, static_cast<std::uint8_t>(sub), one, true,
                      &missing)) {
                break;
            }
            known += fmt::format("{}{}", known.empty() ? "" : ", ", one);
        }
    }
    if (known.empty() && !missing) {
        return false;  // the bus failed
    }
    return refuse(fmt::format(
        "the drive does not support homing method {}; {}", method,
        known.empty() ? "see its manual for those it supports" : "it supports " + known));
}

bool SdoAxis::home(std::optional<int> method) {
    if (!adopt()) return false;
    if (method && !choose_homing(*method)) return false;
    const Mode before =
        command_.mode == Mode::profile_position ? command_.mode : Mode::profile_position;
    command_.velocity = command_.torque = 0.0;
    if (!begin_motion(before)) return false;
    command_.home = true;
    if (!until([&] { return machine_.homed(); })) return false;
    command_.home = false;
    return until([&] { return !machine_.homing() && machine_.active(); });
}

bool SdoAxis::reset() {
    if (!adopt()) return false;
    command_.enable = command_.reset = false;
    if (!cycle()) return false;
    command_.reset = true;
    const bool good = until([&] { return !machine_.fault() && !machine_.walking(); });
    command_.reset = false;
    return good;
}

bool SdoAxis::set_mode(Mode mode) {
    if (!adopt()) return false;
    command_.velocity = command_.torque = 0.0;
    command_.mode = mode;
    const std::int64_t end = monotonic_ns() + rules.limits.step;
    return until([&] {
        return feedback_.mode == mode || !feedback_.has_mode || monotonic_ns() >= end;
    }) && (feedback_.mode == mode || !feedback_.has_mode ||
           refuse(fmt::format("drive does not accept mode {}, displays {}", abbreviation(mode),
                              abbreviation(feedback_.mode))));
}

bool SdoAxis::wait() {
    if (!adopt()) return false;
    return until([&] {
        return (feedback_.statusword & status::target_reached) != 0 && machine_.set_points() == 0;
    }, &SdoAxis::arrived);
}

}  // namespace hal::tools
