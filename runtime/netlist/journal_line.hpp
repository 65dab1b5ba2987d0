// SPDX-License-Identifier: MIT
// `journal FILE [keep=TIME]`: a machine whose netlist has this line writes a journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

inline constexpr std::string_view journal_usage = "save|FILE [FILE|keep=TIME]";

struct JournalLine {
    std::string file;
    std::int64_t keep_ns = 0;  ///< 0: the whole journal
};

/// Returns true for `journal save FILE`, which is a request.
bool is_journal_request(const Command& command);
/// Returns what such a line has; nothing after reporting what is invalid.
std::optional<JournalLine> parse_journal_line(const Command& command, Diagnostics& diagnostics);
/// Returns what the command has when it is a valid line of this kind; nothing otherwise.
std::optional<JournalLine> journal_line(const Command& command);

}  // namespace hal
