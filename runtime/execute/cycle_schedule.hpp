// SPDX-License-Identifier: MIT
// The cycles of a journal in the place of a clock: which thread executes its next cycle, and with
// which inputs.
#pragma once

#include <cstdint>

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
};

}  // namespace hal
