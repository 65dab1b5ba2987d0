// SPDX-License-Identifier: MIT
// What was loaded when a journal was written, compared with what would be loaded now.
#pragma once

#include <string>

#include "journal/journal_file.hpp"
#include "run/replay.hpp"

namespace hal::tools {

/// [setup]
class JournaledProgram {
public:
    /// Both outlive it.
    JournaledProgram(const ReplayOptions& options, const JournalFile& file)
        : options_(options), file_(file) {}

    /// Returns an exit status: 1 after printing why the journal is not executed.
    int check() const;
    /// The same for devices only: the program and the plugins may be others.
    int check_devices() const;
    /// Prints which instances may read what the journal does not have.
    void name_readers() const;
    /// Prints which instances prevent keyframes.
    void name_uncopied() const;

private:
    int reject(const std::string& problems) const;
    static std::string changed(const JournaledFile& plugin);
    static std::string outside(const ExecutionEntry& entry);
    static std::string resources(const ExecutionEntry& entry);

    const ReplayOptions& options_;
    const JournalFile& file_;
};

}  // namespace hal::tools
