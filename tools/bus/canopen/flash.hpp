// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct FlashOptions : Options {
    int program_number = 1;
    bool segmented = false;
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE IMAGE",
                  "the bus; node ID 1..127; program file in the format of the device");
        set.value("--program", program_number, "N",
                  "program number, sub-index of 1F50h, 1..254 (default 1)")
            .in(1, 254);
        set.flag("--segmented", segmented, "do not use block transfer");
        declare_timeout(set, timeout_ns);
    }
};

/// `hal can flash`. Returns the exit code.
int run_can_flash(const FlashOptions&);

}  // namespace hal::tools
