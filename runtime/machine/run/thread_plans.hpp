// SPDX-License-Identifier: MIT
// The threads of a session and the plan that each of them runs: steps 6 and 7 of docs/design.md.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "execute/executor.hpp"
#include "machine/report/machine_view.hpp"
#include "model/compile.hpp"
#include "model/edit.hpp"
#include "model/state_handover.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct SessionState;

/// How long a thread may take to answer beyond two of its periods.
inline constexpr std::int64_t answer_timeout_ns = 1'000'000'000;

/// Values that an edit has put others in place of, should it be rolled back after a thread has
/// taken it.
struct EarlierValues {
    Notes<Pin, hal_value> pins;
    Notes<Signal, hal_value> signals;

    /// Adds the present values of what `edit` is about to set.
    void note(const Edit& edit);
    void clear();
};

/// Makes and ends threads, and gives them plans and values. [setup]
class ThreadPlans {
public:
    using Functions = std::unordered_set<const LoadedFunction*>;
    using Plans = std::unordered_map<const Thread*, std::unique_ptr<plan::Plan>>;

    explicit ThreadPlans(SessionState& state) : state_(state) {}

    /// Returns nullptr for a thread of the model that has not been made yet.
    Core* core(const Thread* thread) const;
    const Cores& cores() const { return cores_; }
    /// What each thread runs.
    const Plans& plans() const { return plans_; }
    /// Returns the epoch of the newest plans.
    std::uint64_t epoch() const { return epoch_; }
    /// Makes the next plans have the epochs that they had in a journaled machine, which are larger.
    void continue_after(std::uint64_t epoch) { epoch_ = epoch; }

    /// Makes the threads of the model that have no core yet. False after reporting.
    bool make(Diagnostics& diagnostics);
    /// Ends threads that left the model. False after reporting.
    bool end(std::vector<std::unique_ptr<Thread>>& threads, Diagnostics& diagnostics);
    /// Ends threads that are not in the model, after a rollback. False when one does not end.
    bool end_orphans();
    /// Ends all threads. Returns false when one hangs and is abandoned.
    bool end_all();

    /// Compiles the model and makes all threads run it; in two steps when functions move between
    /// threads. False after reporting.
    bool synchronise(Edit& edit, EarlierValues& before, Diagnostics& diagnostics);
    /// The same in one step and without the functions `without`.
    bool swap(Edit& edit, EarlierValues& before, const Functions& without,
              Diagnostics& diagnostics);
    /// Returns the functions that a first step leaves out: no function may be in two threads at
    /// once, nor run in one while another copies its state.
    static Functions deferred(Edit& edit, const Model& model);
    /// An edit has taken effect in all threads: frees the plans of earlier ones that did not.
    void free_stuck() { stuck_.clear(); }
    /// Puts new values of what threads own into their queues. False after reporting.
    bool write(const Notes<Pin, hal_value>& pins, const Notes<Signal, hal_value>& signals,
               Diagnostics& diagnostics);

    /// Waits until each thread is between two cycles. False after reporting those that hang.
    bool all_answer(Diagnostics& diagnostics);
    /// Reports one error for a thread that hangs or is starved.
    void report_hung(const Thread& thread, const Core& core, Diagnostics& diagnostics) const;

private:
    bool add(Thread& thread, int priority, Diagnostics& diagnostics);
    std::string rival_of(const Core& core, int cpu) const;
    void warn_of_missing_cpu(const Thread& thread, const Core& core,
                             Diagnostics& diagnostics) const;
    bool end(Thread& thread, Core& core, Diagnostics& diagnostics);
    bool report_starved(const Thread& thread, const Core& core, Diagnostics& diagnostics) const;
    void report_silent(const Core* core, Diagnostics& diagnostics) const;
    bool report_hung_writers(const std::vector<std::pair<Core*, std::vector<Write>>>& rows,
                             Diagnostics& diagnostics) const;
    void observe_unknowns(Compiled& compiled);
    std::vector<StateHandover> hand_over_in_threads(Edit& edit, const Functions& without,
                                                    Compiled& compiled) const;
    void describe_functions();
    void keep_cells(const std::vector<std::shared_ptr<void>>& cells, bool all_answered);

    SessionState& state_;
    Cores cores_;
    Plans plans_;
    /// kept after an edit that a thread did not answer: slots in them may be in use
    std::vector<std::unique_ptr<plan::Plan>> stuck_;
    /// of the swap before: a loose pin's other thread may use one a moment longer
    std::vector<std::shared_ptr<void>> left_cells_;
    std::uint64_t epoch_ = 0;
};

}  // namespace hal
