// SPDX-License-Identifier: MIT
#include <algorithm>

#include "model/check/check.hpp"

namespace hal {

namespace {

/// Returns whether a thread calls the same steps by other functions, as `lcec.0.read` does those of
/// `lcec.read-all`.
bool runs_by_another(const LoadedFunction& function) {
    for (std::size_t i = 0; i < function.steps.size(); ++i) {
        const plan::Step& step = function.steps[i];
        const auto& others = function.instances[i]->functions;
        const bool runs =
            std::any_of(others.begin(), others.end(), [&](const LoadedFunction* other) {
            return other->thread && std::any_of(other->steps.begin(), other->steps.end(),
                                                [&](const plan::Step& one) {
                return one.step == step.step && one.self == step.self;
            });
        });
        if (!runs) return false;
    }
    return true;
}

/// Returns a function in a thread that does not work without `function`; nullptr without one.
const LoadedFunction* waiting_for(const LoadedFunction& function) {
    if (!function.required) return nullptr;
    for (const Instance* instance : function.instances) {
        for (const LoadedFunction* other : instance->functions) {
            if (other->thread) return other;
        }
    }
    return nullptr;
}

/// Returns whether a thread that called the function would change the value of a signal.
bool has_linked_pin(const LoadedFunction& function) {
    const auto belongs_to_function = [&](const auto& pin) {
        return !pin->function || pin->function == &function;
    };
    for (const Instance* instance : function.instances) {
        if (instance->own_threads) continue;
        for (const auto& pin : instance->pins) {
            if (pin->signal && belongs_to_function(pin)) return true;
        }
    }
    return false;
}

void warn(const LoadedFunction& function, const std::string& sentence, const std::string& thread,
          Diagnostics& diagnostics) {
    diagnostics.warning("unthreaded-function", function.instances.front()->loaded,
                        "function '" + function.name + "' is in no thread, " + sentence, "",
                        "addf " + function.name + " " + thread);
}

void check_function(const LoadedFunction& function, const Model& model, Diagnostics& diagnostics) {
    if (function.thread || runs_by_another(function)) return;
    if (const LoadedFunction* const other = waiting_for(function)) {
        return warn(function,
                    "but '" + other->name + "' is in thread '" + other->thread->name +
                        "' and does not work without it",
                    other->thread->name, diagnostics);
    }
    if (!has_linked_pin(function)) return;
    const std::string thread = model.threads.empty() ? "THREAD" : model.threads.back()->name;
    warn(function, "so its linked pins never change", thread, diagnostics);
}

}  // namespace

void check_unthreaded_functions(const Model& model, Unthreaded which, Diagnostics& diagnostics) {
    for (const auto& component : model.components) {
        for (const auto& function : component->functions) {
            const bool is_selected = which != Unthreaded::removed || function->was_in_thread;
            if (is_selected) {
                check_function(*function, model, diagnostics);
            }
        }
    }
}

}  // namespace hal
