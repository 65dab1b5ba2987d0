// SPDX-License-Identifier: MIT
// What reports of crashes and of endless cycles name.
#pragma once

#include <string>

#include "execute/cycle_now.hpp"
#include "machine/state.hpp"

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

/// After watch_for_crashes(): the machine is going.
void end_watch_for_crashes(SessionState* state);

}  // namespace hal
