// SPDX-License-Identifier: MIT
#include "commands/describe.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "machine/processes/programs.hpp"
#include "machine/session.hpp"

namespace hal {
namespace {

using Object = nlohmann::ordered_json;

/// Appends an array of the objects that `row` returns, and writes each before the next is built: a
/// hundred thousand at once would take several times the memory of their text.
template <class Range, class Row>
void array(std::string& to, const Session& session, const Range& range, Row&& row) {
    to += '[';
    bool first = true;
    std::size_t i = 0;
    for (const auto& each : range) {
        if (session.ending()) break;
        if (!std::exchange(first, false)) {
            to += ',';
        }
        to += json_text(row(each, i++));
    }
    to += ']';
}

template <class Range>
Object names(const Range& range) {
    Object all = Object::array();
    for (const auto& each : range) {
        all.push_back(each->name);
    }
    return all;
}

template <class T>
void keep_type(std::vector<const T*>& objects, std::optional<hal_type> type) {
    if (type) {
        std::erase_if(objects, [&](const T* object) { return object->type != *type; });
    }
}

void describe_pins(std::string& to, Session& session, bool parameters, const Patterns& patterns,
                   std::optional<hal_type> type) {
    auto pins = pins_by_name(session, parameters, patterns);
    keep_type(pins, type);
    const auto values = session.values().read_pins(pins);
    array(to, session, pins, [&](const Pin* pin, std::size_t i) {
        Object object;
        object["name"] = pin->name;
        if (!pin->alias.empty()) {
            object["alias"] = pin->alias;
        }
        object["type"] = name(pin->type);
        object["dir"] = direction_text(*pin);
        object["value"] = to_json(pin->type, values[i]);
        if (pin->signal) {
            object["signal"] = pin->signal->name;
        }
        if (const LoadedComponent* const component = owner(*pin)) {
            object["component"] = component->name;
        }
        if (pin->instance) {
            object["instance"] = pin->instance->name;
        }
        if (pin->instance && pin->instance->loaded.known()) {
            object["file"] = session.sources.get(pin->instance->loaded.source).name;
        }
        if (const Thread* const thread = thread_of(*pin)) {
            object["thread"] = thread->name;
        }
        if (*pin->doc) {
            object["doc"] = pin->doc;
        }
        if (*pin->unit) {
            object["unit"] = pin->unit;
        }
        return object;
    });
}

void describe_signals(std::string& to, Session& session, const Patterns& patterns,
                      std::optional<hal_type> type) {
    auto signals = signals_by_name(session, patterns);
    keep_type(signals, type);
    const auto values = session.values().read_signals(signals);
    array(to, session, signals, [&](const Signal* signal, std::size_t i) {
        Object object;
        object["name"] = signal->name;
        object["type"] = name(signal->type);
        object["value"] = to_json(signal->type, values[i]);
        if (signal->writer) {
            object["writer"] = signal->writer->name;
        }
        object["pins"] = names(signal->pins);
        return object;
    });
}

void describe_components(std::string& to, Session& session, const Patterns& patterns) {
    array(to, session, components_newest_first(session.model(), patterns),
          [&](const LoadedComponent* component, std::size_t) {
        Object object;
        object["name"] = component->name;
        if (component->process) {
            const auto* const program = session.programs().find(component->name);
            object["pid"] = component->process;
            object["ready"] = program && program->responds();
            object["state"] = program ? program->state() : "initializing";
            return object;
        }
        if (component->plugin) {
            object["summary"] = component->plugin->summary;
            object["file"] = component->path;
        }
        object["instances"] = names(component->instances);
        object["functions"] = names(component->functions);
        object["loaded"] = component->arguments;
        return object;
    });
}

void describe_functions(std::string& to, Session& session, const Patterns& patterns) {
    array(to, session, functions_by_name(session.model(), patterns),
          [&](const LoadedFunction* function, std::size_t) {
        Object object;
        object["name"] = function->name;
        object["component"] = function->component->name;
        if (function->thread) {
            object["thread"] = function->thread->name;
        }
        if (*function->doc) {
            object["doc"] = function->doc;
        }
        const auto samples = function->times->samples.load(std::memory_order_relaxed);
        const auto total = function->times->total_ns.load(std::memory_order_relaxed);
        if (samples > 0) {
            object["mean_ns"] = static_cast<double>(total) / static_cast<double>(samples);
        }
        return object;
    });
}

void describe_threads(std::string& to, Session& session, const Patterns& patterns) {
    const auto clock = session.reports().clock();
    array(to, session, threads_slowest_first(session.model(), patterns),
          [&](const Thread* thread, std::size_t) {
        const ThreadReport report = session.reports().thread(*thread);
        Object object;
        object["name"] = thread->name;
        object["period_ns"] = thread->options.period_ns;
        object["policy"] = report.policy;
        object["cpu"] = report.cpu;
        object["cycles"] = report.cycles;
        object["missed"] = report.missed;
        object["overruns"] = report.overruns;
        object["over_budget"] = report.over_budget;
        object["page_faults"] = report.page_faults;
        object["faulted"] = report.faulted;
        object["supervised"] = report.supervised;
        if (report.hung) {
            object["hung"] = true;
            object["silent_ns"] = report.silent_ns;
            if (!report.function.empty()) {
                object["function"] = report.function;
            }
        }
        object["wakeup_p50_ns"] = report.wakeup_p50_ns;
        object["wakeup_p99_ns"] = report.wakeup_p99_ns;
        object["wakeup_max_ns"] = report.wakeup_max_ns;
        object["busy_p50_ns"] = report.busy_p50_ns;
        object["busy_p99_ns"] = report.busy_p99_ns;
        object["busy_max_ns"] = report.busy_max_ns;
        if (clock) {
            object["clock_leader"] = clock->leader;
            object["clock_shift_ns"] = clock->shift_ns;
            object["clock_rate_ppm"] = clock->rate * 1e6;
        }
        object["functions"] = names(thread->functions);
        object["init"] = names(thread->init);
        return object;
    });
}

void describe_aliases(std::string& to, Session& session, const Patterns& patterns) {
    std::vector<const Pin*> aliased;
    for (const bool parameters : {false, true}) {
        for (const Pin* const pin : pins_by_name(session, parameters, patterns)) {
            if (!pin->alias.empty()) {
                aliased.push_back(pin);
            }
        }
    }
    array(to, session, aliased, [&](const Pin* pin, std::size_t) {
        Object object;
        object["name"] = pin->name;
        object["alias"] = pin->alias;
        return object;
    });
}

}  // namespace

std::optional<Listed> listed_kind(std::string_view word) {
    static constexpr std::pair<std::string_view, Listed> words[] = {
        {"comp", Listed::components},
        {"component", Listed::components},
        {"pin", Listed::pins},
        {"sig", Listed::signals},
        {"signal", Listed::signals},
        {"param", Listed::parameters},
        {"parameter", Listed::parameters},
        {"funct", Listed::functions},
        {"function", Listed::functions},
        {"thread", Listed::threads},
        {"alias", Listed::aliases},
        {"all", Listed::all}};
    for (const auto& [name, kind] : words) {
        if (name == word) return kind;
    }
    return std::nullopt;
}

std::vector<std::string> names_of(const Session& session, Listed kind, const Patterns& patterns) {
    std::vector<std::string> names;
    const auto add = [&](const auto& objects, auto&& name) {
        for (const auto* const object : objects) {
            names.push_back(name(*object));
        }
    };
    const auto own = [](const auto& object) { return object.name; };
    switch (kind) {
    case Listed::components: add(components_newest_first(session.model(), patterns), own); break;
    case Listed::pins: add(pins_by_name(session, false, patterns), shown_name); break;
    case Listed::parameters: add(pins_by_name(session, true, patterns), shown_name); break;
    case Listed::signals: add(signals_by_name(session, patterns), own); break;
    case Listed::functions: add(functions_by_name(session.model(), patterns), own); break;
    case Listed::threads: add(threads_slowest_first(session.model(), patterns), own); break;
    case Listed::aliases:
        for (const bool parameters : {false, true}) {
            for (const Pin* const pin : pins_by_name(session, parameters, patterns)) {
                if (!pin->alias.empty()) {
                    names.push_back(pin->alias);
                }
            }
        }
        break;
    case Listed::all:
        for (const Listed each : {Listed::components, Listed::pins, Listed::signals,
                                  Listed::parameters, Listed::functions, Listed::threads}) {
            auto more = names_of(session, each, patterns);
            std::move(more.begin(), more.end(), std::back_inserter(names));
        }
        break;
    }
    return names;
}

void describe(std::string& to, Session& session, Listed kind, const Patterns& patterns,
              std::optional<hal_type> type) {
    switch (kind) {
    case Listed::components: return describe_components(to, session, patterns);
    case Listed::pins: return describe_pins(to, session, false, patterns, type);
    case Listed::parameters: return describe_pins(to, session, true, patterns, type);
    case Listed::signals: return describe_signals(to, session, patterns, type);
    case Listed::functions: return describe_functions(to, session, patterns);
    case Listed::threads: return describe_threads(to, session, patterns);
    case Listed::aliases: return describe_aliases(to, session, patterns);
    case Listed::all: break;
    }
    static constexpr std::pair<std::string_view, Listed> parts[] = {
        {"components", Listed::components}, {"pins", Listed::pins},
        {"signals", Listed::signals},       {"parameters", Listed::parameters},
        {"functions", Listed::functions},   {"threads", Listed::threads}};
    std::string_view before = "{";
    for (const auto& [name, part] : parts) {
        json_quote(to += before, name);
        describe(to += ':', session, part, patterns, type);
        before = ",";
    }
    to += '}';
}

}  // namespace hal
