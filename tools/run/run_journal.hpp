// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include "run/run.hpp"

namespace hal::tools {

/// Runs `hal run`, with the journal if --journal was given. Returns the exit code.
int run_journaled(const RunOptions& options);

/// Calls `run` with the journal that the options name, or with nullptr when they name none, and
/// completes the file afterwards. Returns the exit code of `run`, or of the journal.
int run_with_journal(const RunOptions& options, const std::function<int(RunJournal*)>& run);

}  // namespace hal::tools
