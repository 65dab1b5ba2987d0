// SPDX-License-Identifier: MIT
// Stopping an axis: halt, quick stop, after a timeout, and at the end of the session in any state.
#include <fmt/core.h>

#include "bus/can/drive_axis.hpp"
#include "cia402/error_words.hpp"

namespace hal::tools {

using namespace canopen::cia402;

void SdoAxis::allow(std::int64_t ns) {
    allowed_ = ns;
    deadline_ = monotonic_ns() + ns;
    in_motion_ = false;
}

/// Handles a timeout: stops what the command started.
bool SdoAxis::overdue() {
    const double seconds = static_cast<double>(allowed_) / 1e9;
    if (!in_motion_) {
        return refuse(fmt::format(
            "not done within {:g} s (timeout; drive is in \"{}\", statusword 0x{:04X}); for more "
            "time add: within {:g}s",
            seconds, to_string(state_of(feedback_.statusword)), feedback_.statusword, 2 * seconds));
    }
    allow(rules.limits.stop);
    interrupted = nullptr;
    const bool stopped = machine_.enabled() && stop();
    return refuse(fmt::format(
        "not done within {:g} s (timeout); {} at {:.10g}; for more time add: within {:g}s", seconds,
        stopped ? "axis stopped" : "axis not stopped, last seen", position(), 2 * seconds));
}

/// Halts, then withdraws the motion, so that nothing continues when halt ends.
bool SdoAxis::stop() {
    if (!adopt()) return false;
    if (!look()) return false;
    if (state_of(feedback_.statusword) != State::operation_enabled) return true;
    command_.enable = command_.halt = true;
    command_.home = command_.go = false;
    in_motion_ = false;
    rest_since_ = monotonic_ns();
    if (!until([&] { return standing(); })) return false;
    command_.velocity = command_.torque = 0.0;
    if (command_.mode == Mode::profile_position && machine_.active()) {
        command_.position = machine_.position();
        command_.relative = false;

        command_.immediate = command_.go = true;
        if (!until([&] { return machine_.set_points() == 0; })) return false;
        for (int n = 0; n < 3; ++n) {
            if (!cycle()) return false;
        }
        command_.go = false;
    }
    command_.halt = false;
    const bool by_set_point = command_.mode == Mode::profile_position && machine_.active();
    return until([&] { return !by_set_point || machine_.target_reached(); }, &SdoAxis::arrived);
}

bool SdoAxis::quick_stop() {
    if (!adopt()) return false;
    command_.quick_stop = true;
    command_.home = command_.go = false;
    if (!until([&] { return !machine_.walking() && standing(); })) return false;
    command_.quick_stop = command_.enable = false;
    return true;
}

/// Works without the state machine of the commands, which may have failed, and in every state.
bool SdoAxis::secure(std::string& what) {
    interrupted = nullptr;
    touched_ = adopted_ = false;
    reported_ = {};
    if (!look()) {  // the response may be lost although the command arrives
        const std::uint16_t at = of_axis(object::controlword, axis_);
        for (const std::uint16_t order : {command::quick_stop, command::disable_voltage}) {
            can::Frame f(0x600U + node_, {0x2b, static_cast<std::uint8_t>(at & 0xff),
                                          static_cast<std::uint8_t>(at >> 8), 0,
                                          static_cast<std::uint8_t>(order), 0, 0, 0});
            station_.out.push(f);
            station_.until([] { return false; }, 10 * pause_ns);
        }
        what = "quick stop and disable sent, no response";
        return false;
    }
    State state = state_of(feedback_.statusword);
    const auto has_torque = [&] {
        return state == State::operation_enabled || state == State::quick_stop_active;
    };
    const bool had_torque = has_torque();
    if (had_torque) {
        if (!write(object::controlword, 0, command::quick_stop, 2)) return false;
        rest_since_ = monotonic_ns();
        for (const std::int64_t end = monotonic_ns() + rules.limits.stop;
             has_torque() && monotonic_ns() < end;) {
            station_.until([] { return false; }, pause_ns);
            if (!look()) return false;
            state = state_of(feedback_.statusword);
            // 605Ah may keep it in this state
            if (state == State::quick_stop_active && standing()) break;
        }
    }
    if (state != State::fault && state != State::fault_reaction_active &&
        state != State::switch_on_disabled &&
        !write(object::controlword, 0, command::disable_voltage, 2)) {
        return false;
    }
    if (!look()) return false;
    state = state_of(feedback_.statusword);
    if (!had_torque) return true;
    if (has_torque()) {
        what =
            fmt::format("not stopped within {:g} s", static_cast<double>(rules.limits.stop) / 1e9);
    } else if (state == State::fault || state == State::fault_reaction_active) {
        what = fmt::format("in fault (error 0x{:04X}: {}), off, at {:.10g}", feedback_.error_code,
                           error_word(feedback_.error_code), position());
    } else {
        what = fmt::format("stopped and off, at {:.10g}", position());
    }
    return !has_torque();
}

bool SdoAxis::moves() {
    if (!touched_ || !look() || state_of(feedback_.statusword) != State::operation_enabled) {
        return false;
    }
    if (command_.mode == Mode::profile_position) {
        return (feedback_.statusword & status::target_reached) == 0;
    }
    return command_.velocity != 0.0 || command_.torque != 0.0;
}

}  // namespace hal::tools
