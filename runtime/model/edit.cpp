// SPDX-License-Identifier: MIT
#include "model/edit.hpp"

#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>

#include "model/component_replacement.hpp"
#include "model/own.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

void prefetch(const Model& model, const std::vector<std::unique_ptr<Pin>>& pins) {
    for (const auto& pin : pins) {
        model.pin.prefetch(pin->name);
    }
}

}  // namespace

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

// --- components and instances ---

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
        return fail("name-taken", made->loaded,
                    "instance " + hal::quoted(made->name) + " already exists (" +
                        there->component->name + ")",
                    "second time", Other{there->loaded, "loaded here"},
                    "choose another name for the new instance: names=…");
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
    prefetch(model_, pins);
    for (const auto& function : functions) {
        prefetch(model_, function->pins);
    }
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

/// The functions of an instance that leaves.
struct Edit::LeavingFunctions {
    /// One of its own, or the last instance of a shared one: it leaves, too.
    struct Own {
        LoadedFunction* function;
        std::ptrdiff_t position;  ///< in the component
    };
    /// A shared one that loses the steps of the instance, as it was before.
    struct Shared {
        LoadedFunction* function;
        std::vector<plan::Step> steps;
        std::vector<Instance*> instances;
    };
    std::vector<Own> own;  ///< by position
    std::vector<Shared> shared;
};

Edit::LeavingFunctions Edit::functions_leaving_with(const Instance& leaving) {
    LoadedComponent& component = *leaving.component;
    LeavingFunctions out;
    for (LoadedFunction* const function : leaving.functions) {
        if (function->shared && function->instances.size() > 1) {
            out.shared.push_back({function, function->steps, function->instances});
        } else {
            out.own.push_back(
                {function, owner(component.functions, function) - component.functions.begin()});
        }
    }
    std::sort(out.own.begin(), out.own.end(),
              [](const auto& a, const auto& b) { return a.position < b.position; });
    return out;
}

void Edit::unlink_for_removal(Instance& leaving, const LeavingFunctions& functions) {
    for (const auto& pin : leaving.pins) {
        const bool is_safe_output = pin->dir == HAL_DIR_OUT && (pin->flags & HAL_PIN_SAFE);
        Signal* const written = is_safe_output ? pin->signal : nullptr;
        unlink(*pin);
        if (written) {
            signal_values[written] = pin->safe;
        }
    }
    for (const auto& [function, position] : functions.own) {
        take_from_thread(*function);
        for (const auto& pin : function->pins) {
            unlink(*pin);
        }
    }
}

void Edit::bring_back(Instance& instance, std::ptrdiff_t position,
                      const LeavingFunctions& functions) {
    LoadedComponent& component = *instance.component;
    const auto removed = owner(removed_.instances, &instance);
    component.instances.insert(component.instances.begin() + position, std::move(*removed));
    removed_.instances.erase(removed);
    model_.instance.emplace(instance.name, &instance);
    for (const auto& pin : instance.pins) {
        model_.enter(*pin);
    }
    for (const auto& [function, position_of_function] : functions.own) {
        const auto from = owner(removed_.functions, function);
        component.functions.insert(component.functions.begin() + position_of_function,
                                   std::move(*from));
        removed_.functions.erase(from);
        model_.function.emplace(function->name, function);
        for (const auto& pin : function->pins) {
            model_.enter(*pin);
        }
    }
    for (const auto& before : functions.shared) {
        before.function->steps = before.steps;
        before.function->instances = before.instances;
    }
}

void Edit::remove_instance(Instance& leaving) {
    LoadedComponent& component = *leaving.component;
    const auto functions =
        std::make_shared<const LeavingFunctions>(functions_leaving_with(leaving));
    unlink_for_removal(leaving, *functions);
    const auto at = owner(component.instances, &leaving);
    make_room(removed_.instances);
    make_room(removed_.functions, functions->own.size());
    on_undo([this, &leaving, position = at - component.instances.begin(), functions] {
        bring_back(leaving, position, *functions);
    });
    for (const auto& pin : leaving.pins) {
        model_.leave(*pin);
    }
    model_.instance.erase(leaving.name);
    for (const auto& before : functions->shared) {
        drop_steps_of(leaving, *before.function);
    }
    // from the last one: the positions of the others stay
    for (const auto& [function, position] : functions->own | std::views::reverse) {
        const auto from = component.functions.begin() + position;
        removed_.functions.push_back(std::move(*from));
        component.functions.erase(from);
        model_.function.erase(function->name);
        for (const auto& pin : function->pins) {
            model_.leave(*pin);
        }
    }
    removed_.instances.push_back(std::move(*at));
    component.instances.erase(at);
    if (component.process == 0) {
        structural_ = true;  // of a program, only what its links were
    }
}

