// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

namespace hal::tools {

/// How late a periodic thread woke up.
struct Jitter {
    std::string policy;  ///< what the thread ran as: "SCHED_FIFO 98" or "SCHED_OTHER (no privilege)"
    std::uint64_t cycles = 0;
    double p50_ns = 0, p99_ns = 0, max_ns = 0;
};

/// Runs an empty periodic thread for the given duration, at the highest permitted priority, with memory locked.
/// It sleeps to each deadline less `spin_ns`, then spins. Takes `duration_ns`; [setup]
Jitter measure_jitter(std::int64_t period_ns, std::int64_t spin_ns, std::int64_t duration_ns);

}  // namespace hal::tools
