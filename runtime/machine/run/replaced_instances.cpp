// SPDX-License-Identifier: MIT
#include "machine/run/replaced_instances.hpp"

#include <algorithm>

#include "machine/load/construct.hpp"
#include "machine/run/state.hpp"

namespace hal {
namespace {

// Plugins of an interface before 1.1 do not declare it.
bool acquires(const LoadedComponent& component) {
    return component.plugin->abi_minor < 1 || (component.plugin->flags & HAL_COMPONENT_STARTS);
}

void insert(std::unordered_set<const LoadedFunction*>& all, const LoadedComponent& component) {
    for (const auto& function : component.functions) {
        all.insert(function.get());
    }
}

}  // namespace

bool ReplacedInstances::start_new(const LoadedComponent& component, Diagnostics& diagnostics) {
    for (const auto& instance : component.instances) {
        if (instance->started) continue;
        const Failure why = state_.start(*instance);
        if (why.empty()) continue;
        const std::string goes_on = "the old version goes on";
        diagnostics.error("start-failed", instance->loaded,
                          "'" + instance->name + "' (" + component.name +
                              ") cannot start in its new version: " + why.text,
                          "loaded here", why.help.empty() ? goes_on : why.help + "; " + goes_on);
    }
    return !diagnostics.failed();
}

/// Outputs that declare a safe value take it while their functions are not in a thread.
void ReplacedInstances::make_safe(const LoadedComponent& component) {
    for (const auto& instance : component.instances) {
        for (const auto& pin : instance->pins) {
            if (pin->dir != HAL_DIR_OUT || !(pin->flags & HAL_PIN_SAFE)) continue;
            if (pin->signal) {
                edit_.signal_values.try_emplace(pin->signal, pin->safe);
            } else {
                edit_.pin_values.try_emplace(pin.get(), pin->safe);
            }
        }
    }
}

/// Stops the instances that are not in the model.
void ReplacedInstances::stop(const Edit::Replaced& one) {
    for (auto it = one.other->instances.rbegin(); it != one.other->instances.rend(); ++it) {
        stop_instance(**it);
        end_conditions(*state_.executor, **it);
    }
}

bool ReplacedInstances::start(Diagnostics& diagnostics) {
    Functions without;
    for (const Edit::Replaced& one : edit_.replaced()) {
        if (acquires(*one.component) || acquires(*one.other)) {
            insert(without, *one.component);
            make_safe(*one.component);
        } else if (!start_new(*one.component, diagnostics)) {
            return false;
        }
    }
    if (without.empty()) return true;
    without.merge(ThreadPlans::deferred(edit_, state_.model));
    ThreadPlans& threads = state_.threads;
    if (!threads.make(diagnostics)) return false;
    if (!threads.end(edit_.removed().threads, diagnostics)) return false;
    if (!threads.swap(edit_, before_, without, diagnostics)) return false;
    for (Edit::Replaced& one : edit_.replaced()) {
        one.stopped = true;
        stop(one);
    }
    // no thread runs what has not been handed over yet
    std::ranges::for_each(state_handovers(edit_), hand_over);
    for (const Edit::Replaced& one : edit_.replaced()) {
        if (!start_new(*one.component, diagnostics)) return false;
    }
    return true;
}

void ReplacedInstances::restart(Diagnostics& diagnostics) {
    Functions without;
    for (Edit::Replaced& one : edit_.replaced()) {
        if (!one.stopped) continue;
        insert(without, *one.component);
        // the old ones have their state as they were stopped with it
        for (Edit::Replaced::Pair& pair : one.pairs) {
            pair.handed = false;
        }
    }
    if (without.empty()) return;
    Diagnostics ignored;
    if (!state_.threads.swap(edit_, before_, without, ignored)) {
        return;  // a thread hangs, perhaps in a new one
    }
    for (const Edit::Replaced& one : edit_.replaced()) {
        stop(one);
        if (one.stopped) {
            restart_old(one, diagnostics);
        }
    }
}

void ReplacedInstances::restart_old(const Edit::Replaced& one, Diagnostics& diagnostics) {
    const std::string& component = one.component->name;
    for (const auto& instance : one.component->instances) {
        if (instance->started) continue;
        const Failure why = state_.start(*instance);
        if (why.empty()) continue;
        for (LoadedFunction* const function : instance->functions) {
            function->halted = true;
        }
        diagnostics.error("start-failed", instance->loaded,
                          "'" + instance->name + "' (" + component +
                              ") cannot start again in its old version: " + why.text,
                          "loaded here",
                          "its functions do not run; repair the plugin and 'reload " + component +
                              "', or 'unload " + component + "'");
    }
}

}  // namespace hal
