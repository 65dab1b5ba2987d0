// SPDX-License-Identifier: MIT
// The kernel stamps frames on CLOCK_REALTIME, which is set by people and NTP; the runtime uses
// CLOCK_MONOTONIC. Both are slewed alike, so their offset is constant until the former is stepped.
#pragma once

#include <atomic>
#include <cstdint>

#include "link/system.hpp"

namespace hal::ethernet::rawether {

class RealTime {
public:
    RealTime() noexcept { measure(); }

    /// Measures the offset; a change of less than 1 us is measurement error. [any]
    void measure() noexcept {
        std::int64_t narrowest = INT64_MAX;
        std::int64_t distance = 0;
        for (int i = 0; i < 5; ++i) {
            const auto before = link::monotonic_ns();
            const auto real = link::clock_ns(CLOCK_REALTIME);

            const auto after = link::monotonic_ns();
            if (after - before >= narrowest) continue;
            narrowest = after - before;
            distance = before + narrowest / 2 - real;
        }
        const auto held = distance_.load(std::memory_order_relaxed);
        if (held - distance < 1000 && distance - held < 1000) return;
        before_.store(held, std::memory_order_relaxed);
        distance_.store(distance, std::memory_order_relaxed);
    }

    /// Converts the stamp of a frame received after `last_ns` and before `now_ns`, also across a
    /// step of the clock. [realtime]
    std::int64_t to_monotonic(std::int64_t stamp_ns, std::int64_t last_ns,
                              std::int64_t now_ns) noexcept {
        // queues of one interface are not emptied in order
        constexpr std::int64_t disorder_ns = 100'000;
        const auto fits = [&](std::int64_t t) { return t <= now_ns && t >= last_ns - disorder_ns; };
        const auto time = stamp_ns + distance_.load(std::memory_order_relaxed);
        if (fits(time)) return time;
        measure();
        for (const auto* d : {&distance_, &before_}) {
            if (const auto t = stamp_ns + d->load(std::memory_order_relaxed); fits(t)) return t;
        }
        return now_ns;
    }

private:
    // Every thread that measures writes the same value; all read.
    std::atomic<std::int64_t> distance_{INT64_MIN / 2};

private:
    // Every thread that measures writes the same value; all read.
    std::atomic<std::int64_t> before_{INT64_MIN / 2};
};

/// Limits how long a thread spins. The kernel throttles real-time threads that use more than 95 %
/// of a CPU (kernel.sched_rt_runtime_us) for tens of milliseconds: this one sleeps 0.1 ms before
/// that happens. For one thread.
class SpinBudget {
public:
    explicit SpinBudget(bool bounded) noexcept : bounded_(bounded) {}

    /// Accounts for spinning from `from_ns` to `to_ns`. Returns false when the thread must sleep
    /// rest_ns now. [realtime]
    bool spent(std::int64_t from_ns, std::int64_t to_ns) noexcept {
        if (!bounded_) return true;
        credit_ns_ += (to_ns - last_ns_) / 20 * 17 - (to_ns - from_ns);
        last_ns_ = to_ns;
        if (credit_ns_ > max_ns) {
            credit_ns_ = max_ns;
        }
        return credit_ns_ > 0;
    }
    static constexpr std::int64_t rest_ns = 100'000;
    /// Returns true when the kernel throttles. [setup]
    static bool is_needed();

private:
    static constexpr std::int64_t max_ns = 100'000'000;
    const bool bounded_;
    std::int64_t credit_ns_ = max_ns;
    std::int64_t last_ns_ = link::monotonic_ns();
};

inline void pause_processor() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
    asm volatile("yield");
#endif
}
/// Sleeps until a time of CLOCK_MONOTONIC. [realtime], in a thread whose job it is to wait
inline void sleep_until(std::int64_t time_ns) noexcept {
    const timespec t = link::to_timespec(time_ns);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

}  // namespace hal::ethernet::rawether
