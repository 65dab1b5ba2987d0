// SPDX-License-Identifier: MIT
// The values of --values, checked before the machine runs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

/// Returns the capacity of a probe's rings for the shortest period, both in ns.
using BufferOf = std::function<std::int64_t(std::int64_t shortest_period_ns)>;

/// Loads the netlists in a process of its own that starts nothing, and returns why the values of
/// `values` (of --values) cannot be recorded there; "" where they can, or where only a run shows it: with
/// errors in the netlists, names that programs create, or netlists in Tcl. Called before
/// the process has another thread. [setup]
std::string problem_of_values(const NetlistOptions& options, const std::vector<std::string>& values,
                              const BufferOf& buffer_ns);

}  // namespace hal::tools
