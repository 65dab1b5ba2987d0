// SPDX-License-Identifier: MIT
#pragma once

#include "run/run.hpp"

namespace hal::tools {

/// Runs `hal run`, with the journal if --journal was given. Returns the exit code.
int run_journaled(const RunOptions& options);

}  // namespace hal::tools
