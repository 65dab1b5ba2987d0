// SPDX-License-Identifier: MIT
#pragma once

#include "run/sim.hpp"

namespace hal::tools {

/// Runs `hal sim`, with --record too: the same netlist gives the same file. Returns the exit
/// status.
int run_recorded_sim(const SimOptions& options);

}  // namespace hal::tools
