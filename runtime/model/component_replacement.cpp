// SPDX-License-Identifier: MIT
#include "model/component_replacement.hpp"

#include <algorithm>
#include <memory>
#include <string_view>
#include <unordered_map>

#include "model/state_handover.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

bool same_pin(const Pin& a, const Pin& b) { return a.type == b.type; }
bool same_function(const LoadedFunction&, const LoadedFunction&) { return true; }

template <class T, class... Member>
void swap_members(T& a, T& b, Member T::*... members) {
    (std::swap(a.*members, b.*members), ...);
}

/// The properties of a pin that may differ in a new version.
void swap_declarations(Pin& a, Pin& b) {
    swap_members(a, b, &Pin::dir, &Pin::flags, &Pin::doc, &Pin::unit, &Pin::initial, &Pin::safe,
                 &Pin::memory, &Pin::pointer, &Pin::function);
}
void swap_declarations(LoadedFunction& a, LoadedFunction& b) {
    swap_members(a, b, &LoadedFunction::doc, &LoadedFunction::steps, &LoadedFunction::row,
                 &LoadedFunction::instances, &LoadedFunction::shared, &LoadedFunction::halted);
}

void swap_contents(Instance& a, Instance& b) {
    swap_members(a, b, &Instance::memory, &Instance::storage, &Instance::blocks, &Instance::further,
                 &Instance::variables, &Instance::functions, &Instance::emergency,
                 &Instance::streams, &Instance::finite, &Instance::constructed, &Instance::started);
}
void swap_contents(LoadedComponent& a, LoadedComponent& b) {
    swap_members(a, b, &LoadedComponent::plugin, &LoadedComponent::library, &LoadedComponent::path,
                 &LoadedComponent::loads);
}

/// Replaces a pointer by what stands for it, if anything does.
template <class T>
void translate_one(T*& pointer, const std::unordered_map<const T*, T*>& to) {
    const auto found = to.find(pointer);
    if (found != to.end()) {
        pointer = found->second;
    }
}

}  // namespace

template <class T>
std::vector<ComponentReplacement::Pair> ComponentReplacement::pairs_of(
    const std::vector<std::unique_ptr<T>>& old_row,
    const std::vector<std::unique_ptr<T>>& fresh_row, bool (*same)(const T&, const T&)) {
    std::unordered_map<std::string_view, std::size_t> at;
    for (std::size_t i = 0; i < old_row.size(); ++i) {
        at.emplace(old_row[i]->name, i);
    }
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < fresh_row.size(); ++i) {
        if (const auto found = at.find(fresh_row[i]->name);
            found != at.end() && same(*old_row[found->second], *fresh_row[i])) {
            pairs.push_back({i, found->second});
        }
    }
    return pairs;
}

/// The rows change places, but objects that are kept stay in the model's row, in the new order.
template <class T>
void ComponentReplacement::exchange(std::vector<std::unique_ptr<T>>& model_row,
                                    std::vector<std::unique_ptr<T>>& other,
                                    const std::vector<Pair>& pairs) {
    model_row.swap(other);
    for (const Pair& pair : pairs) {
        model_row[pair.fresh].swap(other[pair.kept]);
    }
}

template <class T>
void ComponentReplacement::exchange_back(std::vector<std::unique_ptr<T>>& model_row,
                                         std::vector<std::unique_ptr<T>>& other,
                                         const std::vector<Pair>& pairs) {
    for (const Pair& pair : pairs) {
        model_row[pair.fresh].swap(other[pair.kept]);
    }
    model_row.swap(other);
}

ComponentReplacement::ComponentReplacement(Model& model, LoadedComponent& component,
                                           LoadedComponent& fresh)
    : model_(model),
      component_(component),
      other_(fresh),
      functions_(pairs_of<LoadedFunction>(component.functions, fresh.functions, same_function)) {
    for (std::size_t i = 0; i < component.instances.size(); ++i) {
        Instance& kept = *component.instances[i];
        instances_.push_back({&kept, fresh.instances[i].get(),
                              pairs_of<Pin>(kept.pins, fresh.instances[i]->pins, same_pin)});
    }
}

void ComponentReplacement::exchange_kept_declarations() const {
    for (const InstancePair& pair : instances_) {
        for (const Pair& pin : pair.pins) {
            swap_declarations(*pair.kept->pins[pin.fresh], *pair.fresh->pins[pin.kept]);
        }
    }
    for (const Pair& pair : functions_) {
        swap_declarations(*component_.functions[pair.fresh], *other_.functions[pair.kept]);
    }
}

