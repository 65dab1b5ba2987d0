// SPDX-License-Identifier: MIT
// Undoing; components, instances and their pins and functions.
#include "model/edit.hpp"

#include <algorithm>
#include <iterator>

#include "model/own.hpp"
#include "text/quoting.hpp"

namespace hal {

void Edit::undo() {
    while (!undo_.empty()) {
        undo_.back()();
        undo_.pop_back();
    }
    pin_values.clear();
    signal_values.clear();
    inherited.clear();
    old_memory.clear();
    added_instances_.clear();
    structural_ = false;
}

bool Edit::name_free(std::string_view name, Span at, const char* what) {
    if (model_.find_pin(name)) {
        return fail("name-taken", at, "pin " + hal::quoted(name) + " already exists", what,
                    "choose other names for the new instances: names=…");
    }
    if (model_.find_signal(name)) {
        return fail("name-taken", at, "signal " + hal::quoted(name) + " already exists", what,
                    "signals and pins share one set of names; rename the signal or the instance");
    }
    return true;
}
LoadedComponent& Edit::add_component(std::string name, Span at) {
    auto owned = std::make_unique<LoadedComponent>();
    LoadedComponent* const made = owned.get();
    made->name = std::move(name);
    made->loaded = at;
    made->id = model_.next_component_id;
    model_.next_component_id += 3;
    make_room(model_.components);
    on_undo([this, made] {
        model_.component.erase(made->name);
        const auto leaving = owner(model_.components, made);
        // its instances still have to be destroyed
        removed_.components.push_back(std::move(*leaving));
        model_.components.erase(leaving);
    });
    model_.components.push_back(std::move(owned));
    model_.component.emplace(made->name, made);
    return *made;
}

void Edit::add_time_pins(LoadedFunction& function) {
    plan::FunctionTimes& times = *function.times;
    function.pins.push_back(own_pin(model_, function.name + ".time", HAL_TYPE_S32, HAL_DIR_OUT,
                                    times.time, "duration of the last sampled call", "ns"));
    function.pins.push_back(own_pin(model_, function.name + ".tmax", HAL_TYPE_S32, HAL_DIR_PARAM,
                                    times.tmax, "longest sampled call; set to 0 to reset", "ns"));
    function.pins.push_back(own_pin(model_, function.name + ".tmax-increased", HAL_TYPE_BIT,
                                    HAL_DIR_OUT, times.tmax_increased,
                                    "TRUE when the last sample was the longest so far", ""));
    for (const auto& pin : function.pins) {
        pin->function = &function;
    }
}

std::uint32_t Edit::take_number(LoadedComponent& component) {
    on_undo([&component] { --component.next_number; });
    return component.next_number++;
}

void Edit::note_arguments(LoadedComponent& component, std::string text, Load load) {
    make_room(component.arguments);
    make_room(component.loads);
    on_undo([&component] {
        component.arguments.pop_back();
        component.loads.pop_back();
    });
    component.arguments.push_back(std::move(text));
    component.loads.push_back(std::move(load));
}

void Edit::reorder(Thread& thread, std::vector<LoadedFunction*> functions) {
    on_undo([&thread, before = thread.functions] { thread.functions = before; });
    thread.functions = std::move(functions);
}

bool Edit::add_instance(LoadedComponent& component, std::unique_ptr<Instance>& owned,
                        std::vector<std::unique_ptr<LoadedFunction>> functions) {
    Instance* const made = owned.get();
    if (const Instance* const there = model_.find_instance(made->name)) {
        Diagnostic d{Severity::error,
                     "name-taken",
                     "instance " + hal::quoted(made->name) + " already exists (" +
                         there->component->name + ")",
                     {{made->loaded, "second time"}},
                     {}};
        if (there->loaded.known()) {
            d.labels.push_back({there->loaded, "loaded here"});
        }
        d.help.push_back("choose another name for the new instance: names=…");
        diagnostics->add(std::move(d));
        return false;
    }
    if (!names_free(*made, made->pins, functions)) return false;
    make_room(component.instances);
    make_room(component.functions, functions.size());
    make_room(added_instances_);
    const auto functions_before = component.functions.size();
    on_undo([this, made, functions_before] {
        LoadedComponent& of = *made->component;
        withdraw_functions(of, functions_before);
        for (const auto& pin : made->pins) {
            model_.leave(*pin);
        }
        model_.instance.erase(made->name);
        // rolled back in reverse order, so it is the last
        removed_.instances.push_back(std::move(of.instances.back()));
        of.instances.pop_back();
    });
    component.instances.push_back(std::move(owned));
    std::move(functions.begin(), functions.end(), std::back_inserter(component.functions));
    added_instances_.push_back(made);
    if (component.process == 0) {
        structural_ = true;  // no thread runs a program
    }
    model_.instance.emplace(made->name, made);
    for (const auto& pin : made->pins) {
        model_.enter(*pin);
    }
    enter_functions(component, functions_before);
    return true;
}

bool Edit::names_free(const Instance& of, const std::vector<std::unique_ptr<Pin>>& pins,
                      const std::vector<std::unique_ptr<LoadedFunction>>& functions) {
    for (const auto& pin : pins) {
        if (!name_free(pin->name, of.loaded, "its pin") ||
            (!pin->alias.empty() &&
             !name_free(pin->alias, of.loaded, "a second name of its pin"))) {
            return false;
        }
    }
    for (const auto& function : functions) {
        if (model_.find_function(function->name)) {
            return fail("name-taken", of.loaded,
                        "function " + hal::quoted(function->name) + " already exists",
                        "its function", "choose another name for the new instance: names=…");
        }
    }
    for (const auto& function : functions) {
        for (const auto& pin : function->pins) {
            if (!name_free(pin->name, of.loaded, "a pin of its function")) return false;
        }
    }
    return true;
}

void Edit::enter_functions(LoadedComponent& component, std::size_t before) {
    for (std::size_t i = before; i < component.functions.size(); ++i) {
        model_.function.emplace(component.functions[i]->name, component.functions[i].get());
        for (const auto& pin : component.functions[i]->pins) {
            model_.pin.emplace(pin->name, pin.get());
        }
    }
}

void Edit::withdraw_functions(LoadedComponent& of, std::size_t before) {
    while (of.functions.size() > before) {
        for (const auto& pin : of.functions.back()->pins) {
            model_.pin.erase(pin->name);
        }
        model_.function.erase(of.functions.back()->name);
        removed_.functions.push_back(std::move(of.functions.back()));
        of.functions.pop_back();
    }
}

bool Edit::add_declared(Instance& instance, std::vector<std::unique_ptr<Pin>> pins,
                        std::vector<std::unique_ptr<LoadedFunction>> functions) {
    LoadedComponent& component = *instance.component;
    if (!names_free(instance, pins, functions)) return false;
    make_room(component.functions, functions.size());
    make_room(instance.functions, functions.size());
    const std::size_t before = component.functions.size();
    on_undo([this, &instance, &component, before, own = instance.functions.size()] {
        withdraw_functions(component, before);
        instance.functions.resize(own);
    });
    for (const auto& function : functions) {
        instance.functions.push_back(function.get());
    }
    std::move(functions.begin(), functions.end(), std::back_inserter(component.functions));
    enter_functions(component, before);
    return add_pins(instance, std::move(pins), instance.loaded);
}

bool Edit::add_pins(Instance& instance, std::vector<std::unique_ptr<Pin>> pins, Span at) {
    for (const auto& pin : pins) {
        if (!name_free(pin->name, at, "its pin")) return false;
    }
    make_room(instance.pins, pins.size());
    on_undo([this, &instance, before = instance.pins.size()] {
        for (; instance.pins.size() > before; instance.pins.pop_back()) {
            model_.leave(*instance.pins.back());
        }
    });
    std::move(pins.begin(), pins.end(), std::back_inserter(instance.pins));
    for (auto pin = instance.pins.end() - static_cast<std::ptrdiff_t>(pins.size());
         pin != instance.pins.end(); ++pin) {
        model_.enter(**pin);
    }
    return true;
}

void Edit::remove_pins(Instance& instance, const std::vector<Pin*>& pins) {
    const std::unordered_set<const Pin*> leaving(pins.begin(), pins.end());
    std::vector<std::ptrdiff_t> places;
    for (std::size_t i = 0; i < instance.pins.size(); ++i) {
        if (leaving.contains(instance.pins[i].get())) {
            places.push_back(static_cast<std::ptrdiff_t>(i));
        }
    }
    make_room(removed_.pins, places.size());
    on_undo([this, &instance, places] {
        // rolled back in reverse order, so they are the last
        const std::size_t before = removed_.pins.size() - places.size();
        for (std::size_t i = 0; i < places.size(); ++i) {
            Pin& pin = *removed_.pins[before + i];
            instance.pins.insert(instance.pins.begin() + places[i],
                                 std::move(removed_.pins[before + i]));
            model_.enter(pin);
        }
        removed_.pins.resize(before);
    });
    for (const std::ptrdiff_t place : places) {
        auto& pin = instance.pins[static_cast<std::size_t>(place)];
        model_.leave(*pin);
        removed_.pins.push_back(std::move(pin));
    }
    std::erase(instance.pins, nullptr);
}

void Edit::set_process(LoadedComponent& component, std::int64_t process) {
    on_undo([&component, before = component.process] { component.process = before; });
    component.process = process;
}

void Edit::extend_function(LoadedFunction& function, const plan::Step& step, Instance& instance) {
    make_room(function.steps);
    make_room(function.instances);
    on_undo([&function] {
        function.steps.pop_back();
        function.instances.pop_back();
    });
    function.steps.push_back(step);
    function.instances.push_back(&instance);
}

void Edit::remove_instance(Instance& leaving) {
    LoadedComponent& component = *leaving.component;
    for (const auto& pin : leaving.pins) {
        Signal* const written =
            pin->dir == HAL_DIR_OUT && (pin->flags & HAL_PIN_SAFE) ? pin->signal : nullptr;
        unlink(*pin);
        // what it drove goes to the declared safe value
        if (written) {
            signal_values[written] = pin->safe;
        }
    }
    // functions of its own go; shared ones lose its steps, and go with the last instance
    struct Gone {
        LoadedFunction* function;
        std::ptrdiff_t position;
    };
    struct Shrunk {
        LoadedFunction* function;
        std::vector<plan::Step> steps;
        std::vector<Instance*> instances;
    };
    std::vector<Gone> gone;
    auto shrunk = std::make_shared<std::vector<Shrunk>>();
    for (LoadedFunction* const function : leaving.functions) {
        if (function->shared && function->instances.size() > 1) {
            shrunk->push_back({function, function->steps, function->instances});
            continue;
        }
        take_from_thread(*function);
        for (const auto& pin : function->pins) {
            unlink(*pin);
        }
        gone.push_back(
            {function, owner(component.functions, function) - component.functions.begin()});
    }
    std::sort(gone.begin(), gone.end(),
              [](const Gone& a, const Gone& b) { return a.position < b.position; });
    const auto at = owner(component.instances, &leaving);
    make_room(removed_.instances);
    make_room(removed_.functions, gone.size());
    on_undo(
        [this, &leaving, &component, position = at - component.instances.begin(), gone, shrunk] {
        const auto back = owner(removed_.instances, &leaving);
        component.instances.insert(component.instances.begin() + position, std::move(*back));
        removed_.instances.erase(back);
        model_.instance.emplace(leaving.name, &leaving);
        for (const auto& pin : leaving.pins) {
            model_.enter(*pin);
        }
        for (const auto& [function, place] : gone) {
            const auto from = owner(removed_.functions, function);
            component.functions.insert(component.functions.begin() + place, std::move(*from));
            removed_.functions.erase(from);
            model_.function.emplace(function->name, function);
            for (const auto& pin : function->pins) {
                model_.enter(*pin);
            }
        }
        for (const auto& s : *shrunk) {
            s.function->steps = s.steps;
            s.function->instances = s.instances;
        }
    });
    for (const auto& pin : leaving.pins) {
        model_.leave(*pin);
    }
    model_.instance.erase(leaving.name);
    for (const auto& s : *shrunk) {
        for (std::size_t i = s.function->instances.size(); i-- > 0;) {
            if (s.function->instances[i] != &leaving) continue;
            s.function->instances.erase(s.function->instances.begin() +
                                        static_cast<std::ptrdiff_t>(i));
            s.function->steps.erase(s.function->steps.begin() + static_cast<std::ptrdiff_t>(i));
        }
    }
    for (auto it = gone.rbegin(); it != gone.rend(); ++it) {
        for (const auto& pin : it->function->pins) {
            model_.leave(*pin);
        }
        model_.function.erase(it->function->name);
        removed_.functions.push_back(
            std::move(component.functions[static_cast<std::size_t>(it->position)]));
        component.functions.erase(component.functions.begin() + it->position);
    }
    removed_.instances.push_back(std::move(*at));
    component.instances.erase(at);
    if (component.process == 0) {
        structural_ = true;  // of a program, only what its links were
    }
}

void Edit::remove_component(LoadedComponent& leaving) {
    while (!leaving.instances.empty()) {
        remove_instance(*leaving.instances.back());
    }
    const auto at = owner(model_.components, &leaving);
    make_room(removed_.components);
    on_undo([this, &leaving, position = at - model_.components.begin()] {
        const auto back = owner(removed_.components, &leaving);
        model_.components.insert(model_.components.begin() + position, std::move(*back));
        removed_.components.erase(back);
        model_.component.emplace(leaving.name, &leaving);
    });
    model_.component.erase(leaving.name);
    removed_.components.push_back(std::move(*at));
    model_.components.erase(at);
    if (leaving.process == 0) {
        structural_ = true;
    }
}

}  // namespace hal
