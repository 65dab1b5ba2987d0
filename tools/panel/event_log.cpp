// SPDX-License-Identifier: MIT
#include "panel/event_log.hpp"

#include <chrono>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "cli/output.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

void EventLog::add(std::string_view kind, std::string_view text,
                   const std::string& instance) {
    const auto unix_ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                             std::chrono::system_clock::now().time_since_epoch())
                             .count();
    const nlohmann::json event{
        {"event", "log"}, {"unix_ms", unix_ms}, {"kind", kind}, {"text", text}};
    entries_.push_back(
        {instance, event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)});
    if (entries_.size() > max_entries) {
        entries_.pop_front();
    }
    write_all(STDERR_FILENO, fmt::format("hal panel: {}\n", printable(text)));
    if (on_entry) {
        on_entry(entries_.back());
    }
}

}  // namespace hal::tools
