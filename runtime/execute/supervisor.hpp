// SPDX-License-Identifier: MIT
// Supervises the real-time threads: it stops a thread that finishes no cycle within its limit, sets
// the thread's outputs to their safe values and reports the cause to the session. It is an ordinary
// thread whose priority is above those of the supervised threads where the system grants that, so
// that an endless loop cannot block it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include <pthread.h>

#include "execute/core.hpp"
#include "execute/scheduler_view.hpp"
#include "hal/queue.hpp"
#include "hal/supervision.h"

namespace hal {

/// What the supervisor found when a thread hung.
struct Stall {
    enum class Cause : std::uint8_t {
        busy,  ///< uses CPU time: a long computation or an endless loop
        waiting,  ///< blocked in the kernel
        stopped,  ///< by a debugger or a signal
        starved,  ///< ready to run, but gets no CPU time
        process,  ///< the whole process got no CPU time
        suspended,  ///< the host was suspended
        ended,  ///< a function ended the thread
    };
    static constexpr std::size_t max_starved = 8;
    Cause cause = Cause::busy;
    bool demoted = false;  ///< lost its real-time priority
    std::uint32_t thread = 0;  ///< Core::id
    /// the model's number; 0: between two functions or two cycles
    std::uint32_t function = 0;
    /// starved: Core::id of the thread that uses its CPU; 0: unknown
    std::uint32_t occupant = 0;
    std::int32_t tracer = 0;
    std::int32_t cpu = -1;  ///< process ID of the debugger; CPU the thread is bound to
    std::uint64_t cycle = 0;
    std::int64_t time_ns = 0;
    std::int64_t silent_ns = 0;
    std::int64_t limit_ns = 0;
    std::uint32_t starved[max_starved]{};  ///< Core::id of further threads that got no CPU time
    std::uint32_t starved_count = 0;
};

class Supervisor {
public:
    explicit Supervisor(FaultBoard& board);
    ~Supervisor();
    Supervisor(const Supervisor&) = delete;

    // [setup], like all below
    /// Begins to supervise a thread. `priority`: of SCHED_FIFO, 0: another policy; `cpu`: -1: not
    /// bound to a CPU.
    void add(Core& core, pthread_t thread, int tid, int priority, int cpu);
    /// Ends the supervision of a thread; waits until actions on it are complete.
    void remove(const Core& core);
    /// Waits until no action on any thread is in progress; called after a plan was taken and before
    /// the old one is freed.
    void fence();
    void set_priority(const Core& core, int priority);
    /// Lets the thread's functions run again, at their previous priority. Returns false if the
    /// thread still hangs.
    bool reset(Core& core);
    /// Returns true if the thread is late and ready to run, but has got no CPU time, or hardly any,
    /// since it is late.
    bool starved(const Core& core);
    /// Returns a thread of the machine that goes before this one on its CPU; `is_busy`: only one
    /// whose cycle is under way. nullptr: there is no such thread.
    const Core* rival_of(const Core& core, bool is_busy);
    /// Returns true if a function has ended the thread by a system call of its own.
    bool ended(const Core& core);
    /// Returns how long the thread was ready to run without running, within the last one to two
    /// seconds before it was late, and since.
    std::int64_t run_delay_ns(const Core& core);
    /// Returns true if the thread has lost its real-time priority.
    bool demoted(const Core& core);
    /// Removes and returns the oldest fault in the queue.
    bool next(Stall& stall) { return stalls_.pop(stall); }
    /// Whether the process as a whole got no CPU time, or hardly any, in the time before
    /// `until_ns`: how long.
    std::int64_t process_gap_ns(std::int64_t until_ns, std::int64_t silent_ns) const;
    /// Returns true if at least one CPU has no thread bound to it, and while there are no threads.
    bool has_own_cpu() const { return own_cpu_.load(); }
    std::int64_t interval_ns() const { return interval_ns_.load(); }
    /// Sets a file descriptor to which the supervisor writes a byte several times a second while
    /// all supervised threads make progress.
    void feed(int descriptor) { watchdog_.store(descriptor); }
    int feeding() const { return watchdog_.load(); }

    /// given out as extension "hal.supervision/1"; written with atomic builtins
    hal_supervision shared{};

private:
    struct Watched {
        Core* core;
        pthread_t thread;
        int tid, priority, cpu;
        bool demoted = false;
        bool starved = false;  // declared hung because it got no CPU time
        SchedulerUsage mark{};  // when it was first seen late
        // it was seen blocked in the kernel since then
        bool blocked = false;
        // when it was last seen in time, read once a second
        SchedulerUsage usage{};
    };
    void work();
    /// What a look at a thread finds.
    enum class Health {
        unsupervised,  ///< it has no limit
        in_time,
        late,  ///< by more than a quarter of its limit
        behind_hog,  ///< beyond its limit, as is the thread that occupies its CPU
        in_gap,  ///< beyond its limit, without the CPU for a time that it tolerates
        silent,  ///< beyond its limit, or the computer slept for longer
        hung,  ///< declared silent before
    };
    bool look(std::int64_t now_ns, std::int64_t gap_ns, std::int64_t suspended_ns);
    Health assess(const Watched& watched, std::int64_t now_ns, std::int64_t gap_ns,
                  std::int64_t suspended_ns) const;
    /// Forgets what was seen of a cycle that was late.
    static void begin_anew(Watched& watched, std::int64_t now_ns) noexcept;
    bool behind_hog(const Watched& watched, std::int64_t now_ns) const;
    bool in_gap(const Watched& watched, std::int64_t now_ns, std::int64_t gap_ns) const;
    void declare(Watched& watched, std::int64_t now_ns, std::int64_t gap_ns,
                 std::int64_t suspended_ns);
    void name_starved(Watched& hog, Stall& stall, std::int64_t now_ns);
    void declare_busy(Watched& watched, std::int64_t now_ns);
    void demote(Watched& watched, Stall& stall) noexcept;
    void queue(const Stall& stall) noexcept;
    static void look_at_late(Watched& watched) noexcept;
    static bool got_no_cpu(const Watched& watched) noexcept;
    static bool uses_cpu(const Watched& watched) noexcept;
    void find_cause(const Watched& watched, Stall& stall) const;
    void settle_down();  // interval and CPUs, after the threads have changed
    void feed_watchdog(std::int64_t now_ns);
    Watched* find(const Core& core);
    const Watched* rival_of(const Watched& watched, bool is_busy) const;

    FaultBoard& board_;
    // of watched_; its holder inherits the priority of who waits
    pthread_mutex_t mutex_;
    std::vector<Watched> watched_;  // highest priority first
    pthread_t thread_{};
    bool started_ = false;
    int wake_ = -1;  // eventfd
    std::atomic<bool> quit_{false};
    std::atomic<bool> own_cpu_{true};
    std::atomic<std::int64_t> interval_ns_{50'000'000};
    // the newest look, and the newest time without one
    std::atomic<std::int64_t> looked_ns_{0};
    std::atomic<std::int64_t> gap_end_ns_{0};
    std::atomic<std::int64_t> gap_ns_{0};
    std::atomic<int> watchdog_{-1};
    std::int64_t fed_ns_ = 0;
    Queue<Stall> stalls_{64};
};

}  // namespace hal
