// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "inspect/graph_view.hpp"
#include "run/netlist_options.hpp"

namespace hal::tools {

struct GraphOptions : NetlistOptions {
    std::string output;  ///< empty: standard output
    std::string cluster = "none", pins;  ///< as typed; pins empty: not given
    std::string around;
    int depth = -1;  ///< -1: not given

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists in load order");
        set.value("-o,--output", output, "FILE",
                  "a .svg or .dot file; without it DOT goes to standard output");
        set.value("--cluster", cluster, "KIND",
                  "draw a frame around the instances of each component, file or thread");
        set.value("--around", around, "NAME",
                  "draw only the neighbourhood of a pin, signal or instance");
        set.value("--depth", depth, "N", "how many signals away from it (default 1)").in(0, 100);
        set.value("--pins", pins, "all|linked",
                  "draw all pins, or linked ones only (the default with --around and above 40 "
                  "instances)");
        set.value("--node", part, "NAME",
                  "draw the part of this node of a netlist for several machines");
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY");
    }
};

/// Runs `hal graph`. Returns the exit code.
int run_graph(const GraphOptions&);

}  // namespace hal::tools
