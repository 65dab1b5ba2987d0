// SPDX-License-Identifier: MIT
// What a thread notes about its cycles, and what others conclude from it: how long the newest cycle
// has lasted, which periods had none, whether the thread hangs.
#pragma once

#include <atomic>
#include <cstdint>

#include "execute/cycle_mark.hpp"

namespace hal {

/// The cycles of one thread, seen by the thread itself, by the supervisor and by the session.
class CycleMonitor {
public:
    explicit CycleMonitor(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

    // --- by the thread ---------------------------------------------------------------------------
    /// Begins supervision: the thread must finish its first cycle, which is due at `due_ns`, and
    /// all others. [realtime]
    void begin(std::int64_t now_ns, std::int64_t due_ns) noexcept;
    /// The cycle that was due at `due_ns` begins. Not called under the virtual clock. [realtime]
    void begin_cycle(std::int64_t due_ns, std::int64_t woke_ns) noexcept;
    /// [realtime]
    void end_cycle(std::int64_t end_ns) noexcept;
    /// Counts periods in which no cycle ran. [realtime]
    void skip(std::uint64_t periods) noexcept;
    /// Returns for how long no cycle has ended when the one that was due at `due_ns` begins only
    /// now; 0: for no longer than is permitted, or it is counted as a gap. [realtime]
    std::int64_t silence_before(std::int64_t due_ns, std::int64_t now_ns) noexcept;
    /// What supervision makes of the length of a cycle.
    enum class Length {
        permitted,
        gap,  ///< longer, because others had the CPU: counted
        silent,
    };
    /// Returns it for the cycle that began at `woke_ns` and has just ended. [realtime]
    Length length(std::int64_t woke_ns, std::int64_t now_ns) noexcept;
    /// Returns the step at which the newest sample found the cycle that began at `woke_ns`;
    /// nullptr: that cycle has no sample. [realtime]
    const plan::Step* sampled_step(std::int64_t woke_ns) const noexcept;

    // --- by the supervisor -----------------------------------------------------------------------
    /// A thread that was created now and has not begun yet must finish its first cycle one period
    /// later. [setup]
    void expect(std::int64_t now_ns) noexcept;
    /// Restarts the time without a finished cycle, because another thread used the CPU until now.
    /// Not called by the thread itself
    void excuse(std::int64_t now_ns) noexcept { excused_.store(now_ns, std::memory_order_release); }
    /// Notes the step that the running cycle is at, so that an overrun report can name it.
    void sample(const CycleMark& mark) noexcept;

    // --- by everyone -----------------------------------------------------------------------------
    /// Notes that the running or due cycle does not end. Returns false if that is known. [any]
    bool declare_hung() noexcept;
    /// Returns true while the thread is declared hung and no cycle has ended since. [any]
    bool hung() const noexcept {
        return hung_at_.load(std::memory_order_acquire) ==
               cycles_.load(std::memory_order_acquire) + 1;
    }
    /// Returns the number of finished cycles. [any]
    std::uint64_t cycles() const noexcept { return cycles_.load(std::memory_order_acquire); }
    /// Returns when the newest cycle ended, CLOCK_MONOTONIC. [any]
    std::int64_t finished_ns() const noexcept { return finished_.load(std::memory_order_acquire); }
    /// Returns when the running cycle began (CLOCK_MONOTONIC); 0 between cycles and under the
    /// virtual clock. [any]
    std::int64_t busy_since_ns() const noexcept {
        return busy_since_.load(std::memory_order_acquire);
    }
    /// Returns the time from which the running or next cycle counts as unfinished; in the future
    /// while it is not due yet. [any]
    std::int64_t overdue_since_ns() const noexcept;
    /// Returns the periods in which no cycle ran, as far as the thread has counted them. [any]
    std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_acquire); }
    /// Returns the missed periods by the clock: those that the thread has counted, and those that
    /// have passed since. [any]
    std::uint64_t missed_by(std::int64_t now_ns) const noexcept;
    /// Returns how often the thread was declared hung. [any]
    std::uint64_t hangs() const noexcept { return hangs_.load(std::memory_order_relaxed); }

    /// Longest time without a finished cycle; 0: not supervised. Set before the thread begins.
    std::atomic<std::int64_t> supervise_ns{0};
    /// Longest time without CPU above the supervision limit that is counted as a gap and does not
    /// stop the thread; 0: none.
    std::atomic<std::int64_t> max_gap_ns{0};
    /// number of such gaps; written by the thread
    std::atomic<std::uint64_t> gaps{0};
    /// length of the newest; written by the thread before `gaps`
    std::atomic<std::int64_t> newest_gap_ns{0};

private:
    bool is_tolerant() const noexcept { return max_gap_ns.load(std::memory_order_relaxed) > 0; }
    bool tolerate_gap(std::int64_t silent_ns) noexcept;
    void note_usage() noexcept;
    bool was_preempted() const noexcept;

    const std::int64_t period_ns_;
    std::atomic<std::uint64_t> cycles_{0};  // written by the thread
    std::atomic<std::uint64_t> missed_{0};  // written by the thread
    std::atomic<std::int64_t> busy_since_{0};  // written by the thread
    // of the newest cycle: when it was due and when it ended; written by the thread
    std::atomic<std::int64_t> due_{0};
    std::atomic<std::int64_t> finished_{0};
    std::atomic<std::int64_t> excused_{0};  // written by the supervisor
    // cycles + 1 when it was declared hung; written by thread and supervisor
    std::atomic<std::uint64_t> hung_at_{0};
    std::atomic<std::uint64_t> hangs_{0};
    // the cycle (busy_since_) and the step of the newest sample; the supervisor's
    std::atomic<std::int64_t> seen_since_{0};
    std::atomic<const plan::Step*> seen_step_{nullptr};
    // the thread's own, while gaps are tolerated: at the start of its cycle
    std::int64_t cpu_before_ns_ = 0;
    std::int64_t waits_before_ = 0;
};

}  // namespace hal
