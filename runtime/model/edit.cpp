// SPDX-License-Identifier: MIT
// Components, instances, functions and threads.
#include "model/edit.hpp"

#include <algorithm>
#include <iterator>

#include "base/words.hpp"

namespace hal {
namespace {

template <class T>
auto owner(std::vector<std::unique_ptr<T>>& all, const T* one) {
    return std::find_if(all.begin(), all.end(), [&](const auto& candidate) { return candidate.get() == one; });
}

std::unique_ptr<Pin> own_pin(Model& model, std::string name, hal_type type, hal_dir dir, hal_pin& memory, const char* doc,
                             const char* unit) {
    auto pin = std::make_unique<Pin>();
    pin->name = std::move(name);
    pin->type = type;
    pin->dir = dir;
    pin->doc = doc;
    pin->unit = unit;
    pin->memory = &memory;
    pin->id = model.next_id++;
    memory.slot = &memory.own;
    return pin;
}

void enter(Model& model, Pin& pin) {
    model.pin.emplace(pin.name, &pin);
    if (!pin.alias.empty()) model.pin.emplace(pin.alias, &pin);
}

void leave(Model& model, const Pin& pin) {
    model.pin.erase(pin.name);
    if (!pin.alias.empty()) model.pin.erase(pin.alias);
}

}  // namespace

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
    if (model_.find_pin(name))
        return fail("name-taken", at, "there is a pin " + quoted(name) + " already", what, "give the new instances other names: names=…");
    if (model_.find_signal(name))
        return fail("name-taken", at, "there is a signal " + quoted(name) + " already", what,
                    "signals and pins share their names; rename the signal or the instance");
    return true;
}

Thread* Edit::add_thread(Word name, const ThreadOptions& options) {
    if (const Thread* const there = model_.find_thread(name.text)) {
        Diagnostic d{
            Severity::error, "name-taken", "there is a thread " + quoted(name.text) + " already", {{name.span, "second time"}}, {}};
        if (there->made.known()) d.labels.push_back({there->made, "made here"});
        diagnostics->add(std::move(d));
        return nullptr;
    }
    for (const char* pin : {".time", ".tmax", ".tmax-increased", ".threadbeat", ".missed", ".wakeup"})
        if (!name_free(std::string(name.text) + pin, name.span, "this thread's pin")) return nullptr;
    auto owned = std::make_unique<Thread>();
    Thread* const made = owned.get();
    made->name = name.text;
    made->options = options;
    made->made = name.span;
    const auto add = [&](const char* suffix, hal_type type, hal_dir dir, hal_pin& memory, const char* doc, const char* unit) {
        auto pin = own_pin(model_, made->name + suffix, type, dir, memory, doc, unit);
        pin->of_thread = made;
        made->pins.push_back(std::move(pin));
    };
    add(".time", HAL_TYPE_S32, HAL_DIR_OUT, made->time, "execution time of the last cycle", "ns");
    add(".tmax", HAL_TYPE_S32, HAL_DIR_PARAM, made->tmax, "longest execution time; set it to 0 to start again", "ns");
    add(".tmax-increased", HAL_TYPE_BIT, HAL_DIR_OUT, made->tmax_increased, "the last cycle was the longest so far", "");
    add(".threadbeat", HAL_TYPE_U32, HAL_DIR_OUT, made->beat, "counts cycles", "");
    add(".missed", HAL_TYPE_U32, HAL_DIR_OUT, made->missed, "periods that passed unserved", "");
    add(".wakeup", HAL_TYPE_S32, HAL_DIR_OUT, made->wakeup, "how late the last cycle began", "ns");
    const auto place = std::upper_bound(model_.threads.begin(), model_.threads.end(), options.period_ns,
                                        [](std::int64_t period, const auto& other) { return period < other->options.period_ns; });
    const auto position = place - model_.threads.begin();
    make_room(model_.threads);
    on_undo([this, made] {
        for (const auto& pin : made->pins) model_.pin.erase(pin->name);
        model_.thread.erase(made->name);
        const auto at = owner(model_.threads, made);
        removed_.threads.push_back(std::move(*at));  // it may be running
        model_.threads.erase(at);
    });
    model_.threads.insert(model_.threads.begin() + position, std::move(owned));
    structural_ = true;
    model_.thread.emplace(made->name, made);
    for (const auto& pin : made->pins) model_.pin.emplace(pin->name, pin.get());
    return made;
}

bool Edit::remove_thread(Word name) {
    Thread* const leaving = thread(name);
    if (!leaving) return false;
    while (!leaving->functions.empty()) take_from_thread(*leaving->functions.back());
    while (!leaving->init.empty()) take_from_thread(*leaving->init.back());
    for (const auto& pin : leaving->pins) unlink(*pin);
    const auto at = owner(model_.threads, leaving);
    make_room(removed_.threads);
    on_undo([this, leaving, position = at - model_.threads.begin()] {
        const auto back = owner(removed_.threads, leaving);
        model_.threads.insert(model_.threads.begin() + position, std::move(*back));
        removed_.threads.erase(back);
        model_.thread.emplace(leaving->name, leaving);
        for (const auto& pin : leaving->pins) enter(model_, *pin);
    });
    for (const auto& pin : leaving->pins) leave(model_, *pin);
    model_.thread.erase(leaving->name);
    removed_.threads.push_back(std::move(*at));
    model_.threads.erase(at);
    structural_ = true;
    return true;
}

