// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct NodesOptions : Options {
    std::int64_t for_ns = -1;  ///< -1: not given
    bool once = false;
    bool json = false;

    void declare(OptionSet& set) override {
        set.word("ADDRESS", bus_address());
        set.for_how_long(for_ns, "listen for 2s, 500ms … (default 2s; on a terminal until Ctrl-C)");
        set.flag("--once", once, "print one table at the end, also on a terminal");
        set.flag("--json", json, "print JSON at the end");
    }
};

/// `hal can nodes`. Returns the exit code.
int run_can_nodes(const NodesOptions&);

}  // namespace hal::tools
