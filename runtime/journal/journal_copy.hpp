// SPDX-License-Identifier: MIT
// Writes a part of a journal as a journal of its own.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "journal/journal_file.hpp"
#include "recording/mcap/writer.hpp"

namespace hal {

/// [setup]
class JournalCopy {
public:
    /// `from` outlives it.
    JournalCopy(const JournalFile& from, const std::string& to);

    /// All messages from now on have this time, unless they have one of their own.
    void set_time(std::uint64_t unix_ns) { unix_ns_ = unix_ns; }
    /// Before all others: the journal begins with a state.
    void add(const JournalBegin& begin);
    void add(const ExecutionEntry& entry, std::uint32_t sequence);
    /// Copies what setup calls got.
    void add_setup();
    void add(const JournaledThread& thread, const JournaledBatch& batch);
    /// Returns why it could not be written; "" when it is written.
    std::string close();

private:
    std::uint16_t channel_of(const JournaledThread& thread);
    void add_setup_of(const std::string& path);

    const JournalFile& from_;
    mcap::Writer writer_;
    std::uint64_t unix_ns_ = 0;
    std::uint16_t entries_ = 0;
    std::uint16_t setup_ = 0;
    std::uint32_t setup_count_ = 0;
    std::uint16_t cycles_schema_ = 0;
    std::map<std::uint32_t, std::uint16_t> channels_;  // by number of the thread
};

}  // namespace hal
