// SPDX-License-Identifier: MIT
// What a Session holds; private to this folder.
#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "execute/executor.hpp"
#include "hal/status.h"
#include "machine/construct.hpp"
#include "machine/fault_log.hpp"
#include "machine/journal.hpp"
#include "machine/open_transaction.hpp"
#include "machine/plugins.hpp"
#include "machine/probes.hpp"
#include "machine/session.hpp"
#include "machine/thread_plans.hpp"
#include "machine/traces.hpp"
#include "model/names.hpp"

namespace hal {

struct SessionState {
    enum class Life {
        running,
        shut,
        abandoned  ///< a thread hangs and may go on using everything here
    };

    explicit SessionState(SessionOptions o);
    ~SessionState();

    SessionOptions options;
    Plugins plugins;
    Model model;
    std::unique_ptr<Executor> executor;
    ThreadPlans threads{*this};
    OpenTransaction transaction{*this};
    ModelNames names;
    Absences absences;  ///< of `hal check`: of all texts so far
    Probes probes{*this};
    FaultLog faults{*this};
    Journal journal{*this};
    Traces traces{*this};
    hal_status status{sizeof status, nullptr, nullptr};  ///< for plugins
    std::vector<std::string> refused;  ///< by the system: "memory locking"
    Life life = Life::running;
    std::stop_token ending;  ///< Session::end_token()

    /// As Session::offer_names().
    void offer_names(Diagnostics& diagnostics);
    /// Starts an instance. Returns why it cannot.
    Failure start(Instance& instance);
};

/// The faults of an instance that was stopped or destroyed do not last any more.
void end_conditions(Executor& executor, const Instance& instance);

/// Reports of crashes and escaped exceptions name what `state` knows. nullptr: nothing is known any
/// more.
void watch_for_crashes(SessionState* state);
/// Of these, only: a component that ends the process while it is constructed, started or stopped.
void watch_for_exits();

}  // namespace hal
