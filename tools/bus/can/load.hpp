// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct BusLoadOptions : Options {
    std::int64_t for_ns = -1;  ///< -1: not given

    void declare(OptionSet& set) override {
        set.word("ADDRESS", bus_address());
        set.for_how_long(for_ns, "measure for 5s, 500ms … (default 2s)");
    }
};

/// `hal can load`. Returns the exit code.
int run_can_load(const BusLoadOptions&);

}  // namespace hal::tools
