// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct TdmaPlanOptions : Options {
    bool json = false;
    std::string svg;  ///< a file for the picture; -: standard output; empty: not given

    void declare(OptionSet& set) override {
        set.word("FILE", "schedule of the segment, NAME.tdma or RTnet's tdma.conf");
        set.flag("--json", json, "print JSON");
        set.value("--svg", svg, "FILE", "draw the slots to this file; -: standard output");
    }
};

/// `hal tdma plan`. Returns the exit code.
int run_tdma_plan(const TdmaPlanOptions&);

}  // namespace hal::tools
