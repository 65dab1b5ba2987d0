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

/// Returns true unless this process was forked by that of the machine. async-signal-safe
bool is_machine_process() noexcept;
/// The calling code makes a call that ends the machine or would leave it unsafe, such as "exit()":
/// sets the outputs to their safe values and names the code, with `code` at the end of the line.
/// Returns false when it is not code of a component, or an end was reported already.
/// async-signal-safe
bool report_end(const char* call, const char* code = "") noexcept;
/// Returns true once the end of the process was reported. async-signal-safe
bool end_is_reported() noexcept;
/// Ends a copy of the process that returned from the code of a component that had forked it.
[[noreturn]] void end_copy() noexcept;

/// Ends the process as _exit() does; the caller has reported why. async-signal-safe
[[noreturn]] void end_process(int status) noexcept;

/// This process is a copy of one with machines, made between two cycles, and has them from now on.
void continue_in_copy() noexcept;

/// Reports of crashes and escaped exceptions name what `machine` contains, until
/// end_watch_for_crashes(). [setup]
void watch_for_crashes(const MachineView& machine);
/// Of these, only: a component that ends the process while it is constructed, started or stopped.
/// [setup]
void watch_for_exits();
/// After watch_for_crashes(): the machine is going. [setup]
void end_watch_for_crashes(const MachineView& machine);

}  // namespace hal
