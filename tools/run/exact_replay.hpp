// SPDX-License-Identifier: MIT
#pragma once

#include "run/replay.hpp"

namespace hal::tools {

/// Runs `hal replay --exact`. Returns 0 when all cycles that were executed have the values of the
/// journaled ones.
int run_exact_replay(const ReplayOptions& options);

}  // namespace hal::tools
