// SPDX-License-Identifier: MIT
// What a thread samples for observers: which values, and the ring of rows it puts them in. Attached
// and detached while the thread runs.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/abi.h"

namespace hal::plan {

/// Rows of one probe in one thread: the number of the cycle, the time it was due, and a value per
/// column. The thread writes, one reader reads; neither waits. A row that does not fit is counted
/// and dropped.
///   1. writer stores the row at head     2. writer publishes head + 1 (release)
///   3. reader sees head (acquire), copies   4. reader publishes tail + 1 (release)
class ProbeRing {
public:
    /// Allocates and touches memory for at least `rows` rows. [setup]
    ProbeRing(std::size_t columns, std::size_t rows, std::uint64_t every_nth)
        : width(columns + 2),
          every(every_nth),
          mask_(std::bit_ceil(rows < 2 ? std::size_t{2} : rows) - 1),
          words_(std::make_unique<std::uint64_t[]>((mask_ + 1) * width)) {}

    const std::size_t width;  ///< words of a row
    const std::uint64_t every;  ///< cycles from one row to the next

    /// Adds a row when the cycle is one of those to be sampled: its number is a multiple of
    /// `every`, or it is the first after a skipped one that is. [realtime] writer
    void sample(std::uint64_t cycle, std::int64_t time_ns, const hal_value* const* from) noexcept {
        if (every == 1) {
            put(cycle, time_ns, from);
        } else if (next_ == 0 && cycle % every != 0) {
            next_ = (cycle / every + 1) * every;
        } else if (cycle >= next_) {
            next_ = (cycle / every + 1) * every;
            put(cycle, time_ns, from);
        }
        reached_.store(time_ns + 1, std::memory_order_release);
    }

    /// Returns the number of rows that can be read. [any] reader
    std::size_t size() const noexcept {
        return head_.load(std::memory_order_acquire) - tail_.load(std::memory_order_relaxed);
    }
    /// Returns the row `n` after the oldest; n < size(). [any] reader
    const std::uint64_t* row(std::size_t n) const noexcept {
        return &words_[((tail_.load(std::memory_order_relaxed) + n) & mask_) * width];
    }
    /// Removes the oldest rows. [any] reader
    void drop(std::size_t count) noexcept {
        tail_.store(tail_.load(std::memory_order_relaxed) + count, std::memory_order_release);
    }
    /// Returns how many rows did not fit since the ring was made. [any]
    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_acquire); }
    /// All rows of cycles due before this time are in the ring; 0 before the first cycle. [any]
    std::int64_t reached_ns() const noexcept { return reached_.load(std::memory_order_acquire); }

private:
    void put(std::uint64_t cycle, std::int64_t time_ns, const hal_value* const* from) noexcept {
        const std::size_t head = head_.load(std::memory_order_relaxed);
        if (head - seen_tail_ > mask_) {
            seen_tail_ = tail_.load(std::memory_order_acquire);
            if (head - seen_tail_ > mask_) {
                lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
                return;
            }
        }
        std::uint64_t* const row = &words_[(head & mask_) * width];
        row[0] = cycle;
        row[1] = static_cast<std::uint64_t>(time_ns);
        // a value in a cell may be written by another thread meanwhile
        for (std::size_t i = 2; i < width; ++i) {
            row[i] = __atomic_load_n(&from[i - 2]->raw, __ATOMIC_RELAXED);
        }
        head_.store(head + 1, std::memory_order_release);
    }

    const std::size_t mask_;
    std::unique_ptr<std::uint64_t[]> words_;
    alignas(64) std::atomic<std::size_t> head_{0};  // written by the writer, as are the next four
    std::size_t seen_tail_ = 0;
    std::uint64_t next_ = 0;
    std::atomic<std::uint64_t> lost_{0};
    std::atomic<std::int64_t> reached_{0};
    alignas(64) std::atomic<std::size_t> tail_{0};  // written by the reader
};

/// One probe's part in one thread: where its values are in the thread's plan.
struct Probe {
    std::shared_ptr<ProbeRing> ring;
    std::vector<const hal_value*> from;
};

/// All probes of a thread. Taken with a plan, or by itself while the plan stays.
struct ProbeSet {
    std::uint64_t epoch = 0;
    std::vector<Probe> probes;
};

}  // namespace hal::plan
