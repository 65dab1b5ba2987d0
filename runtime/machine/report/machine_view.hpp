// SPDX-License-Identifier: MIT
// What reports and crash handlers look at: the model, its threads, and what runs them.
#pragma once

#include <unordered_map>

namespace hal {

class Core;
class Executor;
struct Model;
struct Thread;

/// The threads of a machine that have been made.
using Cores = std::unordered_map<const Thread*, Core*>;

struct MachineView {
    const Model& model;
    Executor& executor;
    const Cores& cores;

    /// Returns nullptr for a thread of the model that has not been made yet.
    Core* core(const Thread* thread) const {
        const auto at = cores.find(thread);
        return at == cores.end() ? nullptr : at->second;
    }
};

}  // namespace hal
