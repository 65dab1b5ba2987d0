// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct CheckOptions : NetlistOptions {
    std::vector<std::string> assume;  ///< components that exist only elsewhere

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists, in the order they would be loaded; FILE.ini: those of its [HAL] section");
        set.value("-i,--ini", ini, "FILE", "where [SECTION]KEY is looked up");
        set.values("--assume", assume, "NAME", "a component, or the beginning of names, that exists only elsewhere");
    }
};

/// `hal check`. Returns the exit code.
int run_check(const CheckOptions&);

}  // namespace hal::tools
