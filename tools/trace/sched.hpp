// SPDX-License-Identifier: MIT
// What the kernel ran meanwhile: context switches from tracefs where it may be read, and the
// waiting times of threads from /proc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trace/perfetto.hpp"

namespace hal::tools {

/// Reads sched_switch events through an instance of tracefs of its own, which the destructor
/// removes; other users of tracefs are not disturbed.
class SchedulerEvents {
public:
    SchedulerEvents() = default;
    ~SchedulerEvents();
    SchedulerEvents(const SchedulerEvents&) = delete;

    /// Begins. Returns an error message, or an empty string.
    std::string open();
    /// Returns the events that have come.
    std::vector<Switch> take();

private:
    std::string folder_;
    int pipe_ = -1;
    std::string rest_;  ///< an incomplete line
};

/// Parses a line of trace_pipe; nothing for lines of another kind.
std::optional<Switch> read_switch(std::string_view line);

/// How long a thread has run, and how long it waited for a CPU although it could have run; nothing
/// when it is gone.
struct ThreadTimes {
    std::int64_t ran_ns = 0;
    std::int64_t waited_ns = 0;
};
std::optional<ThreadTimes> thread_times(std::int64_t pid, int tid);

}  // namespace hal::tools
