// SPDX-License-Identifier: MIT
// The trace of a session: what each thread ran, cycle by cycle, for one observer at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "execute/trace.hpp"

namespace hal {

class Core;
struct MachineView;

/// A thread as a viewer of traces names it.
struct TracedThread {
    std::string name;
    std::int64_t period_ns = 0;
    int tid = 0;                     ///< of the operating system
    int cpu = -1;                    ///< -1: not bound to one
    bool operator==(const TracedThread&) const = default;
};

struct TraceBatch {
    struct Part {
        TracedThread thread;
        std::vector<TraceEvent> events;
        std::uint64_t lost = 0;      ///< events that did not fit since the part before
    };
    std::vector<Part> parts;         ///< only threads that have something to report
    /// of functions in it that no earlier batch has named
    std::map<std::uint32_t, std::string> names;
};

/// Part of a Session. [setup]
class Traces {
public:
    explicit Traces(const MachineView& machine) : machine_(machine) {}

    /// Begins to record. Returns an error message, or an empty string.
    std::string begin();
    /// Ends it. What was not taken is discarded.
    void end();
    /// Takes the events that have come, at most so many of each thread. Threads that were added
    /// meanwhile are recorded from now on.
    TraceBatch take(std::size_t max = 1 << 14);

private:
    struct Ring {
        TraceRing ring;
        std::uint64_t lost = 0;  ///< reported so far
    };
    void start(Core& core);

    const MachineView& machine_;
    bool on_ = false;
    std::map<const Core*, Ring*> of_;
    /// kept as long as the session: a thread may be writing to one
    std::vector<std::unique_ptr<Ring>> rings_;
    std::set<std::uint32_t> named_;
};

}  // namespace hal
