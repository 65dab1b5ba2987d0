// SPDX-License-Identifier: MIT
// Reports crashes, escaped exceptions and components that end the process, and names what ran.
#pragma once

#include <string>

#include "execute/cycle_now.hpp"
#include "machine/report/machine_view.hpp"

namespace hal {

/// "servo", "function 'pid.0.do-pid-calcs' (pid)"; empty: unknown.
struct CycleNames {
    std::string thread, function;
};
/// Returns the names for a cycle that does not end. The model is read without a lock: an edit waits
/// for the end of the cycle.
CycleNames names_of(const CycleNow& now);

/// Ends the process as _exit() does; the caller has reported why. async-signal-safe
[[noreturn]] void end_process(int status) noexcept;

/// Reports of crashes and escaped exceptions name what `machine` contains, until
/// end_watch_for_crashes(). [setup]
void watch_for_crashes(const MachineView& machine);
/// Of these, only: a component that ends the process while it is constructed, started or stopped.
/// [setup]
void watch_for_exits();
/// After watch_for_crashes(): the machine is going. [setup]
void end_watch_for_crashes(const MachineView& machine);

}  // namespace hal
