// SPDX-License-Identifier: MIT
// The values of --values, checked before the machine runs.
#pragma once

#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

/// The end of a problem with too many values.
inline constexpr char fewer_values[] = "choose fewer with --values";

/// Loads the netlists in a process of its own that starts and builds nothing, and returns why the
/// values of `values` (of --values; none: all of them) cannot be recorded there; "" where they can,
/// or where only a run shows it: with errors in the netlists, names that programs create, netlists
/// in Tcl, components that are built first, a file that can be read only once, or too much memory
/// for the rows. Called before the process has another thread. [setup]
std::string problem_of_values(const NetlistOptions& options,
                              const std::vector<std::string>& values);

}  // namespace hal::tools
