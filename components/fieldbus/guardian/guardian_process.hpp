// SPDX-License-Identifier: MIT
// The guardian as its component sees it: starts the process and ends it.
#pragma once

#include <cstdint>
#include <string>

#include "bus/guardian/child_process.hpp"
#include "fieldbus/guardian/guardian_memory.hpp"

namespace hal::guardian {

/// Arguments of the program hal-frame-guardian, in their order.
struct GuardianArguments {
    std::string program;  ///< its path
    std::string name;     ///< of the instance, for messages
    std::string link;
    std::string frames;         ///< lists as in the netlist
    std::string confirmations;  ///< the same; may be empty
    StopSchedule schedule;
    std::string report;  ///< a file for what it did; empty: none
};

/// How long a guardian tries a link that does not take the frames.
inline constexpr std::int64_t give_up_ns = 10'000'000'000;  // after the end of the process
inline constexpr std::int64_t unload_ns = 2'000'000'000;    // the command waits for it

class GuardianProcess {
public:
    GuardianProcess() = default;
    ~GuardianProcess() { kill(); }
    GuardianProcess(const GuardianProcess&) = delete;

    /// Starts the process and waits until it has opened the link. Returns the problem, or "".
    /// [setup]
    std::string start(const GuardianArguments& arguments);
    GuardianMemory& memory() const noexcept { return *memory_; }
    /// Waits for its end, for at most `limit_ns`. Returns whether it has ended; called by a thread
    /// that may wait.
    bool has_ended_within(std::int64_t limit_ns) noexcept {
        return child_.has_ended_within(limit_ns);
    }
    /// Continues a guardian that was suspended by a signal. [any]
    void resume() const noexcept { child_.resume(); }
    /// Requests the stop frames and the end, and waits for it. Returns false when it had to be
    /// killed. [setup]
    bool end(std::int64_t limit_ns) noexcept;

private:
    void kill() noexcept { child_.kill(); }

    bus::ChildProcess child_;
    GuardianMemory* memory_ = nullptr;
};

}  // namespace hal::guardian
