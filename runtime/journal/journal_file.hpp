// SPDX-License-Identifier: MIT
// A journal that is read again. Nothing in the file is trusted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "execute/cycle_inputs.hpp"
#include "journal/cycle_codec.hpp"
#include "journal/journal_begin.hpp"
#include "journal/journal_entry.hpp"
#include "journal/setup_record.hpp"

namespace hal::mcap {
class Reader;
struct Message;
}

namespace hal {

/// Some cycles of a thread: a message of a journal.
struct JournaledBatch {
    std::uint32_t sequence = 0;
    std::uint32_t count = 0;   ///< of records
    std::uint64_t unix_ns = 0;
    std::string records = {};  ///< of CycleEncoder
};

/// The cycles of one thread, in order. [setup]
class JournaledThread {
public:
    std::string name;
    std::uint32_t number = 0;  ///< of the thread in the machine
    std::int64_t period_ns = 0;

    void add(JournaledBatch batch) { batches_.push_back(std::move(batch)); }
    /// Forgets all batches. Before next().
    void forget() { batches_.clear(); }
    /// The journal was cut: the first batch has this sequence. Before next().
    void begin_with(std::uint32_t sequence) {
        first_sequence_ = sequence;
        is_cut_ = true;
    }
    /// When two cycles woke, on the machine's clock.
    struct Extent {
        std::int64_t first_ns = 0;
        std::int64_t last_ns = 0;
    };
    /// Returns the times of record() and of the last record; nothing after the last one.
    std::optional<Extent> remaining() const;
    /// Returns the sequence of the batch that record() is of, or of the next one.
    std::uint32_t sequence() const {
        return first_sequence_ + static_cast<std::uint32_t>(batch_) - (valid_ ? 1 : 0);
    }
    /// Returns the batches from record() on; the first of them has only what remains. Nothing can
    /// be read after it.
    std::vector<JournaledBatch> take_remaining();
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
    std::vector<JournaledBatch> batches_;
    bool is_cut_ = false;
    std::uint32_t first_sequence_ = 0;
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
    /// Reads a file, finished or not, or a folder with the parts of a ring (journal_ring.hpp).
    /// Returns false and sets problem(). [setup]
    bool open(const std::string& path);
    /// Reads files whose journals continue each other.
    bool open(const std::vector<std::string>& paths);
    const std::string& problem() const { return problem_; }
    /// Sentences about what the file does not have.
    const std::vector<std::string>& notes() const { return notes_; }

    const std::string& version() const { return version_; }  ///< of the program, with its commit
    const std::string& program() const { return program_; }  ///< hash of its file
    /// Returns the files, in order.
    const std::vector<std::string>& paths() const { return paths_; }
    /// Returns the metadata of its head, as they are.
    const std::map<std::string, std::string>& head() const { return head_; }
    const std::vector<ExecutionEntry>& entries() const { return entries_; }
    /// Returns the sequence of the message of an entry, by its index.
    std::uint32_t sequence_of(std::size_t entry) const {
        const auto index = static_cast<std::uint32_t>(entry);
        return begin_ && index >= begin_->entries ? begin_->next_entry + index - begin_->entries
                                                  : index;
    }
    /// Returns the state that the journal begins with; nothing: it begins with its machine.
    const std::optional<JournalBegin>& begin() const { return begin_; }
    std::map<std::uint32_t, JournaledThread>& threads() { return threads_; }
    JournaledSetup& setup() { return setup_; }
    /// Returns true when the machine ended in order.
    bool complete() const;
    std::int64_t unix_offset_ns() const { return unix_offset_ns_; }

private:
    /// The channels of one file.
    struct Channels {
        std::optional<std::uint16_t> entries;
        std::optional<std::uint16_t> setup;
        std::optional<std::uint16_t> state;
        std::map<std::uint16_t, std::uint32_t> threads;  // the number of the thread
    };

    bool add(const std::string& path);
    bool add_head(mcap::Reader& reader);
    Channels add_channels(const mcap::Reader& reader);
    void forget_earlier();
    void add_message(const Channels& channels, const mcap::Message& message);
    void add_entry(std::uint32_t sequence, std::string_view payload);

    std::string problem_;
    std::vector<std::string> notes_;
    std::vector<std::string> paths_;
    bool entries_end_ = false;  // the next one is missing or damaged
    std::optional<JournalBegin> begin_;
    std::string version_, program_;
    std::map<std::string, std::string> head_;
    std::int64_t unix_offset_ns_ = 0;
    std::vector<ExecutionEntry> entries_;
    JournaledSetup setup_;
    std::map<std::uint32_t, JournaledThread> threads_;  // by their number
};

}  // namespace hal
