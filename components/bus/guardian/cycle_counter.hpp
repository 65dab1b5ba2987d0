// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

namespace hal::bus {

/// The heartbeat of a machine, in memory that it shares with its guardian. Written by the cycle.
///
/// Order between the heartbeat and a reason that is held (StopRequests): a thread that runs again
/// counts its cycle first and then releases the reason, and the guardian reads the reason first and
/// then the count. Otherwise a thread that was stopped for a minute is seen as one that hangs:
///   1. the guardian reads the count: that of a minute ago
///   2. the thread runs again: it releases the reason `fault`, and counts
///   3. the guardian reads that no reason is held, so that the missing cycles matter
class CycleCounter {
public:
    /// Counts a cycle; `limit_ns` is the longest time until the next one. [realtime]
    void count(std::int64_t limit_ns) noexcept {
        limit_ns_.store(limit_ns, std::memory_order_relaxed);
        count_.fetch_add(1, std::memory_order_release);
    }
    /// Returns the number of cycles; the limit of the newest is visible then. [any]
    std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }
    std::int64_t limit_ns() const noexcept { return limit_ns_.load(std::memory_order_relaxed); }

private:
    alignas(64) std::atomic<std::uint64_t> count_{0};
    std::atomic<std::int64_t> limit_ns_{0};
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

}  // namespace hal::bus
