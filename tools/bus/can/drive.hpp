// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct DriveOptions : Options {
    std::string node, axis, within, supervise, heartbeat_id;
    bool keep_going = false;
    std::int64_t timeout_ns = 0;  ///< of one answer; 0: not given

    void declare(OptionSet& set) override {
        set.value("--node", node, "N", "the drive: 1-127");
        set.value("--axis", axis, "LETTER", "of commands that begin with none: A (the default) to H");
        set.flag("-k,--keep-going", keep_going, "commands from a file or pipe: go on after one that failed");
        declare_timeout(set, timeout_ns);
        set.value("--within", within, "TIME", "a command takes at most this long, then a motion is stopped (default 60s; on, off, stop, reset, mode 15s)");
        set.value("--supervise", supervise, "TIME|off",
                  "the drive stops when it has not heard this program for TIME, 50ms to 65s (default 500ms); off: it does not watch");
        set.value("--heartbeat-id", heartbeat_id, "N", "node ID of the heartbeat that the drive watches (default: a free one of 112 to 126)");
        set.keep_rest();
    }
};

/// `hal can drive`. Returns the exit code.
int run_can_drive(const DriveOptions&);

}  // namespace hal::tools
