// SPDX-License-Identifier: MIT
// Turns the faults that threads and their supervisor queue into records with messages. Private to
// machine/.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "execute/core.hpp"
#include "machine/report/machine_view.hpp"
#include "machine/report/reports.hpp"

namespace hal {

struct LoadedFunction;
struct Stall;

/// Why a thread finished no cycle, when its functions are not the cause.
struct Absence {
    std::int64_t process_ns = 0;  ///< duration without CPU time for the whole process
    /// duration for which the thread was ready to run without running
    std::int64_t starved_ns = 0;
    int cpu = -1;                 ///< the thread is bound to; -1: to none
};

class FaultLog {
public:
    explicit FaultLog(const MachineView& machine) : machine_(machine) {}

    /// Takes what is queued. Before an instance or thread leaves, because messages contain their
    /// names.
    void collect();
    void collect(const Thread& thread);
    /// Instances are about to be destroyed: later faults, even from the same address, start records
    /// of their own.
    void close_rows();
    /// Returns the records with ages relative to `now_ns`, the oldest first.
    std::vector<FaultRecord> records(std::int64_t now_ns) const;
    bool empty() const { return rows_.empty(); }
    std::uint64_t newest_number() const { return number_; }  ///< 0: there was no fault yet
    const FaultRecord& newest() const { return rows_.back().record; }
    /// Forgets all records except the newest of each condition that lasts.
    void clear();
    /// Returns the newest record of each condition that lasts, the oldest first.
    std::vector<FaultRecord> lasting(std::int64_t now_ns) const;

private:
    struct Row {
        FaultRecord record;  // its age is the time of the first fault
        // the latest; compared with those that follow. HAL_FAULT_NONE: closed
        FaultEvent event;
        Core::Condition condition;  // that may last
    };
    bool lasts(const Row& row) const;
    bool is_newest(const Row& row) const;
    void collect_stalls();
    Absence absence_of(const FaultEvent& event, const Core& core) const;
    void add(Row row);

    const MachineView& machine_;
    std::deque<Row> rows_;
    std::uint64_t number_ = 0;  // of the newest
};

/// Returns the function with that number in the plan, or nullptr.
const LoadedFunction* function_with_id(const Model& model, std::uint32_t id);
/// Returns "function 'pid.0.do-pid-calcs' (pid)".
std::string function_text(const LoadedFunction& function);

}  // namespace hal
