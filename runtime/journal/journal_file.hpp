// SPDX-License-Identifier: MIT
// A journal that is read again. Nothing in the file is trusted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "execute/cycle_inputs.hpp"
#include "journal/cycle_codec.hpp"
#include "journal/journal_entry.hpp"
#include "journal/setup_record.hpp"

namespace hal {

/// The cycles of one thread, in order. [setup]
class JournaledThread {
public:
    std::string name;
    std::uint32_t number = 0;  ///< of the thread in the machine
    std::int64_t period_ns = 0;

    void add_batch(std::uint32_t sequence, std::string records);
    /// Returns the current record; nullptr after the last one that can be executed.
    const CycleRecord* record() const { return valid_ ? &record_ : nullptr; }
    const std::vector<std::uint64_t>& notes() const { return notes_; }
    /// Moves to the next record; called once before the first.
    void next();
    /// Returns why there is no record after the last one although the thread went on: "" when the
    /// journal has all of its cycles.
    const std::string& gap() const { return gap_; }
    /// Returns true when no batch of records follows the one that is read: in a journal that was cut
    /// off, an edit or a value that these cycles depend on may be missing.
    bool in_last_batch() const { return batch_ + 1 >= batches_.size(); }

private:
    struct Batch {
        std::uint32_t sequence;
        std::string records;
    };
    std::vector<Batch> batches_;
    std::size_t batch_ = 0;
    std::optional<CycleDecoder> decoder_;
    CycleRecord record_;
    std::vector<std::uint64_t> notes_;
    bool valid_ = false;
    std::uint64_t lost_ = 0;
    std::string gap_;
};

class JournalFile {
public:
    /// Reads a file, finished or not. Returns false and sets problem(). [setup]
    bool open(const std::string& path);
    const std::string& problem() const { return problem_; }
    /// Sentences about what the file does not have.
    const std::vector<std::string>& notes() const { return notes_; }

    const std::string& version() const { return version_; }  ///< of the program, with its commit
    const std::string& program() const { return program_; }  ///< hash of its file
    /// Returns the metadata of its head, as they are.
    const std::map<std::string, std::string>& head() const { return head_; }
    const std::vector<ExecutionEntry>& entries() const { return entries_; }
    std::map<std::uint32_t, JournaledThread>& threads() { return threads_; }
    JournaledSetup& setup() { return setup_; }
    /// Returns true when the machine ended in order.
    bool complete() const;
    std::int64_t unix_offset_ns() const { return unix_offset_ns_; }

private:
    std::string problem_;
    std::vector<std::string> notes_;
    std::string version_, program_;
    std::map<std::string, std::string> head_;
    std::int64_t unix_offset_ns_ = 0;
    std::vector<ExecutionEntry> entries_;
    JournaledSetup setup_;
    std::map<std::uint32_t, JournaledThread> threads_;  // by their number
};

}  // namespace hal
