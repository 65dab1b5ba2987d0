// SPDX-License-Identifier: MIT
#include <algorithm>

#include "model/check/check.hpp"

namespace hal {

namespace {

bool is_cyclic(const LoadedFunction& function) { return function.thread && !function.init; }

/// Returns whether the functions call the same code of an instance, as `lcec.0.read` and
/// `lcec.read-all` do.
bool share_a_step(const LoadedFunction& one, const LoadedFunction& other) {
    return std::any_of(one.steps.begin(), one.steps.end(), [&](const plan::Step& step) {
        return std::any_of(other.steps.begin(), other.steps.end(), [&](const plan::Step& its) {
            return its.step == step.step && its.self == step.self;
        });
    });
}

void report(const LoadedFunction& first, const LoadedFunction& second, const Instance& instance,
            Diagnostics& diagnostics) {
    const bool same_thread = first.thread == second.thread;
    const std::string where = same_thread ? "twice in each cycle of '" + first.thread->name + "'"
                                          : "in the threads '" + first.thread->name + "' and '" +
                                                second.thread->name + "' at the same time";
    diagnostics.add({same_thread ? Severity::warning : Severity::error,
                     "repeated-function",
                     "'" + second.name + "' runs the same code of '" + instance.name + "' as '" +
                         first.name + "': " + where,
                     {{second.added, "again"}, {first.added, "first"}},
                     {"keep one of them: delf " + second.name + " " + second.thread->name}});
}

}  // namespace

void check_repeated_steps(const Model& model, Diagnostics& diagnostics) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            const auto& functions = instance->functions;
            for (auto second = functions.begin(); second != functions.end(); ++second) {
                if (!is_cyclic(**second)) continue;
                const auto first = std::find_if(functions.begin(), second, [&](const auto* other) {
                    return is_cyclic(*other) && share_a_step(*other, **second);
                });
                if (first != second) report(**first, **second, *instance, diagnostics);
            }
        }
    }
}

}  // namespace hal
