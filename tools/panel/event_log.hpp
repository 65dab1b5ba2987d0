// SPDX-License-Identifier: MIT
// What the panel server itself reports to its pages: writes, connections, loss of the machine.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>

namespace hal::tools {

class EventLog {
public:
    /// Receives each entry as a JSON object.
    std::function<void(const std::string&)> on_entry;
    /// Adds an entry of a kind (write, client, machine), and prints it on stderr.
    void add(std::string_view kind, std::string_view text);
    const std::deque<std::string>& entries() const { return entries_; }

private:
    static constexpr std::size_t max_entries = 200;
    std::deque<std::string> entries_;
};

}  // namespace hal::tools
