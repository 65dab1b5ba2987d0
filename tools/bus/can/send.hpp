// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct SendOptions : Options {
    std::int64_t every_ns = 0;  ///< 0: once
    std::int64_t for_ns = -1;   ///< -1: not given
    std::uint64_t count = 0;    ///< 0: unlimited

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
