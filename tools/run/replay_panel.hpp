// SPDX-License-Identifier: MIT
// `hal replay --exact FILE --panel`: the web panel on a moment of the past.
#pragma once

#include "journal/journal_file.hpp"
#include "run/replay.hpp"
#include "run/what_if.hpp"

namespace hal::tools {

/// Serves the replayed machine as an instance, and runs `hal panel` on it, until the user or the
/// panel ends it. The machine is changed by `change`. Returns the exit status.
int run_replay_panel(const ReplayOptions& options, JournalFile& file, const WhatIf& change);

}  // namespace hal::tools
