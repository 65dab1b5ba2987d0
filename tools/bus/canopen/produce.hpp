// SPDX-License-Identifier: MIT
// `hal can produce`: the periodic frames of a CANopen master.
#pragma once

#include "bus/can/periodic_options.hpp"

namespace hal::tools {

struct ProduceOptions : PeriodicOptions {
    int counter = 0;  ///< overflow value of the SYNC counter; 0: no counter

    void declare(OptionSet& set) override {
        set.words("ADDRESS KIND",
                  "the bus; heartbeat NODE, sync, or guarding NODE (the requests of a master)");
        set.duration("--every", every_ns, "period (default 100ms; sync 10ms)", 1);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("-n,--count", count, "N", "end after N frames");
        set.value("--counter", counter, "N", "sync: add a counter that overflows at N, 2..240");
    }
};

/// `hal can produce`. Returns the exit code.
int run_can_produce(const ProduceOptions&);

}  // namespace hal::tools
