// SPDX-License-Identifier: MIT
// A test that is made of an incident: a folder with a journal and values that are expected at its
// end.
#pragma once

#include <string>

#include "run/replay.hpp"
#include "run/replayed_machine.hpp"

namespace hal::tools {

/// Writes the folder of --as-test: journal.mcap, expected, test.hal. Returns the exit status, 1
/// after printing why not. The session's lock must be held. [setup]
int write_journal_test(const ReplayOptions& options, const JournalFile& file,
                       ReplayedMachine& machine);

/// Returns true when something of this name exists that a test must not replace: anything but an
/// empty folder. [setup]
bool is_occupied(const std::string& path);

/// Returns true for a folder that write_journal_test() has written. [setup]
bool is_journal_test(const std::string& path);

/// Executes the journal of the folder options.words[0], and compares what is expected. Returns 0
/// when all values are the expected ones. [setup]
int run_journal_test(const ReplayOptions& options);

}  // namespace hal::tools
