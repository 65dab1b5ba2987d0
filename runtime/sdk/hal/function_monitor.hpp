// SPDX-License-Identifier: MIT
// Notices that another function of the same instance no longer runs: it was taken out of its thread
// with `delf`, or never added to one.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>

namespace hal {

/// Returns the fault message of a function in no thread; `so` is the effect. Full names. [setup]
inline std::string missing_function_text(const std::string& running, const std::string& missing,
                                         const std::string& so) {
    return "'" + running + "' runs, but '" + missing + "' does not; " + so + "; type: addf " +
           missing + " THREAD";
}

/// Monitors one function. The monitored function calls ran() in each of its cycles; exactly one
/// other function calls is_missing() in each of its own. The two may be in different threads. Time
/// in which neither runs (`stop`) does not count.
class FunctionMonitor {
public:
    /// Cycles of the slower of the two functions until the monitored one is missing. Fewer are not:
    /// a function is moved with `delf` and `addf` while the machine runs.
    static constexpr std::int64_t tolerated_cycles = 100;

    /// [realtime]
    void ran(std::int64_t period_ns) noexcept {
        period_ns_.store(period_ns, std::memory_order_relaxed);
        runs_.fetch_add(1, std::memory_order_relaxed);
    }

    /// Returns true while the monitored function is missing. [realtime]
    bool is_missing(std::int64_t period_ns) noexcept {
        const std::uint64_t runs = runs_.load(std::memory_order_relaxed);
        if (runs != seen_) {
            seen_ = runs;
            silent_ns_ = 0;
            return false;
        }
        const std::int64_t slower_ns =
            std::max(period_ns, period_ns_.load(std::memory_order_relaxed));
        const std::int64_t limit_ns = tolerated_cycles * slower_ns;
        silent_ns_ = std::min(silent_ns_ + period_ns, limit_ns);
        return silent_ns_ >= limit_ns;
    }

    /// Returns true when the monitored function has not run between the last two calls of
    /// is_missing(). [realtime] as is_missing()
    bool is_late() const noexcept { return silent_ns_ > 0; }

    /// Returns true once the monitored function has run. [realtime]
    bool has_run() const noexcept { return runs_.load(std::memory_order_relaxed) != 0; }

    /// Forgets how long the monitored function has been missing. [setup]
    void restart() noexcept {
        seen_ = runs_.load(std::memory_order_relaxed);
        silent_ns_ = 0;
    }

    static constexpr bool retainable = true;  ///< by hal::Retained

private:
    /// written by the monitored function
    std::atomic<std::uint64_t> runs_{0};
    std::atomic<std::int64_t> period_ns_{0};
    /// of the function that calls is_missing()
    std::uint64_t seen_ = 0;
    std::int64_t silent_ns_ = 0;
};

}  // namespace hal
