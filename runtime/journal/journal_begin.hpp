// SPDX-License-Identifier: MIT
// Where a journal begins that does not begin where its machine began: the edits that make the same
// machine, and its state.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace hal {

struct JournalBegin {
    /// So many entries of the file precede the state: they are executed without cycles.
    std::uint32_t entries = 0;
    /// sequence of the message of the first entry behind them
    std::uint32_t next_entry = 0;
    /// sequence of the first message of each thread, by its number
    std::map<std::uint32_t, std::uint32_t> batches = {};
    std::string state = {};  ///< ReExecution::state()
};

/// Returns the message as CDR. [setup]
std::string to_cdr(const JournalBegin& begin);
/// Returns what such a message has; nothing when it is damaged. [setup]
std::optional<JournalBegin> journal_begin(std::string_view payload);

}  // namespace hal
