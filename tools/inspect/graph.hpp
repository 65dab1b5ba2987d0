// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct GraphOptions : NetlistOptions {
    std::string output;  ///< empty: standard output

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists, in the order they would be loaded");
        set.value("-o,--output", output, "FILE", "a .svg or .dot file; without it DOT goes to standard output");
        set.value("--node", part, "NAME", "of a netlist for several machines: the part of this one");
        set.value("-i,--ini", ini, "FILE", "where [SECTION]KEY is looked up");
    }
};

/// `hal graph`. Returns the exit code.
int run_graph(const GraphOptions&);

}  // namespace hal::tools
