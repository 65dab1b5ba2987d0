// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct TraceOptions : Options {
    std::string name;  ///< of the instance; empty: not given
    std::int64_t for_ns = -1;
    std::int64_t keep_ns = -1;
    std::int64_t after_ns = -1;
    bool on_overrun = false;
    bool on_fault = false;
    bool sched = false;

    void declare(OptionSet& set) override {
        set.words("FILE", "Perfetto file to write: NAME.pftrace");
        set.for_how_long(for_ns, "end after 10s …; default: until Ctrl-C");
        set.flag("--on-overrun", on_overrun,
                 "keep the newest events in memory; write them when a cycle ends after its period, "
                 "and exit");
        set.flag("--on-fault", on_fault, "the same when the instance records a fault");
        set.duration("--keep", keep_ns,
                     "with --on-overrun or --on-fault: the time before it (default 5 s)", 1'000'000,
                     "5s or 500ms");
        set.duration("--after", after_ns,
                     "with --on-overrun or --on-fault: the time after it (default 200 ms)");
        set.flag("--sched", sched, "add the context switches of all CPUs (tracefs, as root)");
        set.value("--name", name, "NAME", "instance");
    }
};

/// Runs `hal trace`. Returns the exit code.
int run_trace(const TraceOptions&);

}  // namespace hal::tools
