// SPDX-License-Identifier: MIT
// Writes the journal of a live machine: the inputs of the cycles of its threads, its edits, and
// what happened to it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "execute/cycle_inputs.hpp"
#include "journal/cycle_codec.hpp"
#include "journal/journal_entry.hpp"
#include "journal/setup_record.hpp"
#include "machine/run/execution_sink.hpp"
#include "recording/mcap/writer.hpp"

namespace hal {

/// What the head of a journal states about the program.
struct JournalOrigin {
    std::string instance;
    std::string version;
    std::string commit;
};

/// Has a thread of its own, which empties the rings of the real-time threads and writes the file.
/// Until close() the file is FILE.part and readable up to its last chunk, which is at most about a
/// second old.
class ExecutionJournal final : public ExecutionSink {
public:
    /// Creates the file; see problem(). [setup]
    ExecutionJournal(const std::string& path, const JournalOrigin& origin);
    ~ExecutionJournal() override;  ///< close()
    ExecutionJournal(const ExecutionJournal&) = delete;

    // ExecutionSink
    CycleInputs* thread_made(const std::string& name, std::int64_t period_ns,
                             std::uint32_t id) override;
    void edited(JournaledTransaction transaction, const Model& model) override;
    void withdrawn(JournaledTransaction transaction) override;
    void rejected(JournaledTransaction transaction) override;
    void written(std::vector<std::pair<std::string, std::uint64_t>> values) override;
    void switched(bool running) override;
    void halted() noexcept override { is_halt_unnoted_ = true; }
    void called(const SetupResults& results) override;
    void file_read(const SetupFile& file) override;
    void opened(const std::string& instance, const std::string& component,
                const OutsideWorld& outside) override;
    std::string save(const std::string& path) override;

    /// Sets what save() calls in the place of a copy of the file. [setup]
    void on_save(std::function<std::string(const std::string& path)> call) {
        const std::scoped_lock own(mutex_);
        save_ = std::move(call);
    }

    /// Sets what is called once, in the journal's own thread, when nothing more can be written: with
    /// the reason. [setup]
    void on_failure(std::function<void(const std::string& reason)> call) {
        const std::scoped_lock own(mutex_);
        failed_ = std::move(call);
    }
    /// Notes that the values of these names are recorded from now on, by who uses with_writer().
    void sampled(std::vector<std::string> names);
    /// Adds the text of a netlist or configuration, for people. [any]
    void attach(const std::string& name, const std::string& text);
    /// Calls `use` with the writer of the file, exclusively. [any]
    template <class Use>
    void with_writer(Use use) {
        const std::scoped_lock own(mutex_);
        use(*writer_);
    }
    struct FastestThread {
        std::int64_t period_ns = 0;  ///< 0: the machine has no threads
        std::uint64_t newest = 0;  ///< number of its newest cycle in the file
    };
    /// Completes the file and continues in another one. [any]
    FastestThread continue_in(const std::string& path);
    /// Writes what the threads have recorded so far to the disk. [any]
    void flush();
    std::int64_t unix_offset_ns() const { return unix_offset_ns_; }

    /// Completes the file, once no thread of the machine runs. Returns false when something could
    /// not be written.
    bool close();
    /// Returns why nothing, or nothing more, is written: a reason without the name of the file; ""
    /// when nothing failed. [any]
    std::string problem() const;
    /// Returns the path of the written file, valid after close(); empty if nothing was written.
    std::string where() const { return writer_->where(); }
    const std::string& kept() const { return writer_->kept(); }
    std::uint64_t cycles() const { return cycles_; }  ///< after close()
    /// Returns the names of threads whose ring was full, with the number of cycles that were lost.
    std::vector<std::pair<std::string, std::uint64_t>> lost() const;

private:
    struct Thread {
        std::string name;
        std::uint32_t id = 0;
        std::int64_t period_ns = 0;
        std::uint64_t newest = 0;  // number of the newest cycle
        std::uint16_t channel = 0;
        std::unique_ptr<CycleInputs> inputs;
        std::vector<std::uint64_t> words;  // taken out of the ring
        CycleEncoder encoder;
        std::int64_t newest_ns = 0;
        std::int64_t batch_begin_ns = 0;
        std::uint32_t batches = 0;
    };
    void open(const std::string& path);
    void declare(Thread& thread);
    void add(ExecutionEntry entry);
    void note_halt();
    void write(const ExecutionEntry& entry);
    void add(const SetupRecord& record);
    void work();
    void report_failure();
    void drain();
    void encode(Thread& thread);
    void write_batch(Thread& thread);
    std::uint64_t unix_ns(std::int64_t monotonic_ns) const;

    std::string reason() const;

    std::mutex saving_;  // of save(), before mutex_
    mutable std::mutex mutex_;  // of all below
    std::function<void(const std::string& reason)> failed_;
    std::function<std::string(const std::string& path)> save_;
    const JournalOrigin origin_;
    std::unique_ptr<mcap::Writer> writer_;
    const std::int64_t unix_offset_ns_;
    std::uint16_t entries_ = 0;
    std::uint16_t cycles_schema_ = 0;
    std::uint32_t entry_count_ = 0;
    std::uint16_t setup_ = 0;
    std::uint32_t setup_count_ = 0;
    std::set<std::string> contents_;  // hashes of files whose bytes were written
    std::vector<std::unique_ptr<Thread>> threads_;
    std::set<std::pair<std::string, std::string>> files_;  // path and hash of what was noted
    std::uint64_t cycles_ = 0;
    std::int64_t flushed_ns_ = 0;
    bool closed_ = false;
    bool ends_ = false;
    std::atomic<bool> is_halt_unnoted_{false};  // set by any thread
    std::condition_variable wake_;
    std::thread worker_;
};

}  // namespace hal
