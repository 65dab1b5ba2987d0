// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct DcfReadOptions : Options {
    std::string eds, output;
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE", "the bus; node ID 1..127");
        declare_eds(set, eds, "device description (EDS, DCF, XDD) with the objects of the node");
        set.value("-o,--output", output, "FILE", "output file (default: standard output)");
        declare_timeout(set, timeout_ns);
    }
};

struct DcfWriteOptions : Options {
    bool check = false;           ///< only compare
    bool other_node = false;      ///< write a DCF that was made for another node or bit rate
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE FILE", "the bus; node ID 1..127; a DCF");
        set.flag("--check", check, "only print the differences; exit code 1 if there are any");
        set.flag("--other-node", other_node,
                 "write a DCF that was made for another node ID or bit rate");
        declare_timeout(set, timeout_ns);
    }
};

/// `hal can dcf read`. Returns the exit code.
int run_can_dcf_read(const DcfReadOptions&);

/// `hal can dcf write`. Returns the exit code.
int run_can_dcf_write(const DcfWriteOptions&);

}  // namespace hal::tools
