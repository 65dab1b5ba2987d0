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

}  // namespace

void check_unthreaded_functions(const Model& model, Unthreaded which, Diagnostics& diagnostics) {
    for (const auto& component : model.components) {
        for (const auto& function : component->functions) {
            if (which == Unthreaded::removed && !function->was_in_thread) continue;
            if (function->thread || runs_by_another(*function)) continue;
            if (const LoadedFunction* const other = waiting_for(*function)) {
                diagnostics.warning("unthreaded-function", function->instances.front()->loaded,
                                    "function '" + function->name + "' is in no thread, but '" +
                                        other->name + "' is in thread '" + other->thread->name +
                                        "' and does not work without it",
                                    "", "addf " + function->name + " " + other->thread->name);
                continue;
            }
            const bool linked = std::any_of(function->instances.begin(), function->instances.end(),
                                            [&](const Instance* instance) {
                return !instance->own_threads &&
                       std::any_of(instance->pins.begin(), instance->pins.end(),
                                   [&](const auto& pin) {
                    return pin->signal && (!pin->function || pin->function == function.get());
                });
            });
            if (!linked) continue;
            const std::string thread =
                model.threads.empty() ? "THREAD" : model.threads.back()->name;
            diagnostics.warning("unthreaded-function", function->instances.front()->loaded,
                                "function '" + function->name +
                                    "' is in no thread, so its linked pins never change",
                                "", "addf " + function->name + " " + thread);
        }
    }
}

}  // namespace hal
