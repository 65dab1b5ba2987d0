// SPDX-License-Identifier: MIT
// The life of instances that take the place of others: docs/decisions/0011.
//
// A component without start and stop holds nothing: its new instances are there before the swap,
// the old ones go after it, and no cycle passes without them. One that acquires something may not
// be there twice:
//   1. its functions leave the threads; outputs that declare a safe value take it
//   2. the old instances stop       3. the new ones start
//   4. the functions are back, in their old places
// When 3 fails, the new ones stop, the old ones start again, and 4 is done with them.
#include "machine/construct.hpp"
#include "machine/state.hpp"

namespace hal {
namespace {

// Plugins of an interface before 1.1 do not declare it.
bool acquires(const LoadedComponent& component) {
    return component.plugin->abi_minor < 1 || (component.plugin->flags & HAL_COMPONENT_STARTS);
}

}  // namespace

bool SessionState::start_replaced(Diagnostics& diagnostics) {
    const auto start = [&](const LoadedComponent& component) {
        for (const auto& instance : component.instances) {
            if (instance->started) continue;
            if (const Failure why =
                    start_instance(*instance, model, *executor, status, journal.for_plugins());
                !why.empty()) {
                diagnostics.error("start-failed", instance->loaded,
                                  "'" + instance->name + "' (" + component.name +
                                      ") cannot start in its new version: " + why.text,
                                  "loaded here",
                                  why.help.empty() ? "the old version goes on"
                                                   : why.help + "; the old version goes on");
            }
        }
        return !diagnostics.failed();
    };
    std::unordered_set<const LoadedFunction*> out;
    for (const Edit::Replaced& one : edit->replaced()) {
        if (!acquires(*one.component) && !acquires(*one.other)) {
            if (!start(*one.component)) return false;
            continue;
        }
        for (const auto& function : one.component->functions) {
            out.insert(function.get());
        }
        for (const auto& instance : one.component->instances) {
            for (const auto& pin : instance->pins) {
                if (pin->dir != HAL_DIR_OUT || !(pin->flags & HAL_PIN_SAFE)) continue;
                if (pin->signal) {
                    edit->signal_values.try_emplace(pin->signal, pin->safe);
                } else {
                    edit->pin_values.try_emplace(pin.get(), pin->safe);
                }
            }
        }
    }
    if (out.empty()) return true;
    out.merge(moving(model));
    if (!make_threads(diagnostics) || !end_threads(edit->removed().threads, diagnostics) ||
        !swap(out, diagnostics)) {
        return false;
    }
    for (Edit::Replaced& one : edit->replaced()) {
        one.stopped = true;
        for (auto it = one.other->instances.rbegin(); it != one.other->instances.rend(); ++it) {
            stop_instance(**it);
            end_conditions(**it);
        }
    }
    for (const Edit::Replaced& one : edit->replaced()) {
        if (!start(*one.component)) return false;
    }
    return true;
}

// After undo(): the old instances are in the model again, the new ones beside it, and perhaps in
// the threads.
void SessionState::restart_replaced(Diagnostics& diagnostics) {
    std::unordered_set<const LoadedFunction*> out;
    for (const Edit::Replaced& one : edit->replaced()) {
        if (one.stopped) {
            for (const auto& function : one.component->functions) {
                out.insert(function.get());
            }
        }
    }
    if (out.empty()) return;
    Diagnostics ignored;
    if (!swap(out, ignored)) {
        return;  // a thread hangs, perhaps in a new one
    }
    for (const Edit::Replaced& one : edit->replaced()) {
        for (auto it = one.other->instances.rbegin(); it != one.other->instances.rend(); ++it) {
            stop_instance(**it);
            end_conditions(**it);
        }
        for (const auto& instance : one.component->instances) {
            if (instance->started || !one.stopped) continue;
            const Failure why =
                start_instance(*instance, model, *executor, status, journal.for_plugins());
            if (why.empty()) continue;
            for (LoadedFunction* const function : instance->functions) {
                function->halted = true;
            }
            diagnostics.error("start-failed", instance->loaded,
                              "'" + instance->name + "' (" + one.component->name +
                                  ") cannot start again in its old version: " + why.text,
                              "loaded here",
                              "its functions do not run; repair the plugin and 'reload " +
                                  one.component->name + "', or 'unload " + one.component->name +
                                  "'");
        }
    }
}

}  // namespace hal
