// SPDX-License-Identifier: MIT
// The life of instances that take the place of others: docs/decisions/0011.
//
// A component without start and stop holds nothing: its new instances are there before the swap,
// the old ones go after it, and no cycle passes without them. One that acquires something may not
// be there twice:
//   1. its functions leave the threads; outputs that declare a safe value take it
//   2. the old instances stop       3. the new ones start
//   4. the functions are back, in their old places
// When 3 fails, the new ones stop, the old ones start again, and 4 is done with them.
#pragma once

#include <unordered_set>

#include "machine/run/thread_plans.hpp"
#include "model/edit.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct SessionState;

/// The instances that an edit has replaced. [setup]
class ReplacedInstances {
public:
    ReplacedInstances(SessionState& state, Edit& edit, EarlierValues& before)
        : state_(state), edit_(edit), before_(before) {}

    /// Starts the new instances, after the old ones have stopped if they acquire something. False
    /// after reporting.
    bool start(Diagnostics& diagnostics);
    /// After Edit::undo(): the old instances are in the model again, the new ones beside it, and
    /// perhaps in the threads. Starts the old ones again.
    void restart(Diagnostics& diagnostics);

private:
    using Functions = std::unordered_set<const LoadedFunction*>;

    bool start_new(const LoadedComponent& component, Diagnostics& diagnostics);
    void restart_old(const Edit::Replaced& one, Diagnostics& diagnostics);
    void stop(const Edit::Replaced& one);
    void make_safe(const LoadedComponent& component);

    SessionState& state_;
    Edit& edit_;
    EarlierValues& before_;
};

}  // namespace hal
