// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct DumpOptions : Options {
    std::vector<std::string> filters;
    std::uint64_t count = 0;   ///< 0: unlimited
    std::int64_t for_ns = -1;  ///< -1: not given
    std::string time;          ///< relative (the default), delta or absolute
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("ADDRESS", "one or more buses: " + bus_address());
        declare_filter(set, filters, count);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("--time", time, "relative|delta|absolute",
                  "relative: seconds since the first frame (default); delta: since the previous "
                  "frame; absolute: since 1970, as in a .log file");
        set.flag("--json", json,
                 "print a JSON object per line; the last one of each bus has its statistics");
    }
};

/// `hal can dump`. Returns the exit code.
int run_can_dump(const DumpOptions&);

}  // namespace hal::tools
