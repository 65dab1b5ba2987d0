// SPDX-License-Identifier: MIT
// `hal can generate`: bus load of random or counting frames.
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/periodic_options.hpp"

namespace hal::tools {

struct GenerateOptions : PeriodicOptions {
    std::string id;          ///< an identifier or a range; empty: all
    int length = -1;         ///< -1: random
    std::int64_t seed = -1;  ///< -1: random
    bool extended = false;
    bool counting = false;

    void declare(OptionSet& set) override {
        set.word("ADDRESS", bus_address());
        set.duration("--every", every_ns, "interval between two frames (default 100ms)", 1);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("-n,--count", count, "N", "end after N frames");
        set.value("--id", id, "ID", "identifier or range in hex: 181, 100-1FF (default: all)");
        set.value("--length", length, "N", "bytes of data, 0..8 (default: random)").in(0, 8);
        set.flag("--extended", extended, "29-bit identifiers");
        set.flag("--counting", counting, "count identifiers and data up instead of random ones");
        set.value("--seed", seed, "N", "seed of the random frames, to repeat them").not_negative();
    }
};

/// `hal can generate`. Returns the exit code.
int run_can_generate(const GenerateOptions&);

}  // namespace hal::tools
