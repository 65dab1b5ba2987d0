// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct TdmaPlanOptions : Options {
    bool json = false;
    std::string svg;  ///< a file for the picture; -: standard output; empty: not given

    void declare(OptionSet& set) override {
        set.words("FILE", "the schedule of the segment, NAME.tdma or RTnet's tdma.conf");
        set.flag("--json", json, "as JSON");
        set.value("--svg", svg, "FILE", "a picture of a cycle into this file; -: standard output");
    }
};

/// `hal tdma plan`. Returns the exit code.
int run_tdma_plan(const TdmaPlanOptions&);

}  // namespace hal::tools
