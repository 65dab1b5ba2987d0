// SPDX-License-Identifier: MIT
// A component under a guard: does a function of it allocate, lock, block, print, overrun or crash?
#pragma once

#include "cli/options.hpp"
#include "comp/build_plugin.hpp"

namespace hal::tools {

/// Runs one instance a thousand cycles with random inputs and extreme parameters. Prints the
/// findings; returns the exit code.
int check_realtime(const Options& options, const BuiltPlugin& built, Language language);

}  // namespace hal::tools
