// SPDX-License-Identifier: MIT
// The memory in which the component and its guardian meet. Every member has one writer; all are
// lock-free atomics.
#pragma once

#include <atomic>
#include <cstdint>

#include "bus/guardian/cycle_counter.hpp"
#include "bus/guardian/start_state.hpp"
#include "bus/guardian/stop_requests.hpp"
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
    std::uint32_t rounds = 0;              ///< sent in it
    std::int64_t elapsed_ns = 0;           ///< from its begin to the last frame
    std::uint32_t unsent = 0;              ///< a bit for each frame of the last attempt
};

/// A StopRecord in shared memory: a sequence lock (seqlock). Written by the guardian.
class SharedRecord {
public:
    void write(const StopRecord& record) noexcept {
        // odd while it is written: also behind a guardian that was killed meanwhile
        const std::uint32_t odd = sequence_.load(std::memory_order_relaxed) | 1;
        sequence_.store(odd, std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_release);
        reason_.store(static_cast<std::uint32_t>(record.reason), std::memory_order_relaxed);
        rounds_.store(record.rounds, std::memory_order_relaxed);
        elapsed_ns_.store(record.elapsed_ns, std::memory_order_relaxed);
        unsent_.store(record.unsent, std::memory_order_relaxed);
        status_.store(record.status.word(), std::memory_order_release);
        sequence_.store(odd + 1, std::memory_order_release);
    }
    /// Returns parts of the same moment, unless the guardian was killed while it wrote them.
    StopRecord read() const noexcept {
        StopRecord record;
        for (int attempt = 0; attempt < 10'000; ++attempt) {
            const std::uint32_t before = sequence_.load(std::memory_order_acquire);
            record = {.status = status(),
                      .reason = static_cast<StopReason>(reason_.load(std::memory_order_relaxed)),
                      .rounds = rounds_.load(std::memory_order_relaxed),
                      .elapsed_ns = elapsed_ns_.load(std::memory_order_relaxed),
                      .unsent = unsent_.load(std::memory_order_relaxed)};
            std::atomic_thread_fence(std::memory_order_acquire);
            const std::uint32_t behind = sequence_.load(std::memory_order_relaxed);
            if (before == behind && (before & 1) == 0) break;
        }
        return record;
    }
    /// Returns the newest status alone. [realtime]
    Status status() const noexcept { return Status::of(status_.load(std::memory_order_acquire)); }

private:
    std::atomic<std::uint32_t> sequence_{0};
    std::atomic<std::uint32_t> status_{Status{}.word()};
    std::atomic<std::uint32_t> reason_{0};
    std::atomic<std::uint32_t> rounds_{0};
    std::atomic<std::int64_t> elapsed_ns_{0};
    std::atomic<std::uint32_t> unsent_{0};
};

struct GuardianMemory {
    // written by the cycle
    bus::CycleCounter cycles;
    // written by any thread of the runtime
    bus::StopRequests requests;
    // written by the guardian
    alignas(64) SharedRecord record;
    /// StopRequests::Request::count of the last stop that is over: one that follows a guardian that
    /// was killed begins behind it
    std::atomic<std::uint32_t> followed{0};
    std::atomic<std::uint64_t> turns{0};  ///< each waits for at most 5 ms
    bus::StartState start;  ///< and by the component
};

}  // namespace hal::guardian
