// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct CheckOptions : NetlistOptions {
    bool linuxcnc = false;
    bool deterministic = false;
    std::int64_t for_ns = 1'000'000'000;  ///< of the simulations of --deterministic
    std::vector<std::string> assume;  ///< components that exist on the target machine only

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists in load order; FILE.ini: the netlists of its [HAL] section");
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY");
        set.flag("--linuxcnc", linuxcnc,
                 "also report what runs here and LinuxCNC 2.9 does not load");
        set.flag("--deterministic", deterministic,
                 "also simulate twice, and name the components that compute other values from the "
                 "same inputs");
        set.duration("--for", for_ns, "with --deterministic: simulate this much (default: 1s)", 1);
        set.values("--assume", assume, "NAME",
                   "a component, or a prefix of names, that exists on the target machine only");
    }
};

/// Runs `hal check`. Returns the exit code.
int run_check(const CheckOptions&);

}  // namespace hal::tools
