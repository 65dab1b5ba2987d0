// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct MeterOptions : Options {
    std::string name;  ///< of the instance; empty: not given
    std::int64_t for_ns = -1;

    void declare(OptionSet& set) override {
        set.words("NAME", "pin, signal or parameter");
        set.for_how_long(
            for_ns, "end after 10s …; default: until q in a terminal, else after the first value");
        set.value("--name", name, "NAME", "instance");
    }
};

/// Runs `hal meter`. Returns the exit code.
int run_meter(const MeterOptions&);

}  // namespace hal::tools
