// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct SniffOptions : Options {
    std::vector<std::string> filters;
    std::uint64_t count = 0;   ///< 0: unlimited
    std::int64_t for_ns = -1;  ///< -1: not given
    bool once = false;

    void declare(OptionSet& set) override {
        set.word("ADDRESS", bus_address());
        declare_filter(set, filters, count);
        set.for_how_long(for_ns, "listen for 2s, 500ms … (default 2s; on a terminal until Ctrl-C)");
        set.flag("--once", once, "print one table at the end, also on a terminal");
    }
};

/// `hal can sniff`. Returns the exit code.
int run_can_sniff(const SniffOptions&);

}  // namespace hal::tools
