// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct WatchOptions : Options {
    std::string name;  ///< of the instance; empty: not given
    std::int64_t for_ns = -1;
    bool once = false;

    void declare(OptionSet& set) override {
        set.words("NAME", "pins, signals or parameters; or patterns with * ? [ ]");
        set.for_how_long(for_ns, "end after 10s …; default: until q in a terminal, else 1s");
        set.flag("--once", once,
                 "print the table at the end (the default when the output is not a terminal)");
        set.value("--name", name, "NAME", "instance");
    }
};

/// Runs `hal watch`. Returns the exit code.
int run_watch(const WatchOptions&);

}  // namespace hal::tools
