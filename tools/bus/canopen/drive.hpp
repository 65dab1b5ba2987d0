// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct DriveOptions : Options {
    std::string node, axis, within, supervise, heartbeat_id;
    bool keep_going = false;
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.value("--node", node, "N", "node ID of the drive, 1..127");
        set.value("--axis", axis, "LETTER", "axis of commands without a letter: A (default) to H");
        set.flag("-k,--keep-going", keep_going,
                 "continue after a failed command when commands come from a file or pipe");
        declare_timeout(set, timeout_ns);
        set.value("--within", within, "TIME",
                  "timeout of a command; a motion is then stopped (default 60s; on, off, stop, "
                  "reset, mode 15s)");
        set.value("--supervise", supervise, "TIME|off",
                  "the drive stops after TIME without a heartbeat of this program, 50ms to 65s "
                  "(default 500ms); off: no supervision");
        set.value("--heartbeat-id", heartbeat_id, "N",
                  "node ID of that heartbeat (default: a free one of 112..126)");
        set.keep_rest();
    }
};

/// `hal can drive`. Returns the exit code.
int run_can_drive(const DriveOptions&);

}  // namespace hal::tools
