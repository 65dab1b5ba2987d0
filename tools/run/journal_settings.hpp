// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

/// The options of the commands that write a journal.
struct JournalSettings {
    std::string journal;       ///< file
    std::int64_t keep_ns = 0;  ///< of the journal; 0: all of it
    bool is_of_netlist = false;  ///< `journal` was set by a line of a netlist, not by --journal
    std::vector<std::string> values;  ///< to be recorded with it: names and patterns

    void declare_journal(OptionSet& set) {
        set.value("--journal", journal, "FILE",
                  "write the inputs of every cycle and all edits to FILE.mcap, for hal replay "
                  "--exact");
        set.duration("--journal-keep", keep_ns,
                     "with --journal: keep the last 10min, 90s …; FILE is written at the end, on a "
                     "fault as FILE-fault-1, and by journal save",
                     1);
        set.values("--values", values, "NAMES",
                   "with --journal: record these pins, parameters and signals in every cycle, too; "
                   "patterns; may be repeated");
    }
    /// Returns what is wrong with them once the lines `journal` of netlists are known, or "".
    std::string journal_problem() const {
        if (!journal.empty()) return "";
        if (keep_ns > 0) return "--journal-keep needs --journal FILE";
        if (values.empty()) return "";
        return "--values needs --journal FILE; hal record records a running machine";
    }
};

}  // namespace hal::tools
