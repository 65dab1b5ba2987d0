// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/guardian/stop_reason.hpp"
#include "fieldbus/guardian/stop_transmitter.hpp"

namespace hal::guardian {

using bus::StopReason;

enum class Phase : std::uint8_t {
    watching,  ///< the link is open
    stopping,  ///< sends the frames
    stopped,   ///< has sent them, or has given up; the reason may last
    ended,
};

/// What the guardian has done, in one word, so that a cycle sees parts of the same moment.
struct Status {
    Phase phase = Phase::watching;
    Outcome outcome = Outcome::none;  ///< of the last stop, also when its reason is over
    Failure failure = Failure::none;
    bool is_ready = true;    ///< the link would accept a frame
    bool sees_bus = false;   ///< StopTransmitter::sees_bus()
    std::uint32_t stops = 0; ///< stops begun, modulo 2^16

    std::uint32_t word() const noexcept {
        return static_cast<std::uint32_t>(phase) | static_cast<std::uint32_t>(outcome) << 4 |
               static_cast<std::uint32_t>(failure) << 8 | std::uint32_t{is_ready} << 12 |
               std::uint32_t{sees_bus} << 13 | stops << 16;
    }
    static Status of(std::uint32_t word) noexcept {
        return {.phase = static_cast<Phase>(word & 0xf),
                .outcome = static_cast<Outcome>(word >> 4 & 0xf),
                .failure = static_cast<Failure>(word >> 8 & 0xf),
                .is_ready = (word >> 12 & 1) != 0,
                .sees_bus = (word >> 13 & 1) != 0,
                .stops = word >> 16};
    }
};

/// What the guardian has done, for a message.
struct StopRecord {
    Status status;
    StopReason reason = StopReason::none;  ///< of the last stop
    std::uint32_t earlier = 0;             ///< reasons of those before, four bits each
    std::uint32_t rounds = 0;              ///< sent in it
    std::int64_t elapsed_ns = 0;           ///< from its begin to the last frame
    std::uint32_t unsent = 0;              ///< a bit for each frame of the last attempt

    static constexpr unsigned max_earlier = 7;

    /// A stop begins.
    void begin(StopReason next) noexcept {
        earlier = earlier << 4 | static_cast<std::uint32_t>(reason);
        earlier &= (1U << 4 * max_earlier) - 1;
        reason = next;
    }
    /// Returns the record of the begin of the `n`th stop before the last one, 1..max_earlier.
    StopRecord before(unsigned n) const noexcept {
        StopRecord record;
        record.status = status;
        record.reason = static_cast<StopReason>(earlier >> 4 * (n - 1) & 0xf);
        return record;
    }
};

}  // namespace hal::guardian
