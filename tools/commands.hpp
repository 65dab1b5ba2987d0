// SPDX-License-Identifier: MIT
// The table of subcommands, and the words typed after `hal`.
#pragma once

#include <string>
#include <vector>

namespace hal::tools {

/// Finds the subcommand, reads its options, runs it. Returns the exit code.
int run_command_line(int argc, char** argv);

/// For the completion script: a subcommand and its options; of a group the words that may follow and all their options.
struct Completion {
    std::string name;
    std::vector<std::string> options;
    std::vector<std::string> words;
};
std::vector<Completion> completions();

}  // namespace hal::tools
