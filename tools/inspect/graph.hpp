// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct GraphOptions : NetlistOptions {
    std::string output;  ///< empty: standard output

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists in load order");
        set.value("-o,--output", output, "FILE", "a .svg or .dot file; without it DOT goes to standard output");
        set.value("--node", part, "NAME", "draw the part of this node of a netlist for several machines");
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY");
    }
};

/// Runs `hal graph`. Returns the exit code.
int run_graph(const GraphOptions&);

}  // namespace hal::tools
