// SPDX-License-Identifier: MIT
#pragma once

#include "cli/option_set.hpp"

namespace hal::tools {

struct ExplainOptions : Options {
    void declare(OptionSet& set) override {
        set.words("CODE",
                  "the code in [brackets] at the end of a message; without it: list all codes",
                  false);
    }
};

/// Runs `hal explain`. Returns the exit code.
int run_explain(const ExplainOptions&);

}  // namespace hal::tools
