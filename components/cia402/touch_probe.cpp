// SPDX-License-Identifier: MIT
#include "cia402/touch_probe.hpp"

#include "cia402/drive_profile.hpp"

namespace hal::cia402 {

void TouchProbe::observe(const Feedback& feedback) noexcept {
    feedback_ = feedback;
    if (!feedback.operational) {
        state_ = State::off;
    }
    const bool shown = (feedback.status & probe::enabled) != 0;
    const bool is_active =
        state_ == State::armed || state_ == State::stored || state_ == State::latched;
    armed_ = is_active && shown;
    if (!armed_) return;
    const unsigned stored = command_.falling ? probe::negative_stored : probe::positive_stored;
    if (state_ == State::armed && (feedback.status & stored) != 0) {
        state_ = State::stored;
    } else if (state_ == State::stored || state_ == State::latched) {
        state_ = State::latched;
        position_ = command_.falling ? feedback.falling : feedback.rising;
    }
}

std::uint8_t TouchProbe::act(const Command& command) noexcept {
    if (!command.enable || !feedback_.operational) {
        state_ = State::off;
        armed_ = false;
        return 0;
    }
    if (state_ == State::off || command != command_) {
        state_ = State::releasing;
        armed_ = false;
        command_ = command;
    }
    // An edge that was stored before must not count for this one.
    if (state_ == State::releasing && (feedback_.status & probe::enabled) != 0) return 0;
    if (state_ == State::releasing) {
        state_ = State::armed;
    }
    unsigned function = probe::enable;
    function |= command.falling ? probe::negative_edge : probe::positive_edge;
    function |= command.continuous ? probe::continuous : 0U;
    function |= command.index ? probe::index_pulse : 0U;
    return static_cast<std::uint8_t>(function);
}

}  // namespace hal::cia402
