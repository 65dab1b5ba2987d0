// SPDX-License-Identifier: MIT
#include "model/edit_log.hpp"

namespace hal {

void EditLog::undo() {
    while (!undo_.empty()) {
        undo_.back()();
        undo_.pop_back();
    }
    for (Replaced& one : replaced_) {
        one.undone = true;
    }
    pin_values.clear();
    signal_values.clear();
    inherited.clear();
    old_memory.clear();
    added_instances_.clear();
    structural_ = false;
}

bool EditLog::fail(Code code, Span at, std::string message, std::string label, std::string help) {
    diagnostics->error(code, at, std::move(message), std::move(label), std::move(help));
    return false;
}

bool EditLog::fail(Code code, Span at, std::string message, std::string label, Other other,
                   std::string help) {
    Diagnostic d{Severity::error, code, std::move(message), {{at, std::move(label)}}, {}};
    if (other.at.known()) {
        d.labels.push_back({other.at, std::move(other.label)});
    }
    if (!help.empty()) {
        d.help.push_back(std::move(help));
    }
    diagnostics->add(std::move(d));
    return false;
}

void EditLog::make_taken_safe() {
    for (const LoadedFunction* const function : taken_) {
        if (function->thread) continue;
        for (const Instance* const instance : function->instances) {
            if (model_.find_instance(instance->name) == instance) {
                make_safe(*instance);
            }
        }
    }
}

/// Outputs that no function computes any more take their declared safe values.
void EditLog::make_safe(const Instance& instance) {
    const bool any_runs = std::ranges::any_of(
        instance.functions,
        [](const LoadedFunction* function) { return function->thread != nullptr; });
    for (const auto& pin : instance.pins) {
        const bool is_computed = pin->function ? pin->function->thread != nullptr : any_runs;
        if (is_computed || !pin->safe_output()) continue;
        if (pin->signal) {
            signal_values.try_emplace(pin->signal, pin->safe);
        } else {
            pin_values.try_emplace(pin.get(), pin->safe);
        }
    }
}

}  // namespace hal
