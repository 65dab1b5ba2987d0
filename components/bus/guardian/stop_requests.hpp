// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

#include "bus/guardian/stop_reason.hpp"

namespace hal::bus {

/// What the threads of a runtime request of the guardian, in memory that both share. A request is
/// an edge: it is counted, so that the guardian follows one that is over before it looks. A reason
/// that is held is a level: while one is, the guardian does not watch again.
///
/// Count and reason of a request are one word. As two words they could be of different requests:
///   1. a thread stores the reason `estop`
///   2. another one stores the reason `fault`, and counts its request
///   3. the guardian reads the count, and then the reason: it is that of (2), or, with another
///      order of the stores, that of a request which is not yet counted
///   4. the first thread counts: the guardian reads the reason of (2) a second time
///
/// Written by any thread of the runtime; all functions are [any], and async-signal-safe.
class StopRequests {
public:
    struct Request {
        std::uint32_t count = 0;  ///< requests by now, modulo 2^32
        StopReason reason = StopReason::none;
    };

    /// Requests a stop.
    void request(StopReason why) noexcept {
        std::uint64_t before = newest_.load(std::memory_order_relaxed);
        while (!newest_.compare_exchange_weak(before, word_behind(before, why),
                                              std::memory_order_release,
                                              std::memory_order_relaxed)) {
        }
    }
    /// Returns the newest request; what its thread wrote before it is visible.
    Request newest() const noexcept {
        const std::uint64_t word = newest_.load(std::memory_order_acquire);
        return {static_cast<std::uint32_t>(word >> 32), static_cast<StopReason>(word & 0xff)};
    }

    /// Holds a reason. Returns false when it was held already.
    bool hold(StopReason why) noexcept {
        return (held_.fetch_or(bit_of(why), std::memory_order_acq_rel) & bit_of(why)) == 0;
    }
    /// A reason is over.
    void release(StopReason why) noexcept {
        held_.fetch_and(~bit_of(why), std::memory_order_release);
    }
    bool holds(StopReason why) const noexcept {
        return (held_.load(std::memory_order_acquire) & bit_of(why)) != 0;
    }
    bool holds_any() const noexcept { return held_.load(std::memory_order_acquire) != 0; }

    /// Requests a last stop, and the end of the guardian behind it. The reason is held, so that the
    /// guardian does not watch again between the two.
    void end() noexcept {
        hold(StopReason::unload);
        request(StopReason::unload);
        ending_.store(1, std::memory_order_release);
    }
    /// Returns whether the guardian is to end. Every request before end() is visible then.
    bool is_ending() const noexcept { return ending_.load(std::memory_order_acquire) != 0; }

private:
    static constexpr std::uint32_t bit_of(StopReason why) noexcept {
        return std::uint32_t{1} << static_cast<std::uint32_t>(why);
    }
    static constexpr std::uint64_t word_behind(std::uint64_t before, StopReason why) noexcept {
        return ((before >> 32) + 1) << 32 | static_cast<std::uint64_t>(why);
    }

    alignas(64) std::atomic<std::uint64_t> newest_{0};
    std::atomic<std::uint32_t> held_{0};
    std::atomic<std::uint32_t> ending_{0};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

}  // namespace hal::bus
