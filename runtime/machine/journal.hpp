// SPDX-License-Identifier: MIT
// What happened to a machine, in order: commands and edits that were executed, and faults. Kept only while a client listens.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace hal {

struct SessionState;

struct JournalEntry {
    std::int64_t time_ns = 0;  ///< on the machine's clock
    std::string kind;          ///< fault, edit, command
    std::string text;
};

/// Part of a Session. [setup]
class Journal {
public:
    explicit Journal(SessionState& state) : state_(state) {}

    /// Where a listener is: it has what was added before.
    struct Position {
        std::uint64_t entry = 0, fault = 0;
    };
    /// Begins to keep entries. Each call needs its end().
    Position begin();
    void end();
    /// Returns what was added since `position`, oldest first, and advances it.
    std::vector<JournalEntry> after(Position& position);
    /// Adds an entry; does nothing while nobody listens.
    void add(const char* kind, std::string text);
    bool wanted() const { return listeners_ > 0; }

private:
    static constexpr std::size_t kept = 10'000;
    SessionState& state_;
    std::size_t listeners_ = 0;
    std::deque<JournalEntry> entries_;
    std::uint64_t count_ = 0;  // of all entries ever
};

}  // namespace hal
