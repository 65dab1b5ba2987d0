// SPDX-License-Identifier: MIT
// `hal replay --exact FILE --shell`: the commands of a machine, in the past.
#pragma once

#include "journal/journal_file.hpp"
#include "run/replay.hpp"
#include "run/what_if.hpp"

namespace hal::tools {

/// Reads commands from standard input until quit. The machine is changed by `change`. Returns the exit status.
int run_replay_shell(const ReplayOptions& options, JournalFile& file, const WhatIf& change);

}  // namespace hal::tools