void ComponentReplacement::run() const {
    for (const Pin* const pin : gone_pins_) {
        model_.leave(*pin);
    }
    for (const LoadedFunction* const function : gone_functions_) {
        model_.function.erase(function->name);
    }
    swap_contents(component_, other_);
    exchange(component_.functions, other_.functions, functions_);
    for (const InstancePair& pair : instances_) {
        swap_contents(*pair.kept, *pair.fresh);
        exchange(pair.kept->pins, pair.fresh->pins, pair.pins);
    }
    exchange_kept_declarations();
    for (LoadedFunction* const function : new_functions_) {
        model_.function.emplace(function->name, function);
    }
    for (Pin* const pin : new_pins_) {
        model_.enter(*pin);
    }
}

void ComponentReplacement::back() const {
    for (const Pin* const pin : new_pins_) {
        model_.leave(*pin);
    }
    for (const LoadedFunction* const function : new_functions_) {
        model_.function.erase(function->name);
    }
    exchange_kept_declarations();
    for (const InstancePair& pair : instances_) {
        exchange_back(pair.kept->pins, pair.fresh->pins, pair.pins);
        swap_contents(*pair.kept, *pair.fresh);
    }
    exchange_back(component_.functions, other_.functions, functions_);
    swap_contents(component_, other_);
    for (LoadedFunction* const function : gone_functions_) {
        model_.function.emplace(function->name, function);
    }
    for (Pin* const pin : gone_pins_) {
        model_.enter(*pin);
    }
}

void ComponentReplacement::translate() {
    std::unordered_map<const LoadedFunction*, LoadedFunction*> function_of;
    std::unordered_map<const Instance*, Instance*> instance_of;
    for (const Pair& pair : functions_) {
        function_of[other_.functions[pair.fresh].get()] = component_.functions[pair.kept].get();
    }
    for (const InstancePair& pair : instances_) {
        instance_of[pair.fresh] = pair.kept;
    }
    for (const auto& function : other_.functions) {
        for (Instance*& instance : function->instances) {
            instance = instance_of.at(instance);
        }
        function->component = &component_;
    }
    for (const InstancePair& pair : instances_) {
        std::unordered_map<const Pin*, Pin*> pin_of;
        for (const Pair& pin : pair.pins) {
            pin_of[pair.fresh->pins[pin.fresh].get()] = pair.kept->pins[pin.kept].get();
        }
        for (const auto& pin : pair.fresh->pins) {
            pin->instance = pair.kept;
            translate_one(pin->function, function_of);
        }
        for (Pin*& pin : pair.fresh->finite) {
            translate_one(pin, pin_of);
        }
        for (LoadedFunction*& function : pair.fresh->functions) {
            translate_one(function, function_of);
        }
    }
}

void ComponentReplacement::carry_values(EditLog& edit) {
    for (const InstancePair& pair : instances_) {
        for (const Pair& pin : pair.pins) {
            Pin& kept = *pair.kept->pins[pin.kept];
            // a second reload in one edit: the threads still know the first
            if (kept.home) {
                edit.old_memory.emplace(&kept, kept.memory);
            } else if (kept.type != HAL_TYPE_PORT) {
                pair.fresh->pins[pin.fresh]->memory->own = *kept.memory->slot;
            }
        }
    }
}

bool ComponentReplacement::removes(const Pin& pin) const {
    return std::ranges::find(gone_pins_, &pin) != gone_pins_.end();
}

void ComponentReplacement::conflict(const EditLog& edit, Span at, std::string message, Span other,
                                    const char* label, std::string help) const {
    Diagnostic d{Severity::error,
                 "reload-conflict",
                 std::move(message),
                 {{at, "the new version"}},
                 {std::move(help)}};
    if (other.known()) {
        d.labels.push_back({other, label});
    }
    edit.diagnostics->add(std::move(d));
}