bool Edit::add_function(Word function_name, Word thread_name, int position, Span position_at, bool init) {
    LoadedFunction* const target = function(function_name);
    Thread* const to = thread(thread_name);
    if (!target || !to) return false;
    if (target->thread) {
        Diagnostic d{Severity::error,
                     "function-in-thread",
                     "function " + quoted(target->name) + " is in thread " + quoted(target->thread->name) + " already",
                     {{function_name.span, "second time"}},
                     {}};
        if (target->added.known()) d.labels.push_back({target->added, "added here"});
        d.help.push_back("a function runs in one thread; take it out first: delf " + target->name + " " + target->thread->name);
        diagnostics->add(std::move(d));
        return false;
    }
    if (init && to->init_done)
        return fail("init-done", function_name.span,
                    "thread " + quoted(to->name) + " has made its first pass; functions of initf would never run", "too late",
                    "add it before start, or with addf");
    auto& row = init ? to->init : to->functions;
    const auto size = static_cast<int>(row.size());
    if (position == 0)
        return fail("bad-position", position_at, "position 0 means nothing: 1 is the first place, -1 the last", "",
                    "leave it out to append");
    const int index = position > 0 ? position - 1 : size + 1 + position;
    if (index < 0 || index > size)
        return fail(
            "bad-position", position_at,
            "thread " + quoted(to->name) + " has " + std::to_string(size) + (size == 1 ? " function" : " functions") +
                ", so there is no position " + std::to_string(position),
            "",
            "positions 1 to " + std::to_string(size + 1) + " count from the front, -1 to -" + std::to_string(size + 1) + " from the end");
    make_room(row);
    on_undo([target, to, init, before = target->added, init_before = target->init] {
        auto& functions = init ? to->init : to->functions;
        functions.erase(std::find(functions.begin(), functions.end(), target));
        target->thread = nullptr;
        target->init = init_before;
        target->added = before;
    });
    row.insert(row.begin() + index, target);
    target->thread = to;
    target->init = init;
    target->added = function_name.span;
    structural_ = true;
    return true;
}

bool Edit::remove_function(Word function_name, Word thread_name) {
    LoadedFunction* const target = function(function_name);
    Thread* const from = thread(thread_name);
    if (!target || !from) return false;
    if (target->thread != from)
        return fail("not-in-thread", function_name.span, "function " + quoted(target->name) + " is not in thread " + quoted(from->name), "",
                    target->thread ? "it is in thread " + target->thread->name : "it is in no thread");
    take_from_thread(*target);
    return true;
}

void Edit::take_from_thread(LoadedFunction& function) {
    Thread* const from = function.thread;
    if (!from) return;
    const bool init = function.init;
    auto& row = init ? from->init : from->functions;
    const auto at = std::find(row.begin(), row.end(), &function);
    on_undo([&function, from, init, position = at - row.begin()] {
        auto& functions = init ? from->init : from->functions;
        functions.insert(functions.begin() + position, &function);
        function.thread = from;
        function.init = init;
    });
    row.erase(at);
    function.thread = nullptr;
    structural_ = true;
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
        removed_.components.push_back(std::move(*leaving));  // its instances still have to be destroyed
        model_.components.erase(leaving);
    });
    model_.components.push_back(std::move(owned));
    model_.component.emplace(made->name, made);
    return *made;
}

void Edit::add_time_pins(LoadedFunction& function) {
    plan::FunctionTimes& times = *function.times;
    function.pins.push_back(
        own_pin(model_, function.name + ".time", HAL_TYPE_S32, HAL_DIR_OUT, times.time, "duration of the last sampled call", "ns"));
    function.pins.push_back(own_pin(model_, function.name + ".tmax", HAL_TYPE_S32, HAL_DIR_PARAM, times.tmax,
                                    "longest sampled call; set it to 0 to start again", "ns"));
    function.pins.push_back(own_pin(model_, function.name + ".tmax-increased", HAL_TYPE_BIT, HAL_DIR_OUT, times.tmax_increased,
                                    "the last sample was the longest so far", ""));
    for (const auto& pin : function.pins) pin->function = &function;
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
                     "there is an instance " + quoted(made->name) + " already (" + there->component->name + ")",
                     {{made->loaded, "second time"}},
                     {}};
        if (there->loaded.known()) d.labels.push_back({there->loaded, "loaded here"});
        d.help.push_back("give the new one another name: names=…");
        diagnostics->add(std::move(d));
        return false;
    }
    for (const auto& pin : made->pins)
        if (!name_free(pin->name, made->loaded, "its pin")) return false;
    for (const auto& function : functions)
        if (model_.find_function(function->name))
            return fail("name-taken", made->loaded, "there is a function " + quoted(function->name) + " already", "its function",
                        "give the new instance another name: names=…");
    for (const auto& function : functions)
        for (const auto& pin : function->pins)
            if (!name_free(pin->name, made->loaded, "a pin of its function")) return false;

    make_room(component.instances);
    make_room(component.functions, functions.size());
    make_room(added_instances_);
    const auto functions_before = component.functions.size();
    on_undo([this, made, functions_before] {
        LoadedComponent& of = *made->component;
        while (of.functions.size() > functions_before) {
            for (const auto& pin : of.functions.back()->pins) model_.pin.erase(pin->name);
            model_.function.erase(of.functions.back()->name);
            removed_.functions.push_back(std::move(of.functions.back()));
            of.functions.pop_back();
        }
        for (const auto& pin : made->pins) model_.pin.erase(pin->name);
        model_.instance.erase(made->name);
        removed_.instances.push_back(std::move(of.instances.back()));  // undone last first, so it is the last
        of.instances.pop_back();
    });
    component.instances.push_back(std::move(owned));
    std::move(functions.begin(), functions.end(), std::back_inserter(component.functions));
    added_instances_.push_back(made);
    structural_ = true;
    model_.instance.emplace(made->name, made);
    for (const auto& pin : made->pins) model_.pin.emplace(pin->name, pin.get());
    for (auto function = component.functions.begin() + static_cast<std::ptrdiff_t>(functions_before); function != component.functions.end();
         ++function) {
        model_.function.emplace((*function)->name, function->get());
        for (const auto& pin : (*function)->pins) model_.pin.emplace(pin->name, pin.get());
    }
    return true;
}

