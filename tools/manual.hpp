// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct ManualOptions : Options {
    std::string output;  ///< a folder

    void declare(OptionSet& set) override {
        set.words("PAGE", "a page: hal, halcmd, hal-run, hal-can-dump …; without it: all", false);
        set.value("-o,--output", output, "DIR", "a folder; each page gets a file");
    }
};

/// Runs `hal manual`: prints or writes the manual pages of the commands, section 1, in troff. They
/// are made from the tables of commands and from the declared options, as the help is. Returns the
/// exit code.
int run_manual(const ManualOptions&);

}  // namespace hal::tools
