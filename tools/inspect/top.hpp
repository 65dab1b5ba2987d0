// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct TopOptions : Options {
    std::int64_t for_ns = -1;  ///< -1: not given
    std::string dds;           ///< arguments of the DDS participant
    bool once = false, json = false;

    void declare(OptionSet& set) override {
        set.for_how_long(for_ns, "in a terminal: end after 10s …; without it: until Ctrl-C");
        set.flag("--once", once, "the table once, as it is when the output is no terminal");
        set.flag("--json", json, "once, as JSON");
        set.value("--dds", dds, "SETTINGS", "how to meet others: interfaces=ADDRESS domain=N peers=… (default: on this machine only)");
    }
};

/// `hal top`. Returns the exit code.
int run_top(const TopOptions&);

}  // namespace hal::tools
