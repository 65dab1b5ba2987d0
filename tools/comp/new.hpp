// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct NewOptions : Options {
    std::string folder;  ///< of the new component; empty: its name

    void declare(OptionSet& set) override {
        set.words("component NAME", "the name loadrt will know; letters, digits, - and _");
        set.value("--folder", folder, "DIR", "made for it (default: NAME, here)");
    }
};

/// `hal new`. Returns the exit code.
int run_new(const NewOptions&);

}  // namespace hal::tools
