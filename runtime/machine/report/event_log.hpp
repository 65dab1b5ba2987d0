// SPDX-License-Identifier: MIT
// What happened to a machine, in order: commands and edits that were executed, faults, and messages
// of its instances. Kept only while a client listens.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "hal/messages.h"

namespace hal {

class Executor;
class FaultLog;

struct LoggedEvent {
    std::int64_t time_ns = 0;  ///< on the machine's clock
    std::string kind;  ///< fault, edit, rejected, command, failed, message
    std::string text;
};

/// Part of a Session. [setup]
class EventLog {
public:
    EventLog(const Executor& executor, FaultLog& faults) : executor_(executor), faults_(faults) {}
    EventLog(const EventLog&) = delete;

    /// Where a listener is: it has what was added before.
    struct Position {
        std::uint64_t entry = 0;
        std::uint64_t fault = 0;
    };
    /// Begins to keep entries. Each call needs its end().
    Position begin();
    void end();
    /// Returns what was added since `position`, oldest first, and advances it.
    std::vector<LoggedEvent> after(Position& position);
    /// Adds an entry; does nothing while nobody listens.
    void add(const char* kind, std::string text);
    bool wanted() const { return listeners_ > 0; }
    /// Adds a line of an instance. Needs no lock of the session. [any]
    void message(std::string_view line) noexcept { note("message", line); }
    /// Does the same as add() without the lock of the session; lost when memory is exhausted or
    /// nobody reads. [any]
    void note(const char* kind, std::string_view line) noexcept;
    /// Returns the same as the extension that plugins use.
    const hal_messages& for_plugins() const { return for_plugins_; }

private:
    void append(LoggedEvent entry);
    void collect_messages();
    static constexpr std::size_t kept = 10'000;
    const Executor& executor_;
    FaultLog& faults_;
    std::atomic<std::size_t> listeners_{0};  // written under the session's lock
    std::deque<LoggedEvent> entries_;
    std::uint64_t count_ = 0;  // of all entries ever
    std::mutex messages_mutex_;
    std::vector<LoggedEvent> messages_;  // guarded by it: what is not in entries_ yet
    std::uint64_t messages_lost_ = 0;  // guarded by it: what did not fit there
    const hal_messages for_plugins_{
        sizeof(hal_messages), [](const hal_messages* self, const char* line, std::size_t bytes) {
        static_cast<EventLog*>(self->data)->message({line, bytes});
    }, this};
};

}  // namespace hal
