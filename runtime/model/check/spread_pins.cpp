// SPDX-License-Identifier: MIT
#include "model/check/check.hpp"

namespace hal {

void check_spread_pins(const Model& model, Diagnostics& diagnostics) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            const Pin* shared = nullptr;
            for (const auto& pin : instance->pins) {
                if (!pin->function) {
                    shared = shared ? shared : pin.get();
                }
            }
            if (!shared || is_loose(*shared)) continue;
            const LoadedFunction* first = nullptr;
            for (const LoadedFunction* function : instance->functions) {
                if (!function->thread) continue;
                if (!first) {
                    first = function;
                }
                if (function->thread == first->thread) continue;
                Diagnostic d{
                    Severity::error,
                    "spread-pins",
                    "functions of '" + instance->name + "' are in two threads, '" +
                        first->thread->name + "' and '" + function->thread->name +
                        "', but its pin '" + shared->name + "' belongs to all of them",
                    {{function->added, "in " + function->thread->name},
                     {first->added, "in " + first->thread->name}},
                    {"add both to one thread: addf " + function->name + " " + first->thread->name}};
                diagnostics.add(std::move(d));
                break;
            }
        }
    }
}

}  // namespace hal
