// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct TdmaStatusOptions : Options {
    std::string name;  ///< of the instance; empty: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.value("-N,--name", name, "NAME", "the instance; required when several are running");
        set.flag("--json", json, "as JSON");
    }
};

/// Runs `hal tdma status`. Returns the exit code.
int run_tdma_status(const TdmaStatusOptions&);

}  // namespace hal::tools
