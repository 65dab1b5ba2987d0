// SPDX-License-Identifier: MIT
// The guardian as its component sees it: starts the process, replaces and ends it.
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
    int lock = -1;       ///< descriptor that the guardian inherits; -1: none
};

/// How long a guardian tries a link that does not accept the frames, beside the time that its
/// schedule takes.
inline constexpr std::int64_t give_up_ns = 10'000'000'000;  // after the end of the process
inline constexpr std::int64_t unload_ns = 2'000'000'000;    // the command waits for it

class GuardianProcess {
public:
    explicit GuardianProcess(GuardianArguments arguments) : arguments_(std::move(arguments)) {}
    ~GuardianProcess() { child_.kill(); }
    GuardianProcess(const GuardianProcess&) = delete;

    /// Starts the process and waits until it has opened the link. Returns the problem, or "".
    /// [setup]
    std::string start();
    /// Starts another one in place of one that has ended, or ends it first. It sends what the first
    /// one has not sent, and all frames again when a reason to stop lasts. Returns the problem, or
    /// "". Belongs to one thread at a time, which may wait; the memory stays the same.
    std::string replace();
    GuardianMemory& memory() const noexcept { return *memory_; }
    /// Waits for its end, for at most `limit_ns`. Returns whether it has ended; called by a thread
    /// that may wait.
    bool has_ended_within(std::int64_t limit_ns) noexcept {
        return child_.has_ended_within(limit_ns);
    }
    /// Continues a guardian that was suspended by a signal. Belongs to the thread that replaces it.
    void resume() const noexcept { child_.resume(); }
    /// Requests the stop frames and the end, and waits for it. Returns false when it has ended in
    /// another way, or had to be killed. [setup]
    bool end(std::int64_t limit_ns) noexcept;

private:
    std::string start_process();

    const GuardianArguments arguments_;
    bus::ChildProcess child_;
    GuardianMemory* memory_ = nullptr;
};

}  // namespace hal::guardian
