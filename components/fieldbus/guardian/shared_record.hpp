// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

#include "fieldbus/guardian/stop_record.hpp"

namespace hal::guardian {

/// A StopRecord in shared memory: a sequence lock (seqlock). Written by the guardian.
class SharedRecord {
public:
    void write(const StopRecord& record) noexcept {
        // odd while it is written: also behind a guardian that was killed meanwhile
        const std::uint32_t odd = sequence_.load(std::memory_order_relaxed) | 1;
        sequence_.store(odd, std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_release);
        const auto reason = static_cast<std::uint32_t>(record.reason);
        reasons_.store(record.earlier << 4 | reason, std::memory_order_relaxed);
        rounds_.store(record.rounds, std::memory_order_relaxed);
        elapsed_ns_.store(record.elapsed_ns, std::memory_order_relaxed);
        unsent_.store(record.unsent, std::memory_order_relaxed);
        status_.store(record.status.word(), std::memory_order_release);
        sequence_.store(odd + 1, std::memory_order_release);
    }
    /// Reads the record. Returns false when its parts may be of different moments: the guardian is
    /// writing it for longer than this waits, or was killed meanwhile.
    bool read(StopRecord& record) const noexcept {
        for (int attempt = 0; attempt < 1000; ++attempt) {
            const std::uint32_t before = sequence_.load(std::memory_order_acquire);
            const std::uint32_t reasons = reasons_.load(std::memory_order_relaxed);
            record = {.status = status(),
                      .reason = static_cast<StopReason>(reasons & 0xf),
                      .earlier = reasons >> 4,
                      .rounds = rounds_.load(std::memory_order_relaxed),
                      .elapsed_ns = elapsed_ns_.load(std::memory_order_relaxed),
                      .unsent = unsent_.load(std::memory_order_relaxed)};
            std::atomic_thread_fence(std::memory_order_acquire);
            const std::uint32_t behind = sequence_.load(std::memory_order_relaxed);
            if (before == behind && (before & 1) == 0) return true;
        }
        return false;
    }
    /// Returns the record of a guardian that has ended, as far as it has written it.
    StopRecord last() const noexcept {
        StopRecord record;
        read(record);
        return record;
    }
    /// Returns the newest status alone. [realtime]
    Status status() const noexcept { return Status::of(status_.load(std::memory_order_acquire)); }

private:
    std::atomic<std::uint32_t> sequence_{0};
    std::atomic<std::uint32_t> status_{Status{}.word()};
    std::atomic<std::uint32_t> reasons_{0};  ///< the newest in the low four bits
    std::atomic<std::uint32_t> rounds_{0};
    std::atomic<std::int64_t> elapsed_ns_{0};
    std::atomic<std::uint32_t> unsent_{0};
};

}  // namespace hal::guardian
