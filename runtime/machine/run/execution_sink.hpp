// SPDX-License-Identifier: MIT
// What a journal of the execution gets from a machine: everything that its cycles depend on and
// do not compute (docs/internals/journal.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/abi.h"

namespace hal {

class CycleInputs;
struct Model;

/// What an instance has acquired in its start(), and reads without the journal.
struct OutsideWorld {
    std::vector<std::string> files;  ///< as /proc/self/fd names them: "socket:[5]", "/dev/ttyS0"
    std::size_t threads = 0;
    std::size_t streams = 0;  ///< of records, which programs outside may feed
    bool empty() const { return files.empty() && threads == 0 && streams == 0; }
};

/// [setup], with the session's lock held. Given in SessionOptions; outlives the session.
class ExecutionSink {
public:
    virtual ~ExecutionSink() = default;
    /// A thread is about to be created as number `id`. Returns what records its cycles and outlives
    /// it.
    virtual CycleInputs* thread_made(const std::string& name, std::int64_t period_ns,
                                     std::uint32_t id) = 0;
    /// A transaction has taken effect. `epoch`: of the last plan before it. `commands`: the words
    /// of each command, substituted.
    virtual void edited(std::uint64_t epoch, std::vector<std::vector<std::string>> commands,
                        const Model& model) = 0;
    /// A transaction was rolled back after threads had taken it.
    virtual void withdrawn() = 0;
    /// Programs have written these pins: names and values.
    virtual void written(std::vector<std::pair<std::string, std::uint64_t>> values) = 0;
    /// The functions were started or stopped.
    virtual void switched(bool running) = 0;
    /// An instance has started, and reads what the journal does not have.
    virtual void opened(const std::string& instance, const std::string& component,
                        const OutsideWorld& outside) = 0;
};

}  // namespace hal
