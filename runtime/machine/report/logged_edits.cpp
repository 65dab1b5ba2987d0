// SPDX-License-Identifier: MIT
#include "machine/report/logged_edits.hpp"

#include <utility>

#include "text/quoting.hpp"

namespace hal {

std::string failure_text(std::string_view line, const Diagnostics& found, std::size_t from) {
    std::size_t errors = 0;
    for (const Diagnostic& one : found.all()) {
        if (one.severity != Severity::error || errors++ < from) continue;
        return std::string(line) + ": " + one.message;
    }
    return std::string(line);
}

void LoggedEdits::finish(const Diagnostics& found, bool rejected) {
    const std::vector<std::string> lines = std::exchange(lines_, {});
    if (!log_.wanted() || lines.empty()) return;
    if (rejected) {
        const bool is_one = lines.size() == 1;
        log_.add("rejected",
                 failure_text(is_one ? lines[0] : counted(lines.size(), "edit"), found));
        return;
    }
    for (const std::string& line : lines) {
        log_.add("edit", line);
    }
}

}  // namespace hal
