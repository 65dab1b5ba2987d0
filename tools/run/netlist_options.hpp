// SPDX-License-Identifier: MIT
// Options common to commands that load netlists.
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct NetlistOptions : ExecutionOptions {
    std::string part;                 ///< --node: the node to load
    std::string group;                ///< --group: may control the instance, too
    std::int64_t max_gap_ns = 0;
    std::int64_t max_gap_realtime_ns = 0;  ///< `hal linuxcnc`: of SessionOptions
    /// sim --cycle-limit: of one cycle, in wall time; 0: not given
    std::int64_t cycle_limit_ns = 0;

protected:
    void declare_netlists(OptionSet& set) {
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY");
        set.flag("-k,--keep-going", keep_going,
                 "continue after an error, command by command, as halcmd -k does");
    }
};

}  // namespace hal::tools
