// SPDX-License-Identifier: MIT
// Whether LinuxCNC's task is alive. In each cycle of its main loop task writes its status to the
// NML buffer `emcStatus`, shared memory whose header counts the writes: that number is task's
// heartbeat. Nothing else of the buffer is read.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace hal::tools {

class TaskWatch {
public:
    /// `nml`: the NML configuration that names the buffer; `timeout_ns`: longest time between two
    /// cycles, 0: not watched.
    TaskWatch(std::string nml, std::int64_t timeout_ns)
        : nml_(std::move(nml)), timeout_ns_(timeout_ns) {}
    ~TaskWatch();
    TaskWatch(const TaskWatch&) = delete;

    /// Looks at the heartbeat, to be called several times a second: while the caller itself has no
    /// CPU no time passes. Returns how long there was none, in ns, once that exceeds the timeout;
    /// else 0. A task whose count has never changed is not watched.
    std::int64_t silent_ns();

private:
    using Clock = std::chrono::steady_clock;
    void attach();

    std::string nml_;
    std::int64_t timeout_ns_;
    const char* writes_ = nullptr;  ///< in the buffer, which task changes meanwhile
    const void* memory_ = nullptr;
    std::int64_t seen_ = 0;
    std::int64_t silent_ns_ = 0;
    bool beats_ = false;
    Clock::time_point looked_{};
    Clock::time_point attached_{};
};

}  // namespace hal::tools
