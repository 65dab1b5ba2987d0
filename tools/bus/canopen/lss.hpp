// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct LssOptions : Options {
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words(
            "ADDRESS COMMAND",
            "the bus; scan, switch configuration|waiting, select VENDOR PRODUCT REVISION SERIAL, "
            "inquire, node-id N|none, "
            "bit-rate RATE, activate DELAY, store, identify [VENDOR PRODUCT REVISION SERIAL]");
        set.duration("--timeout", timeout_ns,
                     "timeout of one response: 1s, 200ms … (default 1s; each step of a scan 20ms, "
                     "doubled with each retry)");
    }
};

/// `hal can lss`. Returns the exit code.
int run_can_lss(const LssOptions&);

}  // namespace hal::tools
