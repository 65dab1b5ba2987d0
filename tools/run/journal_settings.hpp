// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

/// The options of the commands that write a journal.
struct JournalSettings {
    std::string journal;       ///< file
    std::int64_t keep_ns = 0;  ///< of the journal; 0: all of it

    void declare_journal(OptionSet& set) {
        set.value("--journal", journal, "FILE",
                  "write the inputs of every cycle and all edits to FILE.mcap, for hal replay "
                  "--exact");
        set.duration("--journal-keep", keep_ns,
                     "with --journal: keep the last 10min, 90s …; FILE is written at the end, on a "
                     "fault as FILE-fault-1, and by journal save",
                     1);
    }
    /// Returns what is wrong with them once the lines `journal` of netlists are known, or "".
    std::string journal_problem() const {
        return keep_ns > 0 && journal.empty() ? "--journal-keep needs --journal FILE" : "";
    }
};

}  // namespace hal::tools
