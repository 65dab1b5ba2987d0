// SPDX-License-Identifier: MIT
// `hal replay`: a recording drives the inputs of a netlist on the virtual clock, and the netlist's own values are compared with it.
#pragma once

#include <cstdint>
#include <string>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct ReplayOptions : NetlistOptions {
    std::int64_t for_ns = -1;
    double tolerance = -1;
    std::string names = "*", thread;
    bool quiet = false;

    void declare(OptionSet& set) override {
        set.words("FILE NETLIST",
                  "a recording (.mcap or .csv), then netlists that have values of the same names");
        set.duration("--for", for_ns, "replay this much (default: all)", 1);
        set.value("--tolerance", tolerance, "X",
                  "end with status 1 when a value differs from the recording by more than X")
            .not_negative();
        set.value("--names", names, "NAMES",
                  "use only these values of the recording: patterns separated by commas");
        set.value("--thread", thread, "THREAD",
                  "the thread that plays the recording (default: the one that was recorded, else "
                  "the fastest)");
        set.flag("-q,--quiet", quiet, "print only values that differ by more than the tolerance");
        declare_netlists(set);
    }
};

int run_replay(const ReplayOptions& options);

}  // namespace hal::tools
