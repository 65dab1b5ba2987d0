// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct ReadAllOptions : Options {
    std::string eds, output;
    bool json = false;
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE", "the bus; node ID 1..127");
        declare_eds(set, eds, "device description (EDS, DCF, XDD) with the objects of the node");
        set.value("-o,--output", output, "FILE.csv",
                  "write a CSV file instead of a table on standard output");
        set.flag("--json", json, "print JSON, a line per object");
        declare_timeout(set, timeout_ns);
    }
};

/// `hal can read-all`. Returns the exit code.
int run_can_read_all(const ReadAllOptions&);

}  // namespace hal::tools
