// SPDX-License-Identifier: MIT
// What a Session holds; private to this folder.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "execute/executor.hpp"
#include "model/compile.hpp"
#include "session/elaborate.hpp"
#include "session/plugins.hpp"
#include "session/session.hpp"

namespace hal {

struct Session::State {
    explicit State(SessionOptions o);
    ~State();

    SessionOptions options;
    Plugins plugins;
    Model model;
    std::unique_ptr<Executor> executor;
    std::unordered_map<const Thread*, Core*> cores;
    std::unordered_map<const Thread*, std::unique_ptr<plan::Plan>> plans;  ///< what each thread runs
    std::vector<std::unique_ptr<plan::Plan>> stuck;                        ///< of threads that never answered
    std::uint64_t epoch = 0;

    std::unique_ptr<Edit> edit;              ///< the open transaction
    std::vector<AutoOrder> auto_orders;
    std::size_t commands = 0;                ///< in the open transaction
    std::set<std::string> reported;          ///< warnings and notes said before

    std::deque<FaultRecord> fault_log;
    std::vector<std::int64_t> fault_times;
    std::vector<std::string> refused;        ///< by the system: "memory locking"
    bool shut = false;

    Core* core(const Thread* thread) const;
    /// Adds threads that have no core yet. False after reporting.
    bool make_threads(Diagnostics& diagnostics);
    /// Ends threads that left the model.
    bool end_threads(std::vector<std::unique_ptr<Thread>>& threads, Diagnostics& diagnostics);
    /// Compiles the model and makes all threads run it; in two steps when functions move between threads.
    bool synchronise(Diagnostics& diagnostics);
    void undo_edit();
    void destroy_removed();
    void collect_faults();

private:
    bool swap(const std::unordered_set<const Function*>& without, Diagnostics& diagnostics);
    void observe_unknowns(Compiled& compiled);
    void settle(Compiled& compiled, const std::vector<Core*>& silent);
};

/// Reports of crashes and escaped exceptions name what `state` knows. nullptr: nothing is known any more.
void watch_for_crashes(Session::State* state);

/// How long a thread may take to answer beyond two of its periods.
inline constexpr std::int64_t answer_timeout_ns = 1'000'000'000;

}  // namespace hal
