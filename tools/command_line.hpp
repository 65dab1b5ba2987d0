// SPDX-License-Identifier: MIT
// The command line after `hal`.
#pragma once

#include <string>
#include <vector>

namespace hal::tools {

/// Finds the subcommand, reads its options, runs it. Returns the exit code.
int run_command_line(int argc, char** argv);

/// An entry of the completion script: a subcommand and its options, or a group, the words that may
/// follow and all their options.
struct CompletionEntry {
    std::string name;
    std::vector<std::string> options;
    std::vector<std::string> words;
};
std::vector<CompletionEntry> completions();

}  // namespace hal::tools
