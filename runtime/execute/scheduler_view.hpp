// SPDX-License-Identifier: MIT
// What the scheduler knows of a thread: the CPU time it used, and how long it was ready to run
// without running.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hal {

/// Reads a small file of /proc without allocating: a thread may hang while it holds the allocator's
/// lock. `to` is empty when it cannot be read. [any]
void read_small_file(const char* path, char* to, std::size_t capacity) noexcept;

/// Totals of a thread since its start, in ns. [any]
struct SchedulerUsage {
    std::int64_t taken_ns = 0;  ///< when they were read, CLOCK_MONOTONIC; 0: never
    std::int64_t cpu_ns = 0;
    /// ready to run without running (run delay); the delay that lasts now is not included
    std::int64_t delay_ns = 0;
};
/// Reads /proc/self/task/TID/schedstat. [any]
SchedulerUsage scheduler_usage(int tid) noexcept;

/// State of a thread in /proc/self/task/TID/status: 'R', 'S', 'D' ...; '?': unknown. `tracer`:
/// process ID of its debugger. [any]
struct KernelView {
    char state = '?';
    int tracer = 0;
};
KernelView kernel_view(int tid) noexcept;

}  // namespace hal
