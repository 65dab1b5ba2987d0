// SPDX-License-Identifier: MIT
#pragma once

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct NmtOptions : Options {
    void declare(OptionSet& set) override {
        set.words(
            "ADDRESS COMMAND NODE",
            "the bus; start, stop, preop, reset or reset-comm; node ID 1..127 (or 0x..), or all");
    }
};

/// `hal can nmt`. Returns the exit code.
int run_can_nmt(const NmtOptions&);

}  // namespace hal::tools
