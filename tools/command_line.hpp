// SPDX-License-Identifier: MIT
// The command line after `hal`.
#pragma once

#include <string>
#include <vector>

namespace hal::tools {

/// Finds the subcommand, reads its options, runs it. Returns the exit code.
int run_command_line(int argc, char** argv);

/// A word that may be typed, and what it means.
struct CompletionWord {
    std::string name;
    std::string text;
};
struct CompletionOption : CompletionWord {
    bool takes_value = false;
};
/// An entry of the completion script: a subcommand and its options, or a group, the words that may
/// follow and all their options.
struct CompletionEntry {
    std::string name;
    std::string text;
    std::vector<CompletionOption> options;
    std::vector<CompletionWord> words;
};
std::vector<CompletionEntry> completions();

}  // namespace hal::tools
