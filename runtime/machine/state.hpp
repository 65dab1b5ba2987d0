// SPDX-License-Identifier: MIT
// What a Session holds; private to this folder.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <unordered_map>
#include <vector>

#include "execute/executor.hpp"
#include "hal/status.h"
#include "machine/elaborate.hpp"
#include "machine/fault_log.hpp"
#include "machine/journal.hpp"
#include "machine/plugins.hpp"
#include "machine/probes.hpp"
#include "machine/session.hpp"
#include "machine/traces.hpp"
#include "model/compile.hpp"
#include "model/names.hpp"

namespace hal {

struct SessionState {
    explicit SessionState(SessionOptions o);
    ~SessionState();

    SessionOptions options;
    Plugins plugins;
    Model model;
    std::unique_ptr<Executor> executor;
    std::unordered_map<const Thread*, Core*> cores;
    /// what each thread runs
    std::unordered_map<const Thread*, std::unique_ptr<plan::Plan>> plans;
    /// kept after an edit that a thread did not answer: places in them may be in use
    std::vector<std::unique_ptr<plan::Plan>> stuck;
    /// of the swap before: a loose pin's other thread may use one a moment longer
    std::vector<std::shared_ptr<void>> left_cells;
    std::uint64_t epoch = 0;

    bool open = false;                       ///< a Transaction exists
    std::unique_ptr<Edit> edit;              ///< what it has edited; made by its first edit
    std::vector<std::function<void()>> when_committed;
    /// the open transaction does not take effect while a thread hangs
    bool needs_threads = false;
    ModelNames names;
    Absences absences;                       ///< of `hal check`: of all texts so far
    std::vector<AutoOrder> auto_orders;
    std::size_t commands = 0;                ///< in the open transaction
    /// warnings and notes that were printed before and still hold; TRUE: of a check of a whole text
    std::map<std::string, bool> reported;

    /// What the open transaction put in place of, should it be withdrawn after a thread has taken
    /// it.
    struct {
        Notes<Pin, hal_value> pins;
        Notes<Signal, hal_value> signals;
    } before;
    /// threads may have been made, ended or given a plan for the open transaction
    bool touched = false;
    /// given back when memory has run out, so that undoing has some
    std::unique_ptr<char[]> reserve;

    Probes probes{*this};
    FaultLog faults{*this};
    Journal journal{*this};
    Traces traces{*this};
    hal_status status{sizeof status, nullptr, nullptr};  ///< for plugins
    std::vector<std::string> refused;  ///< by the system: "memory locking"
    bool shut = false;
    bool abandoned = false;  ///< a thread hangs and may go on using everything here
    std::stop_token ending;  ///< Session::end_token()

    Core* core(const Thread* thread) const;
    /// Adds threads that have no core yet. False after reporting.
    bool make_threads(Diagnostics& diagnostics);
    /// Ends threads that left the model.
    bool end_threads(std::vector<std::unique_ptr<Thread>>& threads, Diagnostics& diagnostics);
    /// Compiles the model and makes all threads run it; in two steps when functions move between
    /// threads.
    bool synchronise(Diagnostics& diagnostics);
    /// Makes the open transaction take effect. False after reporting; then it is to be withdrawn.
    bool carry_out(Diagnostics& diagnostics);
    /// Undoes the open transaction, in the model and in threads that have taken it.
    void withdraw(Diagnostics* diagnostics = nullptr);
    /// Reports that there is no memory left, and makes some.
    void out_of_memory(Diagnostics& diagnostics);
    /// Reports a thread that is ready to run without CPU time. Returns false when it is not one.
    bool starved_thread(const Thread& thread, const Core& core, Diagnostics& diagnostics) const;
    /// One error for a thread that hangs or is starved.
    void hung_thread(const Thread& thread, const Core& core, Diagnostics& diagnostics) const;
    /// New values of what threads own, into their queues.
    bool write_values(const Notes<Pin, hal_value>& pins, const Notes<Signal, hal_value>& signals,
                      Diagnostics& diagnostics);
    /// The edit of the open transaction, whose next problems go to `diagnostics`.
    Edit& editing(Diagnostics& diagnostics);
    bool start_replaced(Diagnostics& diagnostics);
    void restart_replaced(Diagnostics& diagnostics);
    void retire();
    void forget_reported(const Diagnostics& found, bool whole);
    void report_removed_functions(Diagnostics& diagnostics);
    /// As Session::offer_names().
    void offer_names(Diagnostics& diagnostics);
    /// The transaction is over: what is no longer in the model is destroyed.
    void close_edit();
    /// The faults of an instance that was stopped or destroyed do not last any more.
    void end_conditions(const Instance& instance);
    /// Waits until each thread is between two cycles. False after reporting those that hang.
    bool all_answer(Diagnostics& diagnostics);

private:
    bool swap(const std::unordered_set<const LoadedFunction*>& without, Diagnostics& diagnostics);
    void describe_functions();
    void keep_values();
    void observe_unknowns(Compiled& compiled);
    void settle(Compiled& compiled, const std::vector<Core*>& silent);
    void silent_thread(const Core* core, Diagnostics& diagnostics) const;
};

/// Reports of crashes and escaped exceptions name what `state` knows. nullptr: nothing is known any
/// more.
void watch_for_crashes(SessionState* state);
/// Of these, only: a component that ends the process while it is constructed, started or stopped.
void watch_for_exits();

/// How long a thread may take to answer beyond two of its periods.
inline constexpr std::int64_t answer_timeout_ns = 1'000'000'000;

}  // namespace hal
