// SPDX-License-Identifier: MIT
#pragma once

#include "bus/can/periodic_options.hpp"

namespace hal::tools {

/// `every_ns` is 0 when the frames are sent once.
struct SendOptions : PeriodicOptions {
    void declare(OptionSet& set) override {
        set.words("ADDRESS FRAME",
                  "the bus; frames in candump format: 123#1122AABB, 18FF0001#00, 123#R4, "
                  "123##1AABB (FD)");
        set.duration("--every", every_ns, "send them periodically with this interval", 1);
        set.for_how_long(for_ns, "with --every: end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("-n,--count", count, "N", "with --every: end after N rounds");
    }
};

/// `hal can send`. Returns the exit code.
int run_can_send(const SendOptions&);

}  // namespace hal::tools
