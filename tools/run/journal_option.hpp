// SPDX-License-Identifier: MIT
// The journal that `hal run` writes: of --journal, or of the line `journal FILE` of a netlist.
#pragma once

#include "run/run.hpp"

namespace hal::tools {

/// Sets journal and keep_ns to those of the first netlist with such a line, unless --journal is
/// given. Lines of files that a netlist sources are not found: loading them warns.
void add_journal_of_netlists(RunOptions& options);

}  // namespace hal::tools
