// SPDX-License-Identifier: MIT
// The state that instances take over from those they replace at a reload.
//
// An instance may have functions in several threads, which take their plans at different moments.
// So that no thread runs the old version while another one copies its state:
//   1. all functions but those in the fastest of these threads leave theirs
//   2. after that, the fastest thread takes the new version and copies the state at that boundary
//   3. the other functions return
// When no thread runs an instance, the session copies.
#pragma once

#include <unordered_set>
#include <vector>

#include "model/edit_log.hpp"
#include "model/model.hpp"
#include "plan/plan.hpp"

namespace hal {

/// One instance whose state is in the memory of the instance it replaces.
struct StateHandover {
    Instance* instance;
    std::vector<plan::Handover> copies;
    plan::Handed handed;  ///< to be recorded after the copies
};

/// Returns the variables of `old` that `fresh` does not have with the same name, type and size.
std::vector<const Instance::Variable*> lost_variables(const Instance& old, const Instance& fresh);

/// Returns all handovers that the replacements of an edit still need.
std::vector<StateHandover> state_handovers(EditLog& edit);

/// Returns the functions that leave their threads in step 1.
std::unordered_set<const LoadedFunction*> late_functions(
    const std::vector<StateHandover>& handovers);

/// Copies the state now. [setup] no thread runs the instance
void hand_over(const StateHandover& handover);

}  // namespace hal
