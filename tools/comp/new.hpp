// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct NewOptions : Options {
    std::string folder;  ///< of the new component; empty: its name

    void declare(OptionSet& set) override {
        set.words("component NAME", "name for loadrt: letters, digits, - and _");
        set.value("--folder", folder, "DIR",
                  "folder to create (default: NAME in the current folder)");
    }
};

/// `hal new`. Returns the exit code.
int run_new(const NewOptions&);

}  // namespace hal::tools
