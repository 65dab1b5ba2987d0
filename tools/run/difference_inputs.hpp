// SPDX-License-Identifier: MIT
// What the function that computes the first wrong value read in that cycle.
#pragma once

#include <string>

#include "run/replay.hpp"
#include "run/value_check.hpp"

namespace hal::tools {

/// Executes the journal once more, up to the cycle of the difference. Returns lines with the input
/// pins of the function and the values that it read; "" when there is none. [setup]
std::string inputs_of(const ReplayOptions& options, const ValueDifference& difference);

}  // namespace hal::tools
