// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

namespace hal::tools {

/// The wake-up latency of a periodic thread.
struct Jitter {
    /// scheduling of the thread: "SCHED_FIFO 98" or "SCHED_OTHER (no privilege)"
    std::string policy;
    std::uint64_t cycles = 0;
    double p50_ns = 0;
    double p99_ns = 0;
    double max_ns = 0;
};

/// Runs an empty periodic thread for the given duration, at the highest permitted priority, with
/// memory locked. It sleeps until `spin_ns` before each deadline, then spins. Takes `duration_ns`.
/// [setup]
Jitter measure_jitter(std::int64_t period_ns, std::int64_t spin_ns, std::int64_t duration_ns);

}  // namespace hal::tools
