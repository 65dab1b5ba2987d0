// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct CanRecordOptions : Options {
    std::vector<std::string> filters;
    std::uint64_t count = 0;   ///< 0: unlimited
    std::int64_t for_ns = -1;  ///< -1: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS FILE", "the bus; a .log file (candump) or a .pcapng file (Wireshark)");
        declare_filter(set, filters, count);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
    }
};

struct CanReplayOptions : Options {
    double speed = 1.0;

    void declare(OptionSet& set) override {
        set.words("FILE ADDRESS",
                  "a candump log, pcapng or pcap file; the bus to send its frames to, at their "
                  "recorded times");
        set.value("--speed", speed, "FACTOR", "replay speed (default 1: as recorded)");
    }
};

/// `hal can record`. Returns the exit code.
int run_can_record(const CanRecordOptions&);

/// `hal can replay`. Returns the exit code.
int run_can_replay(const CanReplayOptions&);

}  // namespace hal::tools
