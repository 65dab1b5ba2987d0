// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct TdmaPingOptions : Options {
    std::uint64_t count = 0;  ///< 0: not given
    std::string from;         ///< the component that pings
    std::string name;         ///< of the instance; empty: not given

    void declare(OptionSet& set) override {
        set.words("STATION", "its name in the schedule");
        set.value("-c,--count", count, "COUNT", "number of pings (default 4)").in(1, 1'000'000);
        set.value("--from", from, "COMPONENT",
                  "the station to ping from, when the instance has several: tdma.1");
        set.value("-N,--name", name, "NAME", "the instance; required when several are running");
    }
};

/// Runs `hal tdma ping`. Returns the exit code.
int run_tdma_ping(const TdmaPingOptions&);

}  // namespace hal::tools
