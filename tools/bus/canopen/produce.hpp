// SPDX-License-Identifier: MIT
// `hal can generate` and `hal can produce`: frames sent periodically.
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct PeriodicOptions : Options {
    std::int64_t every_ns = 0;  ///< 0: not given
    std::int64_t for_ns = -1;   ///< -1: not given
    std::uint64_t count = 0;    ///< 0: unlimited
};

struct GenerateOptions : PeriodicOptions {
    std::string id;          ///< an identifier or a range; empty: all
    int length = -1;         ///< -1: random
    std::int64_t seed = -1;  ///< -1: random
    bool extended = false;
    bool counting = false;

    void declare(OptionSet& set) override {
        set.words("ADDRESS", bus_address());
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

struct ProduceOptions : PeriodicOptions {
    int counter = 0;  ///< overflow value of the SYNC counter; 0: no counter

    void declare(OptionSet& set) override {
        set.words("ADDRESS KIND",
                  "the bus; heartbeat NODE, sync, or guarding NODE (the requests of a master)");
        set.duration("--every", every_ns, "period (default 100ms; sync 10ms)", 1);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("-n,--count", count, "N", "end after N frames");
        set.value("--counter", counter, "N", "sync: add a counter that overflows at N, 2..240");
    }
};

/// `hal can generate`. Returns the exit code.
int run_can_generate(const GenerateOptions&);

/// `hal can produce`. Returns the exit code.
int run_can_produce(const ProduceOptions&);

}  // namespace hal::tools