bool Edit::add_pins(Instance& instance, std::vector<std::unique_ptr<Pin>> pins, Span at) {
    for (const auto& pin : pins)
        if (!name_free(pin->name, at, "its pin")) return false;
    make_room(instance.pins, pins.size());
    on_undo([this, &instance, before = instance.pins.size()] {
        for (; instance.pins.size() > before; instance.pins.pop_back()) leave(model_, *instance.pins.back());
    });
    std::move(pins.begin(), pins.end(), std::back_inserter(instance.pins));
    for (auto pin = instance.pins.end() - static_cast<std::ptrdiff_t>(pins.size()); pin != instance.pins.end(); ++pin) enter(model_, **pin);
    return true;
}

void Edit::remove_pins(Instance& instance, const std::vector<Pin*>& pins) {
    std::erase_if(instance.pins, [&](const auto& pin) {
        if (std::find(pins.begin(), pins.end(), pin.get()) == pins.end()) return false;
        leave(model_, *pin);
        return true;
    });
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
        Signal* const written = pin->dir == HAL_DIR_OUT && (pin->flags & HAL_PIN_SAFE) ? pin->signal : nullptr;
        unlink(*pin);
        if (written) signal_values[written] = pin->safe;  // what it drove goes to the declared safe value
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
        for (const auto& pin : function->pins) unlink(*pin);
        gone.push_back({function, owner(component.functions, function) - component.functions.begin()});
    }
    std::sort(gone.begin(), gone.end(), [](const Gone& a, const Gone& b) { return a.position < b.position; });
    const auto at = owner(component.instances, &leaving);
    make_room(removed_.instances);
    make_room(removed_.functions, gone.size());
    on_undo([this, &leaving, &component, position = at - component.instances.begin(), gone, shrunk] {
        const auto back = owner(removed_.instances, &leaving);
        component.instances.insert(component.instances.begin() + position, std::move(*back));
        removed_.instances.erase(back);
        model_.instance.emplace(leaving.name, &leaving);
        for (const auto& pin : leaving.pins) enter(model_, *pin);
        for (const auto& [function, place] : gone) {
            const auto from = owner(removed_.functions, function);
            component.functions.insert(component.functions.begin() + place, std::move(*from));
            removed_.functions.erase(from);
            model_.function.emplace(function->name, function);
            for (const auto& pin : function->pins) enter(model_, *pin);
        }
        for (const auto& s : *shrunk) {
            s.function->steps = s.steps;
            s.function->instances = s.instances;
        }
    });
    for (const auto& pin : leaving.pins) leave(model_, *pin);
    model_.instance.erase(leaving.name);
    for (const auto& s : *shrunk)
        for (std::size_t i = s.function->instances.size(); i-- > 0;) {
            if (s.function->instances[i] != &leaving) continue;
            s.function->instances.erase(s.function->instances.begin() + static_cast<std::ptrdiff_t>(i));
            s.function->steps.erase(s.function->steps.begin() + static_cast<std::ptrdiff_t>(i));
        }
    for (auto it = gone.rbegin(); it != gone.rend(); ++it) {
        for (const auto& pin : it->function->pins) leave(model_, *pin);
        model_.function.erase(it->function->name);
        removed_.functions.push_back(std::move(component.functions[static_cast<std::size_t>(it->position)]));
        component.functions.erase(component.functions.begin() + it->position);
    }
    removed_.instances.push_back(std::move(*at));
    component.instances.erase(at);
    structural_ = true;
}

void Edit::remove_component(LoadedComponent& leaving) {
    while (!leaving.instances.empty()) remove_instance(*leaving.instances.back());
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
    structural_ = true;
}

}  // namespace hal
