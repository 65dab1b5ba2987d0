// SPDX-License-Identifier: MIT
// What a journal of the execution gets from a machine: everything that its cycles depend on and
// do not compute (docs/internals/journal.md).
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "execute/setup_results.hpp"
#include "hal/abi.h"

namespace hal {

class CycleInputs;
struct Model;

/// What an instance has acquired in its start(), and reads without the journal.
struct OutsideWorld {
    std::vector<std::string> files;  ///< as /proc/self/fd names them: "socket:[5]", "/dev/ttyS0"
    std::size_t threads = 0;
    std::size_t helpers = 0;  ///< threads of work that a re-execution leaves out
    std::size_t links = 0;    ///< to buses of the outside, whose results are in the journal
    /// of records, which programs outside may feed or read
    std::size_t streams = 0;
    /// Leaves out what journaled links have, and counts these.
    void remove_links(const OutsideWorld& others) {
        std::erase_if(files, [&others](const std::string& file) {
            return std::ranges::find(others.files, file) != others.files.end();
        });
        threads -= std::min(threads, others.threads);
        streams -= std::min(streams, others.streams);
        links += others.links;
    }
    bool empty() const {
        return files.empty() && threads == 0 && helpers == 0 && links == 0 && streams == 0;
    }
};

struct JournaledTransaction {
    std::uint64_t epoch = 0;  ///< of the last plan before it
    std::vector<std::vector<std::string>> commands = {};  ///< the words of each, substituted
    bool starts = false;  ///< its new instances were started
    std::vector<std::uint64_t> calls = {};  ///< tickets of its ordered calls on buses in memory
};

/// [setup], with the session's lock held. Given in SessionOptions; outlives the session.
class ExecutionSink {
public:
    virtual ~ExecutionSink() = default;
    /// A thread is about to be created as number `id`. Returns what records its cycles and outlives
    /// it.
    virtual CycleInputs* thread_made(const std::string& name, std::int64_t period_ns,
                                     std::uint32_t id) = 0;
    /// A transaction has taken effect.
    virtual void edited(JournaledTransaction transaction, const Model& model) = 0;
    /// A transaction was rolled back after threads had taken it, and they have the plans of the
    /// model before it again. It has no commands when a thread may still use what it has made.
    virtual void withdrawn(JournaledTransaction transaction) = 0;
    /// A transaction was rejected or rolled back, and no thread had taken it; it has calls.
    virtual void rejected(JournaledTransaction transaction) = 0;
    /// Programs have written these pins: names and values.
    virtual void written(std::vector<std::pair<std::string, std::uint64_t>> values) = 0;
    /// The functions were started or stopped.
    virtual void switched(bool running) = 0;
    /// The functions were stopped at once, without the session's lock. Does not wait. [any]
    virtual void halted() noexcept = 0;
    /// The transaction that takes effect next has made this call, or opened this file.
    virtual void called(const SetupResults& results) = 0;
    virtual void file_read(const SetupFile& file) = 0;
    /// Writes what has been recorded so far to a file. Returns why not; "" when it is written.
    virtual std::string save(const std::string& path) = 0;
    /// An instance has started, and depends on what is outside of the process.
    virtual void opened(const std::string& instance, const std::string& component,
                        const OutsideWorld& outside) = 0;
};

}  // namespace hal
