// SPDX-License-Identifier: MIT
#pragma once

#include "cli/options.hpp"

namespace hal::tools {

/// Runs `hal canopen keys`: prints the keys of a configuration as tables in Markdown, below a
/// heading for each section. Returns the exit code.
int run_canopen_keys(const Options&);

}  // namespace hal::tools
