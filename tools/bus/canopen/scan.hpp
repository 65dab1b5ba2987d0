// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct ScanOptions : Options {
    std::int64_t for_ns = -1;  ///< -1: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.word("ADDRESS", bus_address());
        set.for_how_long(for_ns,
                         "listen for 2s, 500ms … (default 1s); at least the slowest heartbeat "
                         "period finds stopped nodes too");
        set.flag("--json", json, "print JSON");
    }
};

/// `hal can scan`. Returns the exit code.
int run_can_scan(const ScanOptions&);

}  // namespace hal::tools
