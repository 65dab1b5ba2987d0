// SPDX-License-Identifier: MIT
// The kernel stamps frames on CLOCK_REALTIME, which people and NTP set; everything here runs on CLOCK_MONOTONIC. Both are slewed alike,
// so their distance is constant until somebody steps the former.
#pragma once

#include <atomic>
#include <cstdint>

#include "link/system.hpp"

namespace hal::ethernet::rawether {

class RealTime {
public:
    RealTime() noexcept { measure(); }

    /// Measures the distance anew; a change of less than a microsecond is the measurement's. [any]
    void measure() noexcept {
        std::int64_t narrowest = INT64_MAX, distance = 0;
        for (int i = 0; i < 5; ++i) {
            const auto before = link::monotonic_ns(), real = link::clock_ns(CLOCK_REALTIME), after = link::monotonic_ns();
            if (after - before >= narrowest) continue;
            narrowest = after - before;
            distance = before + narrowest / 2 - real;
        }
        const auto held = distance_.load(std::memory_order_relaxed);
        if (held - distance < 1000 && distance - held < 1000) return;
        before_.store(held, std::memory_order_relaxed);
        distance_.store(distance, std::memory_order_relaxed);
    }

    /// A stamp of a frame that came after `last_ns` and before `now_ns`. One that does not fit is of before or after a step. [realtime]
    std::int64_t to_monotonic(std::int64_t stamp_ns, std::int64_t last_ns, std::int64_t now_ns) noexcept {
        constexpr std::int64_t disorder_ns = 100'000;  // queues of one interface are not emptied in order
        const auto fits = [&](std::int64_t t) { return t <= now_ns && t >= last_ns - disorder_ns; };
        const auto time = stamp_ns + distance_.load(std::memory_order_relaxed);
        if (fits(time)) return time;
        measure();
        for (const auto* d : {&distance_, &before_})
            if (const auto t = stamp_ns + d->load(std::memory_order_relaxed); fits(t)) return t;
        return now_ns;
    }

private:
    // Written by whoever measures, to the same value; read by all.
    std::atomic<std::int64_t> distance_{INT64_MIN / 2}, before_{INT64_MIN / 2};
};

/// How long a thread may look for something without sleeping. The kernel stops real-time threads that use more than 95 % of a CPU
/// (kernel.sched_rt_runtime_us), for tens of milliseconds: this one stops itself before, for a tenth of one. Of one thread.
class SpinBudget {
public:
    explicit SpinBudget(bool bounded) noexcept : bounded_(bounded) {}

    /// Looking went on from `from_ns` to `to_ns`; false: sleep rest_ns now. [realtime]
    bool spent(std::int64_t from_ns, std::int64_t to_ns) noexcept {
        if (!bounded_) return true;
        credit_ns_ += (to_ns - last_ns_) / 20 * 17 - (to_ns - from_ns);
        last_ns_ = to_ns;
        if (credit_ns_ > most_ns) credit_ns_ = most_ns;
        return credit_ns_ > 0;
    }
    static constexpr std::int64_t rest_ns = 100'000;
    /// What the kernel has set. [setup]
    static bool is_needed();

private:
    static constexpr std::int64_t most_ns = 100'000'000;
    const bool bounded_;
    std::int64_t credit_ns_ = most_ns, last_ns_ = link::monotonic_ns();
};

inline void pause_processor() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}
/// [realtime], where sleeping is the work
inline void sleep_until(std::int64_t time_ns) noexcept {
    const timespec t{time_ns / 1'000'000'000, time_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

}  // namespace hal::ethernet::rawether
