// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

/// The options of commands that send frames periodically.
struct PeriodicOptions : Options {
    std::int64_t every_ns = 0;  ///< 0: not given
    std::int64_t for_ns = -1;   ///< -1: not given
    std::uint64_t count = 0;    ///< 0: unlimited
};

}  // namespace hal::tools
