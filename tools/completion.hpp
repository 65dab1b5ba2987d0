// SPDX-License-Identifier: MIT
#pragma once

#include "cli/option_set.hpp"

namespace hal::tools {

struct CompletionOptions : Options {
    void declare(OptionSet& set) override { set.words("SHELL", "bash, zsh or fish"); }
};

/// Runs `hal completion`: prints a script derived from the table of subcommands. `hal completion
/// words` is for these scripts: it prints the candidates for the command line in COMP_LINE. Returns
/// the exit code.
int run_completion(const CompletionOptions&);

}  // namespace hal::tools
