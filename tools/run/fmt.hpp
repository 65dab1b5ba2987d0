// SPDX-License-Identifier: MIT
#pragma once

#include "cli/option_set.hpp"

namespace hal::tools {

struct FmtOptions : Options {
    bool check = false;  ///< change nothing

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists to format in place; - formats standard input");
        set.flag("--check", check, "change nothing; exit status 1 when a file is not formatted");
    }
};

/// Runs `hal fmt`. Returns the exit code.
int run_fmt(const FmtOptions&);

}  // namespace hal::tools
