// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct ReadAllOptions : Options {
    std::string eds, output;
    bool json = false;
    std::int64_t timeout_ns = 0;  ///< of one answer; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE", "the bus; a node 1-127");
        declare_eds(set, eds, "the node's description, EDS, DCF or XDD: which objects it has");
        set.value("-o,--output", output, "FILE.csv", "a CSV file instead of a table on standard output");
        set.flag("--json", json, "as JSON, a line per object");
        declare_timeout(set, timeout_ns);
    }
};

/// `hal can read-all`. Returns the exit code.
int run_can_read_all(const ReadAllOptions&);

}  // namespace hal::tools
