// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct CheckOptions : NetlistOptions {
    bool linuxcnc = false;
    std::vector<std::string> assume;  ///< components that exist on the target machine only

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists in load order; FILE.ini: the netlists of its [HAL] section");
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY");
        set.flag("--linuxcnc", linuxcnc,
                 "also report what runs here and LinuxCNC 2.9 does not load");
        set.values("--assume", assume, "NAME",
                   "a component, or a prefix of names, that exists on the target machine only");
    }
};

/// Runs `hal check`. Returns the exit code.
int run_check(const CheckOptions&);

}  // namespace hal::tools
