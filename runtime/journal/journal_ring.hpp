// SPDX-License-Identifier: MIT
// Keeps only the last minutes of a journal (docs/internals/journal.md).
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "journal/execution_journal.hpp"

namespace hal {

/// The journal is in a folder, as files that continue each other. When all after the second of them
/// is long enough, a process executes both and writes the second one again, with the state of the
/// machine near its end; the first one is removed:
///
///     1 2 3 4 5 6        1 and 2 are executed up to the end of 2: 2' is a state and what remains
///       2' 3 4 5 6 7     2' and 3 are executed: 3'
///          3' 4 5 6 7 8
///
/// A machine whose state cannot be written keeps its whole journal. Has a thread of its own.
class JournalRing {
public:
    /// What the ring's thread calls.
    struct Machine {
        std::function<void(const std::string& sentence)> note;
        /// Returns the number of faults that are not acknowledged; nothing: ask later.
        std::function<std::optional<std::uint64_t>()> faults;
    };

    /// Creates the folder of the ring of the file `path`, empty; see problem(). `keep_ns`: at least
    /// this much is kept. [setup]
    JournalRing(std::string path, std::int64_t keep_ns);
    ~JournalRing();  ///< end(), and gives the folder back
    JournalRing(const JournalRing&) = delete;

    /// Returns why there is no folder; "" when there is one.
    const std::string& problem() const { return problem_; }
    /// Returns the new name of a folder that a killed machine had left; "" when there was none.
    const std::string& kept() const { return kept_; }
    /// Returns the first file for the journal.
    std::string first() const { return path_of(1); }
    /// Begins to rotate, and to write FILE-fault-N after faults. `journal` outlives it. [setup]
    void begin(ExecutionJournal& journal, Machine machine);
    /// Writes what there is to a file. Returns why not; "" when it is written. [any]
    std::string save(const std::string& to);
    /// Ends the thread and its process. Before the machine of begin() ends, and before the journal
    /// is closed.
    void end();
    /// Writes what there is to the file of the constructor and removes the folder, once the journal
    /// is closed. Returns why not; then the folder stays.
    std::string finish();
    const std::string& folder() const { return folder_; }

private:
    struct Part {
        std::uint32_t number;
        std::int64_t end_ns;  ///< on the monotonic clock
        std::uint64_t last_cycle;  ///< of the fastest thread, a bit before the end
    };
    /// Creates the folder and locks it. A lock ends with its process, so that a folder without one
    /// is that of a killed machine.
    void take_folder();
    /// Renames the folder that a killed machine has left.
    void keep_folder();
    std::string path_of(std::uint32_t number) const;
    std::vector<std::string> paths(bool with_current) const;
    std::string cut_path() const { return folder_ + "/cut"; }
    std::string log_path() const { return folder_ + "/cut.log"; }
    void work();
    void rotate(std::int64_t now_ns);
    void start_cut(std::int64_t now_ns);
    void look_at_cut();
    void fail(const std::string& why);
    void look_at_faults(std::int64_t now_ns);
    std::string save_now(const std::string& to);

    const std::string path_;
    const std::string folder_;
    const std::int64_t keep_ns_;
    const std::int64_t part_ns_;
    std::string problem_;
    std::string kept_;
    int lock_ = -1;  // descriptor of the folder
    ExecutionJournal* journal_ = nullptr;
    Machine machine_;
    std::mutex mutex_;  // of all below
    std::vector<Part> parts_;  // without the current one
    std::uint32_t current_ = 1;
    std::int64_t begun_ns_ = 0;  // the current one
    pid_t cut_ = 0;  // 0: none runs
    bool keeps_all_ = false;
    std::uint64_t faults_ = 0;  // at the last look
    std::int64_t fault_ns_ = 0;  // when the first one after the last file was seen; 0: none
    std::uint32_t fault_files_ = 0;
    bool ends_ = false;
    std::condition_variable wake_;
    std::thread thread_;
};

}  // namespace hal
