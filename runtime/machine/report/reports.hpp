// SPDX-License-Identifier: MIT
// What a session reports: state and latency of its threads, faults, delays of signals, missing
// privileges.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hal {

class FaultLog;
struct MachineView;
struct Thread;

/// State and timing of one thread since its start, for `show thread`, the report at the end and the
/// protocol.
struct ThreadReport {
    std::string name;
    std::int64_t period_ns = 0;
    std::uint64_t cycles = 0;
    std::uint64_t missed = 0;
    std::uint64_t overruns = 0;  ///< cycles that ended after the next deadline
    std::uint64_t over_budget = 0;  ///< cycles over the budget, or of 10 periods and more
    /// cycles that the following figures are of; 0: none was measured, as on the virtual clock
    std::uint64_t measured = 0;
    double wakeup_p50_ns = 0;
    double wakeup_p99_ns = 0;
    double wakeup_max_ns = 0;  ///< wake-up latency
    /// execution time of the whole cycle
    double busy_p50_ns = 0;
    double busy_p99_ns = 0;
    double busy_max_ns = 0;
    /// "SCHED_FIFO 98", "SCHED_OTHER (no privilege)", "virtual clock"
    std::string policy;
    int cpu = -1;  ///< -1: not bound to a CPU
    std::uint64_t page_faults = 0;  ///< minor and major, in cycles after the first 100
    bool faulted = false;  ///< stopped by a fault
    /// finishes no cycle; the supervisor has stopped its functions
    bool hung = false;
    std::uint64_t hangs = 0;  ///< number of hangs since the start
    /// number of gaps without CPU that did not stop it, and the length of the newest
    std::uint64_t gaps = 0;
    std::int64_t gap_ns = 0;
    std::int64_t silent_ns = 0;  ///< hung: time since its last finished cycle
    std::string function;  ///< hung: the function that does not return; empty: none
    bool supervised = true;  ///< false with supervise=off

    /// Returns one of the durations above as text; "-": no cycle was measured.
    std::string figure(double ns) const;
};

/// The distribution of a thread's durations since its start: lower edge (ns) and count of each
/// bucket that is not empty, in turn. A bucket is an eighth of a power of two wide, 1 ns below 8
/// ns.
struct ThreadHistograms {
    std::vector<std::uint64_t> wakeup, busy;
};

/// The external clock reference that disciplines the threads, while it is received.
struct ClockReport {
    std::string leader;  ///< the instance that provides it
    /// time since the newest adjustment; nullopt: there was none
    std::optional<std::int64_t> idle_ns;
    /// offset of the threads' release times from CLOCK_MONOTONIC; positive: later
    std::int64_t shift_ns = 0;
    double rate = 0;  ///< rate offset from CLOCK_MONOTONIC; 200e-6 is 200 ppm slower
};

/// One recorded fault with its message.
struct FaultRecord {
    std::uint64_t number = 0;  ///< counts from 1
    std::int64_t age_ns = 0;
    std::uint64_t cycle = 0;
    std::string thread, code, sentence;  ///< sentence: what happened, in which cycle, what was done
    /// faults of the same kind, less than 2 s apart, that this record stands for
    std::uint64_t count = 1;
    std::int64_t span_ns = 0;  ///< from the first of them to the last
    bool varied = false;  ///< they have different error numbers
    /// equal for faults that differ in time, measured value and error number only
    std::string kind = {};
    bool lasts = false;  ///< its condition is not over: it cannot be acknowledged

    /// Returns the sentence and, when there is more than one, the count.
    std::string line() const;
    /// Returns the sentence up to its cycle: what happened.
    std::string subject() const;
};

/// Part of a Session. [setup]
class Reports {
public:
    /// `refused`: the privileges that the system has denied.
    Reports(const MachineView& machine, FaultLog& faults, const std::string& instance,
            const std::vector<std::string>& refused)
        : machine_(machine), faults_(faults), instance_(instance), refused_(refused) {}

    std::vector<ThreadReport> threads() const;
    ThreadReport thread(const Thread& thread) const;
    ThreadHistograms histograms(const Thread& thread) const;
    /// Returns nothing while the threads run by their own clock.
    std::optional<ClockReport> clock() const;

    /// Returns the newest 1000 faults, the oldest first.
    std::vector<FaultRecord> faults() const;
    /// Returns the number of faults that are not acknowledged. [any]
    std::uint64_t fault_count() const;
    /// Acknowledges all faults whose condition is over, and forgets their records. Returns those
    /// that last.
    std::vector<FaultRecord> clear_faults();
    /// Returns the faults that clear_faults() would leave, the oldest first.
    std::vector<FaultRecord> lasting_faults() const;
    /// Returns the number of faults that cannot be acknowledged, because their condition lasts.
    /// [any]
    std::uint64_t lasting_count() const;

    /// Returns one line per signal: writer => reader, delay in cycles and the reason; sorted.
    std::vector<std::string> latencies() const;
    /// Returns a line for each missing real-time privilege, with the command that grants it.
    std::vector<std::string> missing_privileges() const;
    /// Returns the state of the instance, its threads and faults as lines "KEY VALUE"
    /// (hal/status.h).
    std::string status_text() const;

private:
    const MachineView& machine_;
    FaultLog& faults_;
    const std::string& instance_;
    const std::vector<std::string>& refused_;
};

}  // namespace hal
