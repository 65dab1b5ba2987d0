// SPDX-License-Identifier: MIT
// The edits of one transaction in the event log: once it is known whether they took effect.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "machine/report/event_log.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// All members need the session's lock. [setup]
class LoggedEdits {
public:
    /// `log` outlives it.
    explicit LoggedEdits(EventLog& log) : log_(log) {}

    void add(std::string_view line) {
        if (log_.wanted()) {
            lines_.emplace_back(line);
        }
    }
    /// Adds an `edit` for each line, or one entry `rejected` with the first error, and begins anew.
    void finish(const Diagnostics& found, bool rejected);

private:
    EventLog& log_;
    std::vector<std::string> lines_;
};

/// Returns "LINE: the message of the first error from number `from` on".
std::string failure_text(std::string_view line, const Diagnostics& found, std::size_t from = 0);

}  // namespace hal
