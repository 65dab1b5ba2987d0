// SPDX-License-Identifier: MIT
// What several threads share above their links, in the journal of the program that uses it
// (docs/internals/journal.md).
#pragma once

#include <atomic>
#include <cstdint>

#include <sched.h>

#include "link/call_journal.hpp"

namespace hal::link {

/// Holds a flag that several threads share. Whether a try succeeds is in the journal, and those that
/// succeed are executed again in their order. Unlike an OrderedCall it may contain calls on links,
/// which are ordered on their own.
///
///   1. thread A sets the flag   2. A takes ticket n   3. A calls links, with tickets up to m
///   4. thread B finds the flag set between 1 and 5, and notes that   5. A clears the flag
///   6. B sets it and takes a ticket above m: in a re-execution it waits for those of A
class OrderedHold {
public:
    enum class Wait : std::uint8_t {
        none,  ///< a cycle: is_held() may be false
        made,  ///< setup
    };
    OrderedHold(std::atomic_flag& flag, Wait wait) noexcept : flag_(flag) {
        const JournalMode mode = journal_mode();
        // a re-execution has one thread, and gets the outcome
        const bool is_repeated = mode == JournalMode::executes_again;
        owns_flag_ = !is_repeated && acquire(wait);
        is_held_ = owns_flag_ || wait == Wait::made;
        if (mode == JournalMode::none) return;
        if (wait == Wait::none) {
            JournaledCall call;
            call.number(is_held_);
        }
        if (is_held_ && hal_journal_order) {
            hal_journal_order();
        }
    }
    ~OrderedHold() {
        if (owns_flag_) {
            flag_.clear(std::memory_order_release);
        }
    }
    OrderedHold(const OrderedHold&) = delete;

    /// Returns false when another thread has it.
    bool is_held() const noexcept { return is_held_; }

private:
    bool acquire(Wait wait) noexcept {
        while (flag_.test_and_set(std::memory_order_acquire)) {
            if (wait == Wait::none) return false;
            sched_yield();
        }
        return true;
    }

    std::atomic_flag& flag_;
    bool owns_flag_ = false;
    bool is_held_ = false;
};

}  // namespace hal::link