void Edit::drop_steps_of(const Instance& leaving, LoadedFunction& function) noexcept {
    for (std::size_t i = function.instances.size(); i-- > 0;) {
        if (function.instances[i] != &leaving) continue;
        function.instances.erase(function.instances.begin() + static_cast<std::ptrdiff_t>(i));
        function.steps.erase(function.steps.begin() + static_cast<std::ptrdiff_t>(i));
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

bool Edit::replace(LoadedComponent& component, std::unique_ptr<LoadedComponent>& owned, Span at) {
    const std::size_t errors_before = diagnostics->errors();
    const auto replacement = std::make_shared<ComponentReplacement>(model_, component, *owned);
    replacement->compare(*this, at);
    for (const LoadedFunction* const function : replacement->new_functions()) {
        if (model_.find_function(function->name)) {
            fail("name-taken", at, "function " + hal::quoted(function->name) + " already exists",
                 "its function");
        }
    }
    for (const Pin* const pin : replacement->new_pins()) {
        const Pin* const there = model_.find_pin(pin->name);
        const bool goes = there && there->name == pin->name && replacement->removes(*there);
        if (!goes) {
            name_free(pin->name, at, "its pin");
        }
    }
    if (diagnostics->errors() > errors_before) return false;

    // nothing below can fail
    replacement->translate();
    replacement->carry_values(*this);
    auto done = std::make_shared<bool>(false);
    on_undo([replacement, done] {
        if (*done) {
            replacement->back();
        }
    });
    Replaced& replaced = replaced_.emplace_back(Replaced{&component, std::move(owned)});
    for (std::size_t i = 0; i < component.instances.size(); ++i) {
        replaced.pairs.push_back(
            {component.instances[i].get(), replaced.other->instances[i].get()});
    }
    *done = true;
    replacement->run();
    structural_ = true;
    return true;
}

// --- functions and threads ---

namespace {

/// A pin that each thread has.
struct ThreadPin {
    const char* suffix;
    hal_type type;
    hal_dir dir;
    hal_pin Thread::* memory;
    const char* doc;
    const char* unit;
};
constexpr ThreadPin thread_pins[] = {
    {".time", HAL_TYPE_S32, HAL_DIR_OUT, &Thread::time, "execution time of the last cycle", "ns"},
    {".tmax", HAL_TYPE_S32, HAL_DIR_PARAM, &Thread::tmax,
     "longest execution time; set to 0 to reset", "ns"},
    {".tmax-increased", HAL_TYPE_BIT, HAL_DIR_OUT, &Thread::tmax_increased,
     "TRUE when the last cycle was the longest so far", ""},
    {".threadbeat", HAL_TYPE_U32, HAL_DIR_OUT, &Thread::beat, "number of cycles", ""},
    {".missed", HAL_TYPE_U32, HAL_DIR_OUT, &Thread::missed, "missed periods", ""},
    {".wakeup", HAL_TYPE_S32, HAL_DIR_OUT, &Thread::wakeup, "wake-up latency of the last cycle",
     "ns"},
};

}  // namespace

bool Edit::is_free_for_thread(Word name) {
    if (!check_name("thread", name)) return false;
    if (const Thread* const there = model_.find_thread(name.text)) {
        fail("name-taken", name.span, "thread " + hal::quoted(name.text) + " already exists",
             "second time", Other{there->made, "created here"});
        return false;
    }
    return std::all_of(std::begin(thread_pins), std::end(thread_pins), [&](const ThreadPin& pin) {
        return name_free(std::string(name.text) + pin.suffix, name.span, "pin of this thread");
    });
}

Thread* Edit::add_thread(Word name, const ThreadOptions& options) {
    if (!is_free_for_thread(name)) return nullptr;
    auto owned = std::make_unique<Thread>();
    Thread* const made = owned.get();
    made->name = name.text;
    made->options = options;
    made->made = name.span;
    for (const ThreadPin& row : thread_pins) {
        auto pin = own_pin(model_, made->name + row.suffix, row.type, row.dir, made->*row.memory,
                           row.doc, row.unit);
        pin->of_thread = made;
        made->pins.push_back(std::move(pin));
    }
    // the fastest thread first
    const auto behind = std::upper_bound(
        model_.threads.begin(), model_.threads.end(), options.period_ns,
        [](std::int64_t period, const auto& other) { return period < other->options.period_ns; });
    const auto position = behind - model_.threads.begin();
    make_room(model_.threads);
    on_undo([this, made] {
        for (const auto& pin : made->pins) {
            model_.pin.erase(pin->name);
        }
        model_.thread.erase(made->name);
        const auto at = owner(model_.threads, made);
        removed_.threads.push_back(std::move(*at));  // it may be running
        model_.threads.erase(at);
    });
    model_.threads.insert(model_.threads.begin() + position, std::move(owned));
    structural_ = true;
    model_.thread.emplace(made->name, made);
    for (const auto& pin : made->pins) {
        model_.pin.emplace(pin->name, pin.get());
    }
    return made;
}

bool Edit::remove_thread(Word name) {
    Thread* const leaving = thread(name);
    if (!leaving) return false;
    while (!leaving->functions.empty()) {
        take_from_thread(*leaving->functions.back());
    }
    while (!leaving->init.empty()) {
        take_from_thread(*leaving->init.back());
    }
    for (const auto& pin : leaving->pins) {
        unlink(*pin);
    }
    const auto at = owner(model_.threads, leaving);
    make_room(removed_.threads);
    on_undo([this, leaving, position = at - model_.threads.begin()] {
        const auto back = owner(removed_.threads, leaving);
        model_.threads.insert(model_.threads.begin() + position, std::move(*back));
        removed_.threads.erase(back);
        model_.thread.emplace(leaving->name, leaving);
        for (const auto& pin : leaving->pins) {
            model_.enter(*pin);
        }
    });
    for (const auto& pin : leaving->pins) {
        model_.leave(*pin);
    }
    model_.thread.erase(leaving->name);
    removed_.threads.push_back(std::move(*at));
    model_.threads.erase(at);
    structural_ = true;
    return true;
}

/// The rules about a function that is added to a thread. False after reporting.
bool Edit::check_function(const LoadedFunction& function, const Thread& to, Span at, bool init) {
    if (function.thread) {
        return fail("function-in-thread", at,
                    "function " + hal::quoted(function.name) + " is already in thread " +
                        hal::quoted(function.thread->name),
                    "second time", Other{function.added, "added here"},
                    "a function runs in one thread; remove it first: delf " + function.name + " " +
                        function.thread->name);
    }
    if (init && to.init_done) {
        return fail("init-done", at,
                    "thread " + hal::quoted(to.name) +
                        " has already made its first pass; the initf function would never run",
                    "too late", "add it before start, or with addf");
    }
    return true;
}

bool Edit::add_function(Word function_name, Word thread_name, int position, Span position_at,
                        bool init) {
    LoadedFunction* const target = function(function_name);
    Thread* const to = thread(thread_name);
    if (!target || !to) return false;
    if (!check_function(*target, *to, function_name.span, init)) return false;
    auto& row = init ? to->init : to->functions;
    const auto size = static_cast<int>(row.size());
    if (position == 0) {
        return fail("bad-position", position_at,
                    "invalid position 0: 1 is the first position, -1 the last", "",
                    "omit it to append");
    }
    const int index = position > 0 ? position - 1 : size + 1 + position;
    if (index < 0 || index > size) {
        return fail("bad-position", position_at,
                    "thread " + hal::quoted(to->name) + " has " + counted(size, "function") +
                        ", position " + std::to_string(position) + " does not exist",
                    "",
                    "positions 1 to " + std::to_string(size + 1) +
                        " count from the beginning, -1 to -" + std::to_string(size + 1) +
                        " from the end");
    }
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
    if (target->thread != from) {
        return fail(
            "not-in-thread", function_name.span,
            "function " + hal::quoted(target->name) + " is not in thread " +
                hal::quoted(from->name),
            "", target->thread ? "it is in thread " + target->thread->name : "it is in no thread");
    }
    take_from_thread(*target);
    return true;
}

void Edit::take_from_thread(LoadedFunction& function) {
    Thread* const from = function.thread;
    if (!from) return;
    const bool init = function.init;
    auto& row = init ? from->init : from->functions;
    const auto at = std::find(row.begin(), row.end(), &function);
    make_room(taken_);
    on_undo([&function, from, init, position = at - row.begin()] {
        auto& functions = init ? from->init : from->functions;
        functions.insert(functions.begin() + position, &function);
        function.thread = from;
        function.init = init;
    });
    row.erase(at);
    function.thread = nullptr;
    taken_.push_back(&function);
    structural_ = true;
}

}  // namespace hal
