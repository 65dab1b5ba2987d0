// SPDX-License-Identifier: MIT
// Wall time of the cycles of a virtual clock, where no supervisor is: one that never ends is
// reported while it runs.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "execute/cycle_now.hpp"

namespace hal {

/// Decides when a long cycle is reported and when it ends the process. Reports are rate-limited
/// over all cycles, because a component that is slow in every cycle, for example under a sanitizer,
/// does not hang.
class CycleTimeLimit {
public:
    static constexpr std::int64_t first_report_ns = 10'000'000'000;

public:
    static constexpr std::int64_t max_pause_ns = 600'000'000'000;
    enum class Action : std::uint8_t { none, report, end };

    /// What the cycle does that runs now, if any, in real time. [any]
    Action check(const CycleNow& now, std::int64_t now_ns) noexcept;
    /// A cycle of so much wall time ends the process; 0: none does.
    std::int64_t limit_ns = 0;

    bool in_cycle() const noexcept { return seen_.core != nullptr; }
    std::int64_t cycle_ns(std::int64_t now_ns) const noexcept { return now_ns - cycle_since_ns_; }
    std::int64_t function_ns(std::int64_t now_ns) const noexcept {
        return now_ns - function_since_ns_;
    }
    /// The cycle was in one function all the time, as far as was seen.
    bool one_function() const noexcept { return function_since_ns_ == cycle_since_ns_; }
    std::uint64_t slow_cycles() const noexcept { return slow_cycles_; }

private:
    CycleNow seen_{};
    std::int64_t cycle_since_ns_ = 0;
    std::int64_t function_since_ns_ = 0;
    std::int64_t reported_ns_ = 0;
    std::int64_t pause_ns_ = first_report_ns;  // reported_ns_ 0: never
    std::uint64_t slow_cycles_ = 0;  // longer than first_report_ns
    bool slow_ = false;  // this one is counted
};

/// While it lives, watches the cycles of all virtual clocks of the process from a thread of its
/// own.
class CycleGuard {
public:
    /// After the end of the run was asked for.
    static constexpr std::int64_t ending_limit_ns = 2'000'000'000;

    CycleGuard() = default;
    ~CycleGuard();
    CycleGuard(const CycleGuard&) = delete;

    /// `limit_ns`: a cycle of so much wall time ends the process with status 1; 0: none does.
    void begin(std::int64_t limit_ns);
    /// The end of the run was asked for: the cycle that runs gets two seconds more.
    void end_soon();

private:
    void work();
    std::mutex mutex_;
    std::condition_variable wake_;
    CycleTimeLimit time_limit_;
    bool over_ = false;
    std::thread thread_;
};

}  // namespace hal
