// SPDX-License-Identifier: MIT
#include "commands/describe.hpp"

#include <algorithm>

#include "machine/session.hpp"
#include "machine/processes.hpp"

namespace hal {
namespace {

/// Appends one JSON object member by member.
class Object {
public:
    explicit Object(std::string& to) : to_(to) { to_ += '{'; }
    ~Object() { to_ += '}'; }
    Object(const Object&) = delete;
    std::string& member(std::string_view key) {
        if (!first_) to_ += ',';
        first_ = false;
        json_quote(to_, key);
        return to_ += ':';
    }
    void text(std::string_view key, std::string_view value) { json_quote(member(key), value); }
    void number(std::string_view key, std::int64_t value) { member(key) += std::to_string(value); }
    void real(std::string_view key, double value) { json_value(member(key), HAL_TYPE_FLOAT, hal_value{.real = value}); }
    void flag(std::string_view key, bool value) { member(key) += value ? "true" : "false"; }
    template <class Range, class Name>
    void names(std::string_view key, const Range& range, Name&& name) {
        member(key) += '[';
        for (const auto& each : range) {
            if (to_.back() != '[') to_ += ',';
            json_quote(to_, name(*each));
        }
        to_ += ']';
    }

private:
    std::string& to_;
    bool first_ = true;
};

/// Appends an array; the action is called per object and appends it.
template <class Range, class Action>
void array(std::string& to, const Range& range, Action&& action) {
    to += '[';
    bool first = true;
    std::size_t i = 0;
    for (const auto& each : range) {
        if (!first) to += ',';
        first = false;
        action(each, i++);
    }
    to += ']';
}

template <class T>
void keep_type(std::vector<const T*>& objects, std::optional<hal_type> type) {
    if (type) std::erase_if(objects, [&](const T* object) { return object->type != *type; });
}

void describe_pins(std::string& to, Session& session, bool parameters, const Patterns& patterns, std::optional<hal_type> type) {
    auto pins = pins_by_name(session.model(), parameters, patterns);
    keep_type(pins, type);
    const auto values = session.read_pins(pins);
    array(to, pins, [&](const Pin* pin, std::size_t i) {
        Object object(to);
        object.text("name", pin->name);
        if (!pin->alias.empty()) object.text("alias", pin->alias);
        object.text("type", name(pin->type));
        object.text("dir", direction_text(*pin));
        json_value(object.member("value"), pin->type, values[i]);
        if (pin->signal) object.text("signal", pin->signal->name);
        if (const LoadedComponent* const component = owner(*pin)) object.text("component", component->name);
        if (pin->instance) object.text("instance", pin->instance->name);
        if (const Thread* const thread = thread_of(*pin)) object.text("thread", thread->name);
        if (*pin->doc) object.text("doc", pin->doc);
        if (*pin->unit) object.text("unit", pin->unit);
    });
}

void describe_signals(std::string& to, Session& session, const Patterns& patterns, std::optional<hal_type> type) {
    auto signals = signals_by_name(session.model(), patterns);
    keep_type(signals, type);
    const auto values = session.read_signals(signals);
    array(to, signals, [&](const Signal* signal, std::size_t i) {
        Object object(to);
        object.text("name", signal->name);
        object.text("type", name(signal->type));
        json_value(object.member("value"), signal->type, values[i]);
        if (signal->writer) object.text("writer", signal->writer->name);
        object.names("pins", signal->pins, [](const Pin& pin) { return pin.name; });
    });
}

void describe_components(std::string& to, Session& session, Processes& processes, const Patterns& patterns) {
    array(to, components_newest_first(session.model(), patterns), [&](const LoadedComponent* component, std::size_t) {
        Object object(to);
        object.text("name", component->name);
        if (component->process) {
            const auto* const program = processes.find(component->name);
            object.number("pid", component->process);
            object.flag("ready", program && program->responds());
            object.text("state", program ? program->state() : "initializing");
            return;
        }
        if (component->plugin) {
            object.text("summary", component->plugin->summary);
            object.text("file", component->path);
        }
        object.names("instances", component->instances, [](const Instance& instance) { return instance.name; });
        object.names("functions", component->functions, [](const LoadedFunction& function) { return function.name; });
        array(object.member("loaded"), component->arguments, [&](const std::string& arguments, std::size_t) { json_quote(to, arguments); });
    });
}

void describe_functions(std::string& to, Session& session, const Patterns& patterns) {
    array(to, functions_by_name(session.model(), patterns), [&](const LoadedFunction* function, std::size_t) {
        Object object(to);
        object.text("name", function->name);
        object.text("component", function->component->name);
        if (function->thread) object.text("thread", function->thread->name);
        if (*function->doc) object.text("doc", function->doc);
        const auto samples = function->times->samples.load(std::memory_order_relaxed);
        const auto total = function->times->total_ns.load(std::memory_order_relaxed);
        if (samples > 0) object.real("mean_ns", static_cast<double>(total) / static_cast<double>(samples));
    });
}

void describe_threads(std::string& to, Session& session, const Patterns& patterns) {
    const auto clock = session.clock_report();
    array(to, threads_slowest_first(session.model(), patterns), [&](const Thread* thread, std::size_t) {
        const ThreadReport report = session.thread_report(*thread);
        Object object(to);
        object.text("name", thread->name);
        object.number("period_ns", thread->options.period_ns);
        object.text("policy", report.policy);
        object.number("cpu", report.cpu);
        object.number("cycles", static_cast<std::int64_t>(report.cycles));
        object.number("missed", static_cast<std::int64_t>(report.missed));
        object.number("overruns", static_cast<std::int64_t>(report.overruns));
        object.number("page_faults", static_cast<std::int64_t>(report.page_faults));
        object.flag("faulted", report.faulted);
        object.flag("supervised", report.supervised);
        if (report.hung) {
            object.flag("hung", true);
            object.number("silent_ns", report.silent_ns);
            if (!report.function.empty()) object.text("function", report.function);
        }
        object.real("wakeup_p50_ns", report.wakeup_p50_ns);
        object.real("wakeup_p99_ns", report.wakeup_p99_ns);
        object.real("wakeup_max_ns", report.wakeup_max_ns);
        object.real("busy_p50_ns", report.busy_p50_ns);
        object.real("busy_p99_ns", report.busy_p99_ns);
        object.real("busy_max_ns", report.busy_max_ns);
        if (clock) {
            object.text("clock_leader", clock->leader);
            object.number("clock_shift_ns", clock->shift_ns);
            object.real("clock_rate_ppm", clock->rate * 1e6);
        }
        object.names("functions", thread->functions, [](const LoadedFunction& function) { return function.name; });
        object.names("init", thread->init, [](const LoadedFunction& function) { return function.name; });
    });
}

void describe_aliases(std::string& to, Session& session, const Patterns& patterns) {
    std::vector<const Pin*> aliased;
    for (const bool parameters : {false, true})
        for (const Pin* const pin : pins_by_name(session.model(), parameters, patterns))
            if (!pin->alias.empty()) aliased.push_back(pin);
    array(to, aliased, [&](const Pin* pin, std::size_t) {
        Object object(to);
        object.text("name", pin->name);
        object.text("alias", pin->alias);
    });
}

}  // namespace

std::optional<Listed> listed_kind(std::string_view word) {
    static constexpr std::pair<std::string_view, Listed> words[] = {
        {"comp", Listed::components}, {"component", Listed::components}, {"pin", Listed::pins}, {"sig", Listed::signals},
        {"signal", Listed::signals}, {"param", Listed::parameters}, {"parameter", Listed::parameters}, {"funct", Listed::functions},
        {"function", Listed::functions}, {"thread", Listed::threads}, {"alias", Listed::aliases}, {"all", Listed::all}};
    for (const auto& [name, kind] : words)
        if (name == word) return kind;
    return std::nullopt;
}

std::vector<std::string> names_of(const Model& model, Listed kind, const Patterns& patterns) {
    std::vector<std::string> names;
    const auto add = [&](const auto& objects, auto&& name) {
        for (const auto* const object : objects) names.push_back(name(*object));
    };
    const auto own = [](const auto& object) { return object.name; };
    switch (kind) {
    case Listed::components: add(components_newest_first(model, patterns), own); break;
    case Listed::pins: add(pins_by_name(model, false, patterns), shown_name); break;
    case Listed::parameters: add(pins_by_name(model, true, patterns), shown_name); break;
    case Listed::signals: add(signals_by_name(model, patterns), own); break;
    case Listed::functions: add(functions_by_name(model, patterns), own); break;
    case Listed::threads: add(threads_slowest_first(model, patterns), own); break;
    case Listed::aliases:
        for (const bool parameters : {false, true})
            for (const Pin* const pin : pins_by_name(model, parameters, patterns))
                if (!pin->alias.empty()) names.push_back(pin->alias);
        break;
    case Listed::all:
        for (const Listed each :
             {Listed::components, Listed::pins, Listed::signals, Listed::parameters, Listed::functions, Listed::threads}) {
            auto more = names_of(model, each, patterns);
            std::move(more.begin(), more.end(), std::back_inserter(names));
        }
        break;
    }
    return names;
}

void describe(std::string& to, Session& session, Processes& processes, Listed kind, const Patterns& patterns,
              std::optional<hal_type> type) {
    switch (kind) {
    case Listed::components: return describe_components(to, session, processes, patterns);
    case Listed::pins: return describe_pins(to, session, false, patterns, type);
    case Listed::parameters: return describe_pins(to, session, true, patterns, type);
    case Listed::signals: return describe_signals(to, session, patterns, type);
    case Listed::functions: return describe_functions(to, session, patterns);
    case Listed::threads: return describe_threads(to, session, patterns);
    case Listed::aliases: return describe_aliases(to, session, patterns);
    case Listed::all: break;
    }
    static constexpr std::pair<std::string_view, Listed> parts[] = {
        {"components", Listed::components}, {"pins", Listed::pins}, {"signals", Listed::signals},
        {"parameters", Listed::parameters}, {"functions", Listed::functions}, {"threads", Listed::threads}};
    Object object(to);
    for (const auto& [name, part] : parts) describe(object.member(name), session, processes, part, patterns, type);
}

}  // namespace hal
