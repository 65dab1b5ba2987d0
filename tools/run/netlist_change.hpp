// SPDX-License-Identifier: MIT
// `hal replay --exact FILE --netlist CHANGED.hal --at CYCLE`: the machine of another netlist, from
// a moment on.
#pragma once

#include <string>
#include <vector>

#include "journal/journal_file.hpp"
#include "machine/session.hpp"

namespace hal::tools {

/// [setup]
class NetlistChange {
public:
    /// Reads the netlist, with the files that it sources. `ini` is for [SECTION]KEY; "": none.
    /// Returns why it cannot be read; "" when it is.
    std::string read(const std::string& path, const std::string& ini);
    bool empty() const { return path_.empty(); }
    const std::string& path() const { return path_; }

    /// Changes the machine that the first `entries` edits of `file` have made: adds, removes and
    /// links what differs, in one transaction. Returns why not; "" when it is done.
    std::string apply(Session& session, const JournalFile& file, std::size_t entries);
    /// Returns what differs and was not changed, as sentences; valid after apply().
    const std::vector<std::string>& not_applied() const { return not_applied_; }

private:
    std::string path_;
    std::string text_;  // a command in each line
    std::vector<std::string> not_applied_;
};

}  // namespace hal::tools
