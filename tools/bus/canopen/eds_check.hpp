// SPDX-License-Identifier: MIT
#pragma once

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct EdsCheckOptions : Options {
    void declare(OptionSet& set) override {
        set.words("FILE", "device descriptions: EDS, DCF, XDD, XDC");
    }
};

/// `hal can eds check`. Returns the exit code.
int run_can_eds_check(const EdsCheckOptions&);

}  // namespace hal::tools
