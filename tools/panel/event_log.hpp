// SPDX-License-Identifier: MIT
// What the panel server itself reports to its pages: writes, connections, loss of the machine.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace hal::tools {

class EventLog {
public:
    struct Entry {
        std::string instance;  ///< whose pages show it
        std::string event;     ///< a JSON object
    };

    /// `own`: the instance of the command line.
    explicit EventLog(std::string own) : own_(std::move(own)) {}
    std::function<void(const Entry&)> on_entry;
    /// Adds an entry of a kind (write, client, machine), and prints it on stderr.
    void add(std::string_view kind, std::string_view text) { add(kind, text, own_); }
    /// The same about a page that shows this instance.
    void add(std::string_view kind, std::string_view text, const std::string& instance);
    const std::deque<Entry>& entries() const { return entries_; }

private:
    static constexpr std::size_t max_entries = 200;
    const std::string own_;
    std::deque<Entry> entries_;
};

}  // namespace hal::tools
