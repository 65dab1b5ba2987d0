// SPDX-License-Identifier: MIT
// The cycles of a journal in the place of a clock: which thread executes its next cycle, and with
// which inputs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "execute/setup_results.hpp"

namespace hal {

class Core;
class CycleInputs;

/// [setup] throughout: all cycles run on the calling thread.
class CycleSchedule {
public:
    virtual ~CycleSchedule() = default;
    /// Returns the inputs of the thread that is created as number `id`. They outlive it.
    virtual CycleInputs& inputs_of(std::uint32_t id) = 0;
    /// The thread exists from now on, or is about to end: then its remaining cycles are executed.
    virtual void begin(Core& core) = 0;
    virtual void end(Core& core) = 0;
    /// Executes the next cycle whose inputs exist. Returns false if the session
    /// must act before any cycle can run, or if the journal ends.
    virtual bool step() = 0;
    /// Returns when the newest cycle woke, on the clock of the journaled machine.
    virtual std::int64_t now_ns() const = 0;

    /// Returns the results of the next call of this name; nullopt: the journal has none.
    virtual std::optional<SetupResults> results_of(const std::string& /*call*/) {
        return std::nullopt;
    }
    /// Returns the file that was opened next under this name; nullptr: the journal has none.
    virtual const SetupFile* file_of(const std::string& /*path*/) { return nullptr; }
    /// Executes cycles until all ordered calls with smaller tickets have been made.
    virtual void wait_for_setup_call(std::uint64_t /*ticket*/) {}
};

}  // namespace hal
