// SPDX-License-Identifier: MIT
// `reload`: a component's code and instances are exchanged, what the netlist made of them stays.
//
// Pins and functions that the old and the new version both declare remain the same objects, so that
// signals, threads, aliases, times and fault records need not know. Everything is exchanged by
// swapping, so that undoing is the same swaps backwards.
#include "model/edit.hpp"

#include <algorithm>
#include <memory>

#include "text/quoting.hpp"

namespace hal {
namespace {

/// An object the model keeps (at `kept` of the old row) and its declaration in the new version (at
/// `fresh` of the new row).
struct Pair {
    std::size_t fresh, kept;
};

template <class T>
std::vector<Pair> pairs_of(const std::vector<std::unique_ptr<T>>& old_row,
                           const std::vector<std::unique_ptr<T>>& fresh_row,
                           bool (*same)(const T&, const T&)) {
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

bool same_pin(const Pin& a, const Pin& b) { return a.type == b.type; }
bool same_function(const LoadedFunction&, const LoadedFunction&) { return true; }

/// The rows change places, but objects that are kept stay in the model's row, in the new order.
template <class T>
void exchange(std::vector<std::unique_ptr<T>>& model_row, std::vector<std::unique_ptr<T>>& other,
              const std::vector<Pair>& pairs) {
    model_row.swap(other);
    for (const Pair& pair : pairs) {
        model_row[pair.fresh].swap(other[pair.kept]);
    }
}
template <class T>
void exchange_back(std::vector<std::unique_ptr<T>>& model_row,
                   std::vector<std::unique_ptr<T>>& other, const std::vector<Pair>& pairs) {
    for (const Pair& pair : pairs) {
        model_row[pair.fresh].swap(other[pair.kept]);
    }
    model_row.swap(other);
}

/// The properties of a pin that may differ in a new version.
void swap_declarations(Pin& a, Pin& b) {
    std::swap(a.dir, b.dir);
    std::swap(a.flags, b.flags);
    std::swap(a.doc, b.doc);
    std::swap(a.unit, b.unit);
    std::swap(a.initial, b.initial);
    std::swap(a.safe, b.safe);
    std::swap(a.memory, b.memory);
    std::swap(a.pointer, b.pointer);
    std::swap(a.function, b.function);
}
void swap_declarations(LoadedFunction& a, LoadedFunction& b) {
    std::swap(a.doc, b.doc);
    std::swap(a.steps, b.steps);
    std::swap(a.row, b.row);
    std::swap(a.instances, b.instances);
    std::swap(a.shared, b.shared);
    std::swap(a.halted, b.halted);
}

void swap_contents(Instance& a, Instance& b) {
    std::swap(a.memory, b.memory);
    std::swap(a.storage, b.storage);
    std::swap(a.blocks, b.blocks);
    std::swap(a.further, b.further);
    std::swap(a.functions, b.functions);
    std::swap(a.emergency, b.emergency);
    std::swap(a.streams, b.streams);
    std::swap(a.finite, b.finite);
    std::swap(a.constructed, b.constructed);
    std::swap(a.started, b.started);
}
void swap_contents(LoadedComponent& a, LoadedComponent& b) {
    std::swap(a.plugin, b.plugin);
    std::swap(a.library, b.library);
    std::swap(a.path, b.path);
}

struct InstancePair {
    Instance *kept, *fresh;
    std::vector<Pair> pins;
};

/// All state of one replacement, so that it can be applied and rolled back.
struct Replacement {
    Model& model;
    LoadedComponent &component, &other;
    std::vector<InstancePair> instances;
    std::vector<Pair> functions;
    std::vector<Pin*> gone_pins, new_pins;
    std::vector<LoadedFunction*> gone_functions, new_functions;

    void exchange_kept_declarations() const {
        for (const InstancePair& pair : instances) {
            for (const Pair& pin : pair.pins) {
                swap_declarations(*pair.kept->pins[pin.fresh], *pair.fresh->pins[pin.kept]);
            }
        }
        for (const Pair& pair : functions) {
            swap_declarations(*component.functions[pair.fresh], *other.functions[pair.kept]);
        }
    }
    void run() const {
        for (const Pin* const pin : gone_pins) {
            model.leave(*pin);
        }
        for (const LoadedFunction* const function : gone_functions) {
            model.function.erase(function->name);
        }
        swap_contents(component, other);
        exchange(component.functions, other.functions, functions);
        for (const InstancePair& pair : instances) {
            swap_contents(*pair.kept, *pair.fresh);
            exchange(pair.kept->pins, pair.fresh->pins, pair.pins);
        }
        exchange_kept_declarations();
        for (LoadedFunction* const function : new_functions) {
            model.function.emplace(function->name, function);
        }
        for (Pin* const pin : new_pins) {
            model.enter(*pin);
        }
    }
    void back() const {
        for (const Pin* const pin : new_pins) {
            model.leave(*pin);
        }
        for (const LoadedFunction* const function : new_functions) {
            model.function.erase(function->name);
        }
        exchange_kept_declarations();
        for (const InstancePair& pair : instances) {
            exchange_back(pair.kept->pins, pair.fresh->pins, pair.pins);
            swap_contents(*pair.kept, *pair.fresh);
        }
        exchange_back(component.functions, other.functions, functions);
        swap_contents(component, other);
        for (LoadedFunction* const function : gone_functions) {
            model.function.emplace(function->name, function);
        }
        for (Pin* const pin : gone_pins) {
            model.enter(*pin);
        }
    }
};

/// The new version's rows speak of its own objects; from now on they speak of those the model will
/// have.
void translate(const Replacement& r) {
    std::unordered_map<const LoadedFunction*, LoadedFunction*> function_of;
    std::unordered_map<const Instance*, Instance*> instance_of;
    for (const Pair& pair : r.functions) {
        function_of[r.other.functions[pair.fresh].get()] = r.component.functions[pair.kept].get();
    }
    for (const InstancePair& pair : r.instances) {
        instance_of[pair.fresh] = pair.kept;
    }
    for (const auto& function : r.other.functions) {
        for (Instance*& instance : function->instances) {
            instance = instance_of.at(instance);
        }
        function->component = &r.component;
    }
    for (const InstancePair& pair : r.instances) {
        std::unordered_map<const Pin*, Pin*> pin_of;
        for (const Pair& pin : pair.pins) {
            pin_of[pair.fresh->pins[pin.fresh].get()] = pair.kept->pins[pin.kept].get();
        }
        for (const auto& pin : pair.fresh->pins) {
            pin->instance = pair.kept;
            if (const auto kept = function_of.find(pin->function); kept != function_of.end()) {
                pin->function = kept->second;
            }
        }
        for (Pin*& pin : pair.fresh->finite) {
            if (const auto kept = pin_of.find(pin); kept != pin_of.end()) {
                pin = kept->second;
            }
        }
        for (LoadedFunction*& function : pair.fresh->functions) {
            if (const auto kept = function_of.find(function); kept != function_of.end()) {
                function = kept->second;
            }
        }
    }
}

/// Finds what stays, goes and comes, and reports what the machine uses and the new version does not
/// have.
struct Comparison {
    const Edit& edit;
    Replacement& r;
    const Span at;

    void conflict(std::string message, Span other, const char* label, std::string help) const {
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
    void vanished(Pin& pin, const char* why) const {
        r.gone_pins.push_back(&pin);
        if (pin.signal) {
            return conflict("pin " + hal::quoted(pin.name) + " " + why +
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
    void compare_pins(const InstancePair& pair) const {
        std::vector<const Pin*> fresh_of(pair.kept->pins.size(), nullptr);
        std::vector<bool> is_new(pair.fresh->pins.size(), true);
        for (const Pair& pin : pair.pins) {
            fresh_of[pin.kept] = pair.fresh->pins[pin.fresh].get();
            is_new[pin.fresh] = false;
        }
        for (std::size_t i = 0; i < fresh_of.size(); ++i) {
            Pin& pin = *pair.kept->pins[i];
            if (fresh_of[i]) {
                if (pin.signal && fresh_of[i]->dir != pin.dir) {
                    conflict("pin " + hal::quoted(pin.name) + " has direction " +
                                 name(fresh_of[i]->dir) + " in the new version, not " +
                                 name(pin.dir) + ", and is linked to signal " +
                                 hal::quoted(pin.signal->name),
                             pin.linked_at, "linked here", "unlink it first: unlinkp " + pin.name);
                }
                continue;
            }
            const auto other = std::find_if(pair.fresh->pins.begin(), pair.fresh->pins.end(),
                                            [&](const auto& one) { return one->name == pin.name; });
            vanished(pin, other == pair.fresh->pins.end()
                              ? "is missing"
                              : (std::string("has type ") + name((*other)->type)).c_str());
        }
        for (std::size_t i = 0; i < is_new.size(); ++i) {
            if (is_new[i]) {
                r.new_pins.push_back(pair.fresh->pins[i].get());
            }
        }
    }
    void compare_functions() const {
        std::vector<bool> stays(r.component.functions.size(), false),
            is_new(r.other.functions.size(), true);
        for (const Pair& pair : r.functions) {
            stays[pair.kept] = true;
            is_new[pair.fresh] = false;
        }
        for (std::size_t i = 0; i < stays.size(); ++i) {
            LoadedFunction& function = *r.component.functions[i];
            if (stays[i]) continue;
            r.gone_functions.push_back(&function);
            if (function.thread) {
                conflict("function " + hal::quoted(function.name) +
                             " is missing in the new version, but is in thread " +
                             hal::quoted(function.thread->name),
                         function.added, "added here",
                         "remove it first: delf " + function.name + " " + function.thread->name);
            }
            for (const auto& pin : function.pins) {
                vanished(*pin, "is missing");
            }
        }
        for (std::size_t i = 0; i < is_new.size(); ++i) {
            LoadedFunction& function = *r.other.functions[i];
            if (!is_new[i]) continue;
            r.new_functions.push_back(&function);
            for (const auto& pin : function.pins) {
                r.new_pins.push_back(pin.get());
            }
        }
    }
};

}  // namespace

bool Edit::replace(LoadedComponent& component, std::unique_ptr<LoadedComponent>& owned, Span at) {
    LoadedComponent& fresh = *owned;
    const std::size_t errors_before = diagnostics->errors();
    auto r = std::make_shared<Replacement>(
        Replacement{model_, component, fresh, {}, {}, {}, {}, {}, {}});
    r->functions = pairs_of<LoadedFunction>(component.functions, fresh.functions, same_function);
    for (std::size_t i = 0; i < component.instances.size(); ++i) {
        Instance& kept = *component.instances[i];
        r->instances.push_back({&kept, fresh.instances[i].get(),
                                pairs_of<Pin>(kept.pins, fresh.instances[i]->pins, same_pin)});
    }
    const Comparison comparison{*this, *r, at};
    for (const InstancePair& pair : r->instances) {
        comparison.compare_pins(pair);
    }
    comparison.compare_functions();
    for (const LoadedFunction* const function : r->new_functions) {
        if (model_.find_function(function->name)) {
            fail("name-taken", at, "function " + hal::quoted(function->name) + " already exists",
                 "its function");
        }
    }
    for (const Pin* const pin : r->new_pins) {
        const Pin* const there = model_.find_pin(pin->name);
        const bool goes =
            there &&
            std::find(r->gone_pins.begin(), r->gone_pins.end(), there) != r->gone_pins.end() &&
            there->name == pin->name;
        if (!goes) {
            name_free(pin->name, at, "its pin");
        }
    }
    if (diagnostics->errors() > errors_before) return false;

    // nothing below can fail
    translate(*r);
    for (const InstancePair& pair : r->instances) {
        for (const Pair& pin : pair.pins) {
            Pin& kept = *pair.kept->pins[pin.kept];
            hal_pin& memory = *pair.fresh->pins[pin.fresh]->memory;
            // a second reload in one edit: the threads still know the first
            if (kept.home) {
                old_memory.emplace(&kept, kept.memory);
            } else if (kept.type != HAL_TYPE_PORT) {
                memory.own = *kept.memory->slot;
            }
        }
    }
    auto done = std::make_shared<bool>(false);
    on_undo([r, done] {
        if (*done) {
            r->back();
        }
    });
    replaced_.push_back({&component, std::move(owned), false});
    *done = true;
    r->run();
    structural_ = true;
    return true;
}

}  // namespace hal
