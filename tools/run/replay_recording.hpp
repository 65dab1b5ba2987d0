// SPDX-License-Identifier: MIT
// Values of a journal's re-execution as a recording: hal replay --exact --record.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "journal/journal_file.hpp"
#include "machine/session.hpp"
#include "record/sink.hpp"
#include "run/replay.hpp"

namespace hal::tools {

/// [setup], with the session's lock held. Does nothing without --record.
class ReplayRecording {
public:
    /// Both outlive it.
    ReplayRecording(const ReplayOptions& options, JournalFile& file, Session& session);
    ~ReplayRecording();

    /// Returns why --record is not possible; "" when it is.
    static std::string problem(const ReplayOptions& options);
    /// Called after each cycle, with the number of edits so far. Records what follows the first
    /// cycle in which the machine has all names of --names. Returns false when they cannot be
    /// recorded in any cycle.
    bool note_cycle(std::uint64_t edits);
    /// Completes the file and prints what it has. Returns false after a message when something
    /// could not be recorded.
    bool finish();

private:
    bool attach();
    void note_later_values();
    void take();

    const ReplayOptions& options_;
    JournalFile& file_;
    Session& session_;
    const std::vector<std::string> patterns_;
    std::unique_ptr<Sink> sink_;
    std::shared_ptr<LiveProbe> probe_;
    ProbeLayout layout_;
    std::vector<std::string> names_;  // recorded, sorted
    std::set<std::string> later_;  // match patterns_, and were loaded too late
    std::uint64_t edits_ = 0;
    EventLog::Position journal_;
    std::string problem_;  // why nothing is recorded yet
    std::uint64_t untaken_ = 0;  // cycles since rows were taken
    std::uint64_t rows_ = 0;
    std::uint64_t lost_ = 0;
    bool is_written_ = true;
};

}  // namespace hal::tools
