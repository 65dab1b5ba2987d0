// SPDX-License-Identifier: MIT
// From the model to a plan per thread. Pure: reads the model, changes nothing; the session applies
// the result.
#pragma once

#include <functional>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "model/edit.hpp"
#include "model/model.hpp"
#include "plan/plan.hpp"

namespace hal {

struct CompileInput {
    std::uint64_t epoch = 0;
    /// Functions left out: those that move between threads, in the first of two swaps.
    const std::unordered_set<const LoadedFunction*>* without = nullptr;
    /// New values of what threads own, and signals that take a pin's value (see Edit).
    const Notes<Pin, hal_value>* pin_values = nullptr;
    const Notes<Signal, hal_value>* signal_values = nullptr;
    const Notes<Signal, Pin*>* inherited = nullptr;
    /// of pins whose instance was replaced
    const std::unordered_map<const Pin*, hal_pin*>* old_memory = nullptr;
    std::function<void*(const Thread&)> core_of;  ///< the sink of finite checks
    hal_step check_finite = nullptr;
    /// Not nullptr: the threads have a journal, whose checksums cover their values. What the gates
    /// around functions that share state have in common, and the steps that pass them.
    const plan::Gate* gate = nullptr;
    hal_step enter_gate = nullptr;
    hal_step leave_gate = nullptr;
    bool journaled() const { return gate != nullptr; }
};

/// Where things will be once all threads have taken their plans.
struct Compiled {
    std::vector<std::pair<Thread*, std::unique_ptr<plan::Plan>>> plans;
    struct Place {
        Signal* signal;
        Thread* home;
        hal_value* slot;
        std::vector<std::pair<Thread*, hal_value*>> copies;
        std::shared_ptr<hal_value> cell;
    };
    std::vector<Place> places;  ///< of every signal
    std::vector<std::pair<Pin*, Thread*>> homes;  ///< of pins whose thread changes
    struct SessionRebind {
        hal_pin* pin;
        hal_value* slot;
        const hal_value* from;  ///< where its value is now
        /// what it had when it was linked; false for a port, whose buffer stays with its signal
        bool keeps_value;
    };
    /// of pins that no thread uses; done after the swap
    std::vector<SessionRebind> session_rebinds;
    std::vector<plan::Pointer> session_pointers;  ///< with them
    /// Carries whose value another thread owns now: to be observed and filled in before the swap.
    struct Unknown {
        plan::Carry* carry;
        const hal_value* from;
        Thread* owner;
    };
    std::vector<Unknown> unknowns;
};

Compiled compile(const Model& model, const CompileInput& input);

/// Functions whose instances move from one thread to another: they need two swaps. Empty: one is
/// enough.
std::unordered_set<const LoadedFunction*> moving(const Model& model);

}  // namespace hal
