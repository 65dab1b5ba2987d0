// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// The functions in dataflow order: a writer before its readers, ties as given. Where the dataflow
/// has a loop, the function that reads the fewest values too early comes first, and a note reports
/// each such signal.
std::vector<LoadedFunction*> dataflow_order(const std::vector<LoadedFunction*>& functions, Span at,
                                            Diagnostics& diagnostics);

}  // namespace hal
