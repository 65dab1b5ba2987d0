// SPDX-License-Identifier: MIT
#pragma once

#include "cli/option_set.hpp"

namespace hal::tools {

struct CompletionOptions : Options {
    void declare(OptionSet& set) override { set.words("SHELL", "bash, zsh or fish"); }
};

/// Runs `hal completion`: prints a script derived from the table of subcommands. Returns the exit
/// code.
int run_completion(const CompletionOptions&);

}  // namespace hal::tools
