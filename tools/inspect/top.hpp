// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct TopOptions : Options {
    std::int64_t for_ns = -1;  ///< -1: not given
    std::string dds;           ///< arguments of the DDS participant
    bool once = false;
    bool json = false;

    void declare(OptionSet& set) override {
        set.for_how_long(for_ns, "end after 10s … in a terminal; default: run until q or Ctrl-C");
        set.flag("--once", once,
                 "print the table once (the default when the output is not a terminal)");
        set.flag("--json", json, "print once, as JSON");
        set.value(
            "--dds", dds, "SETTINGS",
            "DDS discovery: interfaces=ADDRESS domain=N peers=… (default: this machine only)");
    }
};

/// Runs `hal top`. Returns the exit code.
int run_top(const TopOptions&);

}  // namespace hal::tools
