// SPDX-License-Identifier: MIT
#include "jitter.hpp"

#include <memory>
#include <pthread.h>
#include <sys/mman.h>
#include <thread>
#include <time.h>

#include "execute/histogram.hpp"

namespace hal::tools {

namespace {

std::int64_t now_ns() {
    timespec t{};
    ::clock_gettime(CLOCK_MONOTONIC, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void sleep_until(std::int64_t ns) {
    const timespec t{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
    }
}

}  // namespace

Jitter measure_jitter(std::int64_t period_ns, std::int64_t spin_ns, std::int64_t duration_ns) {
    Jitter result;
    const auto lateness = std::make_unique<Histogram>();
    const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    std::thread([&] {
        sched_param wanted{};
        wanted.sched_priority = 98;
        const bool fifo = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted) == 0;
        result.policy = fifo ? "SCHED_FIFO 98" : "SCHED_OTHER (no privilege)";
        const std::int64_t start = now_ns() + 10 * period_ns, end = start + duration_ns;
        for (std::int64_t due = start; due < end; ++result.cycles) {
            sleep_until(due - spin_ns);
            std::int64_t woke = now_ns();
            while (woke < due) woke = now_ns();
            lateness->add(woke - due);
            due += period_ns;
            if (woke >= due) due += (woke - due) / period_ns * period_ns + period_ns;  // the grid stays, as in the executor
        }
    }).join();
    if (locked) ::munlockall();
    result.p50_ns = lateness->quantile(0.5);
    result.p99_ns = lateness->quantile(0.99);
    result.max_ns = static_cast<double>(lateness->max_ns());
    return result;
}

}  // namespace hal::tools
