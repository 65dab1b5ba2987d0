// SPDX-License-Identifier: MIT
#pragma once

#include "cli/options.hpp"

namespace hal::tools {

/// Runs `hal ethercat keys`: prints the keys of a configuration as tables in Markdown, below a
/// heading for each section. Returns the exit code.
int run_ethercat_keys(const Options&);

}  // namespace hal::tools
