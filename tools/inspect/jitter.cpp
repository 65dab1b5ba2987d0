// SPDX-License-Identifier: MIT
#include "inspect/jitter.hpp"

#include <memory>
#include <pthread.h>
#include <sys/mman.h>
#include <thread>

#include "execute/core.hpp"
#include "execute/histogram.hpp"
#include "execute/wait.hpp"

namespace hal::tools {

Jitter measure_jitter(std::int64_t period_ns, std::int64_t spin_ns, std::int64_t duration_ns) {
    Jitter result;
    const auto lateness = std::make_unique<Histogram>();
    const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    std::thread([&] {
        sched_param wanted{};
        wanted.sched_priority = 98;
        const bool fifo = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted) == 0;
        result.policy = fifo ? "SCHED_FIFO 98" : "SCHED_OTHER (no privilege)";
        const Wait wait{spin_ns};
        const std::int64_t start = monotonic_ns() + 10 * period_ns;
        const std::int64_t end = start + duration_ns;
        for (std::int64_t due = start; due < end; ++result.cycles) {
            wait.sleep(due);
            const std::int64_t woke = Wait::spin(due);
            lateness->add(woke - due);
            due += period_ns;
            // the grid stays, as in the executor
            if (woke >= due) {
                due += (woke - due) / period_ns * period_ns + period_ns;
            }
        }
    }).join();
    if (locked) {
        ::munlockall();
    }
    result.p50_ns = lateness->quantile(0.5);
    result.p99_ns = lateness->quantile(0.99);
    result.max_ns = static_cast<double>(lateness->max_ns());
    return result;
}

}  // namespace hal::tools
