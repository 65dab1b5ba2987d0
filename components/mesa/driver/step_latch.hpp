// SPDX-License-Identifier: MIT
// The latch of a step generator: its position at the index or at the probe.
#pragma once

#include <cstdint>
#include <optional>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

/// What latches a position.
enum class LatchSource : std::uint8_t { none, index, probe };

/// The mode register of a step generator that can latch (version C2h). A bit arms the latch; the chip
/// clears it at the event, and stores the upper 24 bits of the accumulator beside it. A cleared bit is
/// an event or a write that was lost:
///
///   state   bit  writes of its datagram  is
///   armed   0    -                       an event
///   sent    0    arrived                 an event, within the first cycle
///   sent    0    lost                    not armed: written again
///   unsure  0    unknown                 an event if the latch has changed, else not armed
///
/// It is unsure after a missing answer. An event within that cycle that has latched the value of the
/// event before, to 1/256 step, is the one case that is taken for a lost write.
/// The register is written behind an answer only: written again on suspicion, it would arm the latch
/// for the next index. Used by one thread; all functions are [realtime].
class StepLatch {
public:
    /// Follows an answer that shows the register. Returns the source of the event that it shows.
    /// `begins_anew`: the card was reset.
    LatchSource receive(std::uint32_t mode, bool writes_arrived, bool begins_anew) noexcept {
        const bool has_changed = ((mode ^ mode_) & stepgen::latch_mask) != 0;
        const bool shows_arming = (mode & arming_bit(source_)) != 0;
        const State before = state_;
        mode_ = mode;
        is_read_ = true;
        if (begins_anew || before == State::idle) {
            state_ = State::idle;
            return LatchSource::none;
        }
        state_ = shows_arming ? State::armed : State::idle;
        if (shows_arming) return LatchSource::none;
        const bool has_arrived =
            before == State::armed || has_changed || (before == State::sent && writes_arrived);
        return has_arrived ? source_ : LatchSource::none;
    }
    /// The answer is missing.
    void miss() noexcept {
        if (state_ == State::sent) {
            state_ = State::unsure;
        }
    }
    /// Returns the value of the register to write; nothing: it stays. `settings` are its other bits;
    /// they wait while the latch is armed.
    std::optional<std::uint32_t> transmit(std::uint32_t settings, LatchSource wanted) noexcept {
        if (!is_read_) return {};
        is_read_ = false;
        if (state_ == State::armed && wanted == source_) return {};
        const std::uint32_t shown = mode_ & written_bits;
        // disarmed first, so that an event has one source
        const bool arms = wanted != LatchSource::none && state_ == State::idle;
        const std::uint32_t value = arms ? settings | arming_bit(wanted) : settings;
        state_ = State::idle;
        if (arms) {
            source_ = wanted;
            state_ = shown == value ? State::armed : State::sent;
        }
        if (shown == value) return {};
        return value;
    }

    /// Returns the accumulator at the newest event.
    std::uint32_t latched() const noexcept { return mode_ & stepgen::latch_mask; }

private:
    enum class State : std::uint8_t {
        idle,
        sent,  ///< in the newest datagram
        unsure,  ///< in a datagram without an answer
        armed,  ///< an answer has shown it
    };
    static constexpr std::uint32_t written_bits =
        stepgen::mode_mask | stepgen::swap_step_direction | stepgen::latch_on_index |
        stepgen::index_polarity | stepgen::latch_on_probe | stepgen::probe_polarity;

    static constexpr std::uint32_t arming_bit(LatchSource source) noexcept {
        switch (source) {
        case LatchSource::index: return stepgen::latch_on_index;
        case LatchSource::probe: return stepgen::latch_on_probe;
        default: return 0;
        }
    }

    State state_ = State::idle;
    LatchSource source_ = LatchSource::none;
    std::uint32_t mode_ = 0;  ///< as the newest answer shows it
    bool is_read_ = false;  ///< in this cycle
};

}  // namespace hal::mesa
