// SPDX-License-Identifier: MIT
// show and list, in LinuxCNC's formats: the tables for people (with the wide value column its
// 64-bit types need) and those for scripts (-s); with --json an array of objects per kind. All
// values of a table come from one bulk read.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commands/describe.hpp"
#include "commands/listing.hpp"
#include "commands/table.hpp"
#include "commands/text_writer.hpp"
#include "machine/processes/programs.hpp"
#include "text/natural_order.hpp"

namespace hal {
namespace {

/// What one `show` was asked for.
struct Request : TextWriter {
    Request(Context& c) : context(c) {}
    Context& context;
    Patterns patterns;
    std::optional<hal_type> type;

    const Model& model() const { return context.session.model(); }
    bool script() const { return context.options().script; }
    void title(std::string_view words) {
        if (!script()) {
            text += words;
        }
    }
};

template <class Object>
void keep_objects_of_type(std::vector<const Object*>& objects, std::optional<hal_type> type) {
    if (type) {
        std::erase_if(objects, [&](const Object* object) { return object->type != *type; });
    }
}

std::string value_text(const Request& request, hal_type type, const hal_value& value) {
    return request.script() ? format_value(type, value) : table_value(type, value);
}

std::string state_of(const Request& request, const LoadedComponent& component) {
    if (component.process == 0) return "ready";
    const auto* const program = request.context.programs.find(component.name);
    return program != nullptr ? program->state() : "initializing";
}

void show_comp(Request& request) {
    request.title(
        "Loaded HAL Components:\nID      Type  Name                                            PID "
        "  State\n");
    for (const LoadedComponent* const component :
         components_newest_first(request.model(), request.patterns)) {
        const std::string pid = component->process ? std::to_string(component->process) : "";
        request.add("{:>6}  {:<4}  {:<47} {:>5} {}\n", component->id,
                    component->process ? "User" : "RT", component->name, pid,
                    state_of(request, *component));
    }
    request.text += '\n';
}

void show_pins(Request& request, bool parameters) {
    request.title(parameters ? "Parameters:\n" : "Component Pins:\n");
    request.title("Owner   Type  Dir                 Value  Name\n");
    auto pins = pins_by_name(request.context.session, parameters, request.patterns);
    keep_objects_of_type(pins, request.type);
    const auto values = request.context.session.values().read_pins(pins);
    for (std::size_t i = 0; i < pins.size(); ++i) {
        if (request.context.session.ending()) return;
        const Pin& pin = *pins[i];
        const LoadedComponent* const whose = owner(pin);
        const std::string value = value_text(request, pin.type, values[i]);
        if (request.script()) {
            request.add("{} {:<5} {} {} {}", whose ? std::string_view(whose->name) : "-",
                        name(pin.type), direction_text(pin), value, shown_name(pin));
        } else {
            request.add("{:>6}  {:<5} {:<3}  {:>20}  {}", whose ? whose->id : 0, name(pin.type),
                        direction_text(pin), value, shown_name(pin));
        }
        if (pin.signal) {
            request.add(" {} {}", arrow_of_pin(pin), pin.signal->name);
        }
        request.text += '\n';
    }
    request.text += '\n';
}

void show_pin(Request& request) { show_pins(request, false); }
void show_param(Request& request) { show_pins(request, true); }

void show_sig(Request& request) {
    request.title("Signals:\nType                  Value  Name     (linked to)\n");
    auto signals = signals_by_name(request.context.session, request.patterns);
    keep_objects_of_type(signals, request.type);
    const auto values = request.context.session.values().read_signals(signals);
    std::vector<const Pin*> pins;
    for (std::size_t i = 0; i < signals.size(); ++i) {
        if (request.context.session.ending()) return;
        const Signal& signal = *signals[i];
        const std::string value = value_text(request, signal.type, values[i]);
        if (request.script()) {
            request.add("{:<5}  {}  {}", name(signal.type), value, signal.name);
        } else {
            request.add("{:<5}  {:>20}  {}\n", name(signal.type), value, signal.name);
        }
        pins.assign(signal.pins.begin(), signal.pins.end());
        std::sort(pins.begin(), pins.end(), [](const Pin* a, const Pin* b) {
            return natural_less(shown_name(*a), shown_name(*b));
        });
        for (const Pin* const pin : pins) {
            if (request.script()) {
                request.add(" {} {}", arrow_of_signal(*pin), shown_name(*pin));
            } else {
                request.add("                                 {} {}\n", arrow_of_signal(*pin),
                            shown_name(*pin));
            }
        }
        if (request.script()) {
            request.text += '\n';
        }
    }
    request.text += '\n';
}

void show_funct(Request& request) {
    request.title("Exported Functions:\nOwner   CodeAddr  Arg       FP   Users  Name\n");
    for (const LoadedFunction* const function :
         functions_by_name(request.model(), request.patterns)) {
        const auto address = [](const void* at) { return reinterpret_cast<std::uintptr_t>(at); };
        const plan::Step step =
            function->steps.empty() ? plan::Step{nullptr, nullptr} : function->steps[0];
        const auto code = address(reinterpret_cast<const void*>(step.step));

        const auto self = address(step.self);
        const int users = function->thread ? 1 : 0;
        if (request.script()) {
            request.add("{} {:08x} {:08x} YES {:>3} {}\n", function->component->name, code, self,
                        users, function->name);
        } else {
            request.add(" {:05}  {:08x}  {:08x}  YES  {:>5}   {}\n", function->component->id, code,
                        self, users, function->name);
        }
    }
    request.text += '\n';
}

void show_thread(Request& request) {
    request.title(
        "Realtime Threads:\n     Period  FP     Name               (     Time, Max-Time )\n");
    const auto threads = threads_slowest_first(request.model(), request.patterns);
    std::vector<const Pin*> times;
    for (const Thread* const thread : threads) {
        for (const char* const pin : {".time", ".tmax"}) {
            times.push_back(request.model().find_pin(thread->name + pin));
        }
    }
    const auto values = request.context.session.values().read_pins(times);
    for (std::size_t i = 0; i < threads.size(); ++i) {
        const Thread* const thread = threads[i];
        const std::int32_t last = values[2 * i].s32;
        const std::int32_t max = values[2 * i + 1].s32;
        if (request.script()) {
            request.add("{} YES {} {:>8} {}", thread->options.period_ns, thread->name, last, max);
        } else {
            request.add("{:>11}  YES  {:>20} ( {:>8}, {:>8} )\n", thread->options.period_ns,
                        thread->name, last, max);
        }
        int number = 1;
        for (const LoadedFunction* const function : thread->functions) {
            if (request.script()) {
                request.add(" {}", function->name);
            } else {
                request.add("                 {:>2} {}\n", number++, function->name);
            }
        }
        if (request.script()) {
            request.text += '\n';
        }
    }
    if (!request.script()) {
        request.text += clock_text(request.context.session);
    }
    request.text += '\n';
}

void show_aliases(Request& request, bool parameters) {
    request.title(parameters ? "Parameter Aliases:\n" : "Pin Aliases:\n");
    request.title(fmt::format(" {:<48} {}\n", "Alias", "Original Name"));
    for (const Pin* const pin :
         pins_by_name(request.context.session, parameters, request.patterns)) {
        if (pin->alias.empty()) continue;
        if (request.script()) {
            request.add(" {}  {}\n", pin->alias, pin->name);
        } else {
            request.add(" {:<48} {}\n", pin->alias, pin->name);
        }
    }
    request.text += '\n';
}

void show_alias(Request& request) {
    show_aliases(request, false);
    show_aliases(request, true);
}

void show_all(Request& request) {
    show_comp(request);
    show_pin(request);
    show_aliases(request, false);
    show_sig(request);
    show_param(request);
    show_aliases(request, true);
    show_funct(request);
    show_thread(request);
}

struct ListedKind {
    std::string_view name;
    void (*show)(Request&);     ///< in LinuxCNC's format
    void (*report)(Context&);   ///< our own reports, which write for themselves
    Listed listed;
    bool can_list;
};

constexpr ListedKind listed_kinds[] = {
    {"comp", show_comp, nullptr, Listed::components, true},
    {"pin", show_pin, nullptr, Listed::pins, true},
    {"sig", show_sig, nullptr, Listed::signals, true},
    {"signal", show_sig, nullptr, Listed::signals, true},
    {"param", show_param, nullptr, Listed::parameters, true},
    {"parameter", show_param, nullptr, Listed::parameters, true},
    {"funct", show_funct, nullptr, Listed::functions, true},
    {"function", show_funct, nullptr, Listed::functions, true},
    {"thread", show_thread, nullptr, Listed::threads, true},
    {"alias", show_alias, nullptr, Listed::aliases, false},
    {"all", show_all, nullptr, Listed::all, false},
    {"timing", nullptr, show_timing, Listed::threads, false},
    {"latency", nullptr, show_latency, Listed::all, false},
    {"fault", nullptr, show_faults, Listed::all, false},
};

const ListedKind* find_kind(Context& context, bool to_list) {
    const std::string_view wanted = context.argument_or(0, "all");
    std::vector<std::string> names;
    for (const ListedKind& kind : listed_kinds) {
        if (to_list && !kind.can_list) continue;
        if (kind.name == wanted) return &kind;
        names.emplace_back(kind.name);
    }
    context.diagnostics.error(
        "unknown-word", context.span(0), "unknown kind '" + std::string(wanted) + "'",
        did_you_mean(wanted, names), "the kinds are: " + listed(names, names.size()));
    return nullptr;
}

/// The patterns after the kind, `-t TYPE` taken out. False after reporting.
bool read_patterns(Context& context, std::vector<std::string>& patterns,
                   std::optional<hal_type>& type) {
    for (std::size_t i = 1; i < context.count(); ++i) {
        const std::string& word = context.argument(i);
        if (!word.starts_with("-t")) {
            patterns.push_back(word);
            continue;
        }
        const bool apart = word.size() == 2;
        const std::size_t at = apart ? i + 1 : i;
        const std::string wanted =
            apart ? std::string(context.argument_or(at, "")) : word.substr(2);
        type = type_named(wanted);
        if (!type) {
            context.diagnostics.error("no-such-type", context.span(at),
                                      "unknown type '" + wanted + "'", "",
                                      "types: bit, float, s32, u32, s64, u64, port");
            return false;
        }
        i = at;
    }
    return true;
}

}  // namespace

void command_show(Context& context) {
    const ListedKind* const kind = find_kind(context, false);
    Request request(context);
    std::vector<std::string> patterns;
    if (!kind || !read_patterns(context, patterns, request.type) || context.checking()) return;
    if (kind->report) return kind->report(context);
    request.patterns = Patterns(std::move(patterns));
    if (context.options().json) {
        std::string text;
        describe(text, context.session, kind->listed, request.patterns, request.type);
        return context.output.out(text + "\n");
    }
    kind->show(request);
    context.output.out(request.text);
}

void command_list(Context& context) {
    const ListedKind* const kind = find_kind(context, true);
    std::vector<std::string> patterns;
    std::optional<hal_type> no_type;
    if (!kind || !read_patterns(context, patterns, no_type) || context.checking()) return;
    const auto names = names_of(context.session, kind->listed, Patterns(std::move(patterns)));
    std::string text;
    if (context.options().json) {
        text = json_text(names);
    } else {
        for (const auto& name : names) {
            text += name + " ";
        }
    }
    context.output.out(text + "\n");
}

}  // namespace hal
