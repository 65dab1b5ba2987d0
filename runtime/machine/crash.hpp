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
/// Of a cycle that runs and has done so for long: the model is read without a lock, since whoever changes it waits for the cycle.
CycleNames names_of(const CycleNow& now);

/// After watch_for_crashes(): the machine is going.
void end_watch_for_crashes(SessionState* state);

}  // namespace hal
