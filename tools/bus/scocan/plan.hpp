// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct ScocanPlanOptions : Options {
    bool json = false;
    std::string svg;   ///< a file for the picture; -: standard output; empty: not given
    std::string mode;  ///< number or name; empty: mode 0

    void declare(OptionSet& set) override {
        set.word("FILE", "table of the bus, NAME.scocan");
        set.flag("--json", json, "print JSON");
        set.value("--svg", svg, "FILE",
                  "draw the slots and the latencies to this file; -: standard output");
        set.value("--mode", mode, "MODE", "mode of the table, by number or name; default 0");
    }
};

/// `hal scocan plan`. Returns the exit code.
int run_scocan_plan(const ScocanPlanOptions&);

}  // namespace hal::tools
