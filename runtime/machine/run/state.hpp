// SPDX-License-Identifier: MIT
// What a RunningModel holds; private to this folder.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "execute/executor.hpp"
#include "hal/status.h"
#include "machine/load/construct.hpp"
#include "machine/load/plugins.hpp"
#include "machine/report/event_log.hpp"
#include "machine/report/fault_log.hpp"
#include "machine/report/machine_view.hpp"
#include "machine/report/traces.hpp"
#include "machine/run/open_transaction.hpp"
#include "machine/run/probes.hpp"
#include "machine/run/running_model.hpp"
#include "machine/run/setup_journal.hpp"
#include "machine/run/thread_plans.hpp"
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
    std::optional<SetupJournal> setup;  ///< of a machine with a journal, or of one executed again
    Plugins plugins;
    Model model;
    std::unique_ptr<Executor> executor;
    ThreadPlans threads{*this};
    MachineView view{model, *executor, threads.cores()};
    OpenTransaction transaction{*this};
    ModelNames names;
    Absences absences;  ///< of `hal check`: of all texts so far
    Probes probes{*this};
    FaultLog faults{view};
    EventLog event_log{*executor, faults};
    Traces traces{view};
    hal_status status{sizeof status, nullptr, nullptr};  ///< for plugins
    std::vector<std::string> refused;  ///< by the system: "memory locking"
    std::vector<std::string> failed_stops;  ///< RunningModel::failed_stops()
    Life life = Life::running;
    std::stop_token ending;  ///< RunningModel::end_token()

    /// As RunningModel::offer_names().
    void offer_names(Diagnostics& diagnostics);
    /// Starts an instance. Returns why it cannot.
    Failure start(Instance& instance);
    /// Stops and destroys an instance, and notes when it raises a fault meanwhile.
    void destroy(Instance& instance);
};

/// The faults of an instance that was stopped or destroyed do not last any more.
void end_conditions(Executor& executor, const Instance& instance);

}  // namespace hal
