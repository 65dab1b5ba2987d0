// SPDX-License-Identifier: MIT
// The memory in which the component and its guardian meet. Every member has one writer; all are
// lock-free atomics.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "fieldbus/guardian/stop_transmitter.hpp"

namespace hal::guardian {

/// Why the frames are sent.
enum class StopReason : std::uint32_t {
    none,
    unload,     ///< the component ends
    fault,      ///< the thread was stopped, or a fault
    estop,      ///< the pin estop
    heartbeat,  ///< no cycle
    death,      ///< the process ended
};
inline constexpr const char* reason_texts[] = {
    "none",
    "the component is unloaded",
    "its function was stopped, or its thread has a fault",
    "the pin estop is TRUE",
    "no cycle has run",
    "the process has ended"};
/// [any]
constexpr std::uint32_t bit_of(StopReason reason) noexcept {
    return std::uint32_t{1} << static_cast<std::uint32_t>(reason);
}

enum class Phase : std::uint32_t {
    starting,
    watching,  ///< the link is open
    stopping,  ///< sends the frames
    stopped,   ///< has sent them, or has given up; the reason may last
    ended,
};

/// What the guardian has done, in one word, so that its parts are of the same moment.
struct Status {
    Phase phase = Phase::starting;
    Outcome outcome = Outcome::none;  ///< of the last stop
    std::uint32_t stops = 0;          ///< stops begun, modulo 2^16

    std::uint32_t word() const noexcept {
        return static_cast<std::uint32_t>(phase) | static_cast<std::uint32_t>(outcome) << 8 |
               stops << 16;
    }
    static Status of(std::uint32_t word) noexcept {
        return {static_cast<Phase>(word & 0xff), static_cast<Outcome>(word >> 8 & 0xff),
                word >> 16};
    }
};

struct GuardianMemory {
    // written by the cycle
    alignas(64) std::atomic<std::uint64_t> heartbeat{0};  ///< cycles
    std::atomic<std::int64_t> limit_ns{0};                ///< longest time between two cycles
    // written by any thread of the runtime
    /// requests to stop; a count, so that one that is over at once is seen
    alignas(64) std::atomic<std::uint32_t> stop_count{0};
    std::atomic<std::uint32_t> stop_reason{0};  ///< of the last request
    std::atomic<std::uint32_t> stop_held{0};    ///< bits of reasons that last
    std::atomic<std::uint32_t> ending{0};       ///< stop, then end
    // written by the guardian
    alignas(64) std::atomic<std::uint32_t> status{0};  ///< Status
    std::atomic<std::uint32_t> reason{0};              ///< of the last stop
    std::atomic<std::uint32_t> rounds{0};              ///< sent in it
    std::atomic<std::int64_t> elapsed_ns{0};           ///< from its begin to the last frame
    std::atomic<std::uint64_t> turns{0};               ///< each waits for at most 5 ms
    /// why the guardian could not start; written before Phase::ended
    std::array<char, 256> problem{};

    /// Requests a stop. [any]
    void stop(StopReason why) noexcept {
        stop_reason.store(static_cast<std::uint32_t>(why), std::memory_order_relaxed);
        stop_count.fetch_add(1, std::memory_order_release);
    }
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);

}  // namespace hal::guardian