void ComponentReplacement::vanish(Pin& pin, const std::string& why, const EditLog& edit, Span at) {
    gone_pins_.push_back(&pin);
    if (pin.signal) {
        return conflict(edit, at,
                        "pin " + hal::quoted(pin.name) + " " + why +
                            " in the new version, but is linked to signal " +
                            hal::quoted(pin.signal->name),
                        pin.linked_at, "linked here", "unlink it first: unlinkp " + pin.name);
    }
    const bool settable =
        pin.dir != HAL_DIR_OUT && !pin.read_only() && pin.type != HAL_TYPE_PORT && pin.instance;
    if (settable &&
        __atomic_load_n(&edit.present(pin).slot->raw, __ATOMIC_RELAXED) != pin.initial.raw) {
        edit.diagnostics->warning("reload-dropped", at,
                                  (pin.dir == HAL_DIR_PARAM ? "parameter " : "pin ") +
                                      hal::quoted(pin.name) + " " + why +
                                      " in the new version: its value is lost",
                                  "", "change any setp of it in the netlist");
    }
}

/// Reports state of the old version that has no counterpart in the new one.
void ComponentReplacement::compare_variables(const InstancePair& pair, const EditLog& edit,
                                             Span at) {
    for (const Instance::Variable* const lost : lost_variables(*pair.kept, *pair.fresh)) {
        edit.diagnostics->warning(
            "reload-dropped", at,
            "variable " + hal::quoted(lost->name) + " of " + hal::quoted(pair.kept->name) +
                " is missing or has another type in the new version: its value is lost",
            "", "stop the machine before such a reload");
    }
}

void ComponentReplacement::compare_pins(const InstancePair& pair, const EditLog& edit, Span at) {
    std::vector<const Pin*> fresh_of(pair.kept->pins.size(), nullptr);
    std::vector<bool> is_new(pair.fresh->pins.size(), true);
    for (const Pair& pin : pair.pins) {
        fresh_of[pin.kept] = pair.fresh->pins[pin.fresh].get();
        is_new[pin.fresh] = false;
    }
    for (std::size_t i = 0; i < fresh_of.size(); ++i) {
        Pin& pin = *pair.kept->pins[i];
        if (const Pin* const fresh = fresh_of[i]) {
            if (!pin.signal || fresh->dir == pin.dir) continue;
            conflict(edit, at,
                     "pin " + hal::quoted(pin.name) + " has direction " + name(fresh->dir) +
                         " in the new version, not " + name(pin.dir) +
                         ", and is linked to signal " + hal::quoted(pin.signal->name),
                     pin.linked_at, "linked here", "unlink it first: unlinkp " + pin.name);
            continue;
        }
        const auto other = std::ranges::find_if(
            pair.fresh->pins, [&](const auto& one) { return one->name == pin.name; });
        const bool missing = other == pair.fresh->pins.end();
        vanish(pin, missing ? "is missing" : std::string("has type ") + name((*other)->type), edit,
               at);
    }
    for (std::size_t i = 0; i < is_new.size(); ++i) {
        if (is_new[i]) {
            new_pins_.push_back(pair.fresh->pins[i].get());
        }
    }
}

void ComponentReplacement::compare_functions(const EditLog& edit, Span at) {
    std::vector<bool> stays(component_.functions.size(), false);
    std::vector<bool> is_new(other_.functions.size(), true);
    for (const Pair& pair : functions_) {
        stays[pair.kept] = true;
        is_new[pair.fresh] = false;
    }
    for (std::size_t i = 0; i < stays.size(); ++i) {
        LoadedFunction& function = *component_.functions[i];
        if (stays[i]) continue;
        gone_functions_.push_back(&function);
        if (function.thread) {
            conflict(edit, at,
                     "function " + hal::quoted(function.name) +
                         " is missing in the new version, but is in thread " +
                         hal::quoted(function.thread->name),
                     function.added, "added here",
                     "remove it first: delf " + function.name + " " + function.thread->name);
        }
        for (const auto& pin : function.pins) {
            vanish(*pin, "is missing", edit, at);
        }
    }
    for (std::size_t i = 0; i < is_new.size(); ++i) {
        LoadedFunction& function = *other_.functions[i];
        if (!is_new[i]) continue;
        new_functions_.push_back(&function);
        for (const auto& pin : function.pins) {
            new_pins_.push_back(pin.get());
        }
    }
}

void ComponentReplacement::compare(const EditLog& edit, Span at) {
    for (const InstancePair& pair : instances_) {
        compare_pins(pair, edit, at);
        compare_variables(pair, edit, at);
    }
    compare_functions(edit, at);
}

}  // namespace hal
