// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct NewOptions : Options {
    std::string folder;  ///< of the new component or machine; empty: its name
    int axes = 0;      ///< 0: not given
    std::string bus;   ///< empty: not given

    void declare(OptionSet& set) override {
        set.words("component|machine NAME", "its name: letters, digits, - and _");
        set.value("--folder", folder, "DIR",
                  "folder to create (default: NAME in the current folder)");
        set.value("--axes", axes, "N", "of a machine: the number of axes (default 3)").in(1, 9);
        set.value("--bus", bus, "BUS",
                  "of a machine: canopen, ethercat, or none (default): motors without a bus");
    }
};

/// `hal new`. Returns the exit code.
int run_new(const NewOptions&);

}  // namespace hal::tools
