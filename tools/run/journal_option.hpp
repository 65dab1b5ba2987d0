// SPDX-License-Identifier: MIT
// The journal that `hal run` and `hal linuxcnc` write: of --journal, or of the line `journal FILE` of
// a netlist.
#pragma once

#include "run/run.hpp"

namespace hal::tools {

/// Sets journal and keep_ns to those of the first netlist with such a line, unless --journal is
/// given: of the netlists that are given, those of [HAL]HALFILE of an INI file, and those that they
/// source.
void add_journal_of_netlists(RunOptions& options);

}  // namespace hal::tools
