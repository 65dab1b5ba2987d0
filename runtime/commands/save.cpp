// SPDX-License-Identifier: MIT
// save: the state as commands that make it again. LinuxCNC's sections and formats; linear in what
// there is.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "commands/listing.hpp"
#include "commands/table.hpp"
#include "commands/text_writer.hpp"
#include "hal/replace_file.hpp"
#include "machine/load/module_library.hpp"
#include "text/natural_order.hpp"
#include "text/numbers.hpp"

namespace hal {
namespace {

using Text = TextWriter;

bool is_of(const LoadedComponent& threads, const Thread* thread) {
    return thread && thread->component == &threads;
}

/// The threads that a load of `threads` made and a delthread removed again.
std::vector<std::string> deleted_threads(const Model& model, const LoadedComponent& threads,
                                         std::size_t load) {
    std::vector<std::string> deleted;
    for (const std::string& name : threads.loads[load].names) {
        const bool made_again =
            std::any_of(threads.loads.begin() + static_cast<std::ptrdiff_t>(load) + 1,
                        threads.loads.end(), [&](const Load& later) {
            return std::ranges::find(later.names, name) != later.names.end();
        });
        if (made_again || !is_of(threads, model.find_thread(name))) {
            deleted.push_back(name);
        }
    }
    return deleted;
}

void new_thread(Text& text, const Thread& thread) {
    const ThreadOptions& o = thread.options;
    text.add("newthread {} {}", thread.name, o.period_ns);
    if (o.cpu >= 0) {
        text.add(" cpu={}", o.cpu);
    }
    if (o.policy == Policy::deadline) {
        text.add(" policy=deadline");
    }
    if (o.policy == Policy::other) {
        text.add(" policy=other");
    }
    if (o.priority != 0) {
        text.add(" priority={}", o.priority);
    }
    if (o.spin_ns >= 0) {
        text.add(" spin={}ns", o.spin_ns);
    }
    if (o.budget_ns > 0) {
        text.add(" budget={}ns", o.budget_ns);
    }
    if (o.supervise_ns == 0) {
        text.add(" supervise=off");
    }
    if (o.supervise_ns > 0) {
        text.add(" supervise={}ns", o.supervise_ns);
    }
    if (o.profile_every) {
        text.add(" profile=every");
    }
    text.add("\n");
}

/// The instances that one loadrt made, without those that were unloaded.
std::vector<const Instance*> remaining(const LoadedComponent& component, std::size_t load) {
    std::vector<const Instance*> all;
    for (const auto& instance : component.instances) {
        if (instance->load == load) {
            all.push_back(instance.get());
        }
    }
    return all;
}

/// Returns true for `mux-gen.07` and 7.
bool has_number(std::string_view instance, std::size_t number) {
    const std::size_t digits = instance.rfind('.') + 1;
    const std::size_t first = std::min(instance.find_first_not_of('0', digits), instance.size());
    const std::string_view shown = first == instance.size() ? "0" : instance.substr(first);
    return digits > 0 && digits < instance.size() && shown == std::to_string(number);
}

/// True when no instance was unloaded that has a number in place of a name.
bool has_all_numbered(const LoadedComponent& component) {
    std::size_t number = 0;
    for (const auto& instance : component.instances) {
        if (component.loads[instance->load].names.empty() &&
            !has_number(instance->name, number++)) {
            return false;
        }
    }
    return number == component.next_number;
}

/// Returns the elements of a comma list that belong to these instances; nothing when the list is
/// too short for all of them.
std::optional<std::string> elements_of(std::string_view list,
                                       const std::vector<const Instance*>& instances) {
    std::vector<std::string_view> elements;
    for (std::size_t from = 0; from <= list.size();) {
        const std::size_t end = std::min(list.find(',', from), list.size());
        elements.push_back(list.substr(from, end - from));
        from = end + 1;
    }
    std::optional<std::string> text;
    for (const Instance* const instance : instances) {
        if (instance->number >= elements.size()) break;
        text = text ? *text + "," : "";
        *text += elements[instance->number];
    }
    return text;
}

/// Returns the value that an argument has for what remains of its load; nothing when these
/// instances are made without it.
std::optional<std::string> value_for(const LoadArgument& argument,
                                     const std::vector<const Instance*>& instances) {
    switch (argument.use) {
    case LoadArgument::Use::common: return argument.value;
    case LoadArgument::Use::per_instance: return elements_of(argument.value, instances);
    case LoadArgument::Use::count: return std::nullopt;  // names= gives it
    }
    return std::nullopt;
}

/// " names=a,c personality=1,3": instead of the arguments as they were written, for what remains.
std::string arguments_for(const std::vector<const Instance*>& instances, const Load& load) {
    std::string names, personalities, text;
    for (const Instance* const instance : instances) {
        const char* const comma = names.empty() ? "" : ",";
        names += comma + instance->name;
        if (!load.personalities.empty()) {
            personalities +=
                comma + load.personalities[instance->number % load.personalities.size()];
        }
    }
    for (const auto& [name, argument] : load.arguments) {
        if (const auto value = value_for(argument, instances)) {
            text += " " + written(name + "=" + *value);
        }
    }
    return " names=" + names + (personalities.empty() ? "" : " personality=" + personalities) +
           text;
}

/// Returns true when a load of which something remains is saved as it was written: none of its
/// instances was unloaded.
bool is_complete(const LoadedComponent& component, std::size_t load, std::size_t remaining,
                 bool all_numbered) {
    constexpr auto one_only = HAL_COMPONENT_WHOLE_NAMES | HAL_COMPONENT_SINGLETON;
    if (component.plugin->flags & one_only) return true;
    const auto& names = component.loads[load].names;
    return names.empty() ? all_numbered : remaining == names.size();
}

/// A loadrt for each by which the component was loaded, as far as its instances remain.
void save_loads(Text& text, const Model& model, const LoadedComponent& component,
                const std::string& name) {
    const bool has_instances = component.plugin && !is_module(component);
    const bool all_numbered = has_instances && has_all_numbered(component);
    for (std::size_t i = 0; i < component.arguments.size(); ++i) {
        const std::string& arguments = component.arguments[i];
        const auto instances = remaining(component, i);
        if (has_instances && instances.empty()) continue;
        if (has_instances && !is_complete(component, i, instances.size(), all_numbered)) {
            text.add("loadrt {}{}\n", name, arguments_for(instances, component.loads[i]));
        } else if (arguments.empty()) {
            text.add("loadrt {}\n", name);
        } else {
            text.add("loadrt {} {}\n", name, arguments);
        }
        if (component.plugin) continue;
        for (const std::string& thread : deleted_threads(model, component, i)) {
            text.add("delthread {}\n", thread);
        }
    }
}

/// Returns true if a loaded LinuxCNC module has made the thread.
bool made_by_module(const Thread& thread, const Model& model) {
    if (!thread.made.known()) return false;
    return std::ranges::any_of(model.components, [&](const auto& component) {
        return is_module(*component) && component->loaded.source == thread.made.source &&
               component->loaded.begin == thread.made.begin;
    });
}

void save_comp(Context& context, Text& text) {
    const Model& model = context.session.model();
    text.add("# components\n");
    std::vector<const LoadedComponent*> oldest_first = components_newest_first(model, {});
    std::reverse(oldest_first.begin(), oldest_first.end());
    const std::vector<std::string> ours = context.session.host().available_components();
    const auto contains = [](const std::vector<std::string>& sorted, const std::string& name) {
        return std::binary_search(sorted.begin(), sorted.end(), name);
    };
    for (const LoadedComponent* const component : oldest_first) {
        if (component->process != 0) continue;
        const bool ambiguous = is_module(*component) && contains(ours, component->name);
        save_loads(text, model, *component, (ambiguous ? "--linuxcnc " : "") + component->name);
    }
    for (const auto& thread : model.threads) {  // fastest first, so that periods fit
        if (!thread->component && !made_by_module(*thread, model)) {
            new_thread(text, *thread);
        }
    }
}

void save_alias(Context& context, Text& text) {
    for (const bool parameters : {false, true}) {
        text.add("# {} aliases\n", parameters ? "param" : "pin");
        for (const Pin* const pin : pins_by_name(context.session, parameters, {})) {
            if (!pin->alias.empty()) {
                text.add("alias {} {} {}\n", parameters ? "param" : "pin", pin->name, pin->alias);
            }
        }
    }
}

void new_signal(Text& text, const Signal& signal) {
    text.add("newsig {} {:<5}\n", signal.name, name(signal.type));
}

/// Calls `save` for each signal by name, until the machine ends.
template <class Save>
void for_each_signal(Context& context, const Save& save) {
    for (const Signal* const signal : signals_by_name(context.session, {})) {
        if (context.session.ending()) return;
        save(*signal);
    }
}

void save_sig(Context& context, Text& text) {
    text.add("# signals\n");
    for_each_signal(context, [&](const Signal& signal) { new_signal(text, signal); });
}

void save_sigu(Context& context, Text& text) {
    text.add("# signals\n");
    for_each_signal(context, [&](const Signal& signal) {
        if (signal.pins.empty()) {
            new_signal(text, signal);
        }
    });
}

void save_links(Context& context, Text& text, bool arrows) {
    text.add("# links\n");
    for (const Pin* const pin : pins_by_name(context.session, false, {})) {
        if (context.session.ending()) return;
        if (pin->signal) {
            text.add("linkps {} {} {}\n", shown_name(*pin), arrows ? arrow_of_pin(*pin) : "",
                     pin->signal->name);
        }
    }
}

void save_link(Context& context, Text& text) { save_links(context, text, false); }
void save_linka(Context& context, Text& text) { save_links(context, text, true); }

std::vector<const Pin*> by_name(const Signal& signal) {
    std::vector<const Pin*> pins(signal.pins.begin(), signal.pins.end());
    std::sort(pins.begin(), pins.end(), [](const Pin* a, const Pin* b) {
        return natural_less(shown_name(*a), shown_name(*b));
    });
    return pins;
}

void save_nets(Context& context, Text& text, bool arrows) {
    text.add("# nets\n");
    for_each_signal(context, [&](const Signal& signal) {
        new_signal(text, signal);
        for (const Pin* const pin : by_name(signal)) {
            text.add("linksp {} {} {}\n", signal.name, arrows ? arrow_of_signal(*pin) : "",
                     shown_name(*pin));
        }
    });
}

void save_net(Context& context, Text& text) { save_nets(context, text, false); }
void save_neta(Context& context, Text& text) { save_nets(context, text, true); }

/// A line `net SIGNAL` for each signal with pins, which `save` completes.
template <class Save>
void save_joined(Context& context, Text& text, const Save& save) {
    text.add("# nets\n");
    for_each_signal(context, [&](const Signal& signal) {
        if (signal.pins.empty()) return;
        text.add("net {}", signal.name);
        save(text, by_name(signal));
        text.add("\n");
    });
}

void save_netl(Context& context, Text& text) {
    save_joined(context, text, [](Text& line, const std::vector<const Pin*>& pins) {
        for (const Pin* const pin : pins) {
            line.add(" {}", shown_name(*pin));
        }
    });
}

/// One line per signal: the writer, =>, the readers; or I/O pins with <=> between, then => and the
/// readers.
void save_netla(Context& context, Text& text) {
    save_joined(context, text, [](Text& line, std::vector<const Pin*> pins) {
        const auto readers = std::ranges::stable_partition(
            pins, [](const Pin* pin) { return pin->dir != HAL_DIR_IN; });
        for (auto pin = pins.begin(); pin != pins.end(); ++pin) {
            const char* arrow = "";
            if (pin != pins.begin() && pin < readers.begin() && (*pin)->dir == HAL_DIR_IO) {
                arrow = " <=>";
            } else if (pin != pins.begin() && pin == readers.begin()) {
                arrow = " =>";
            }
            line.add("{} {}", arrow, shown_name(**pin));
        }
    });
}

void save_values(Context& context, Text& text, const std::vector<const Pin*>& pins) {
    const auto values = context.session.values().read_pins(pins);
    for (std::size_t i = 0; i < pins.size(); ++i) {
        if (context.session.ending()) return;
        if (pins[i]->type != HAL_TYPE_PORT) {
            text.add("setp {} {:>20}\n", shown_name(*pins[i]),
                     saved_value(pins[i]->type, values[i]));
        }
    }
}

void save_param(Context& context, Text& text) {
    text.add("# parameter values\n");
    auto parameters = pins_by_name(context.session, true, {});
    std::erase_if(parameters,
                  [](const Pin* pin) { return pin->dir != HAL_DIR_PARAM || pin->read_only(); });
    save_values(context, text, parameters);
}

void save_unconnected(Context& context, Text& text) {
    text.add("# unconnected pin values\n");
    auto pins = pins_by_name(context.session, false, {});
    std::erase_if(pins, [](const Pin* pin) { return pin->signal || pin->dir == HAL_DIR_OUT; });
    save_values(context, text, pins);
}

/// Signals nobody writes keep what sets gave them.
void save_signal_values(Context& context, Text& text) {
    text.add("# signal values\n");
    auto signals = signals_by_name(context.session, {});
    std::erase_if(signals, [](const Signal* signal) {
        return signal->type == HAL_TYPE_PORT ? !signal->port : signal->writer || signal->ios > 0;
    });
    const auto values = context.session.values().read_signals(signals);
    for (std::size_t i = 0; i < signals.size(); ++i) {
        if (context.session.ending()) return;
        const Signal& signal = *signals[i];
        text.add("sets {} {:>20}\n", signal.name,
                 signal.type == HAL_TYPE_PORT ? std::to_string(signal.port->capacity)
                                              : saved_value(signal.type, values[i]));
    }
}

void save_thread(Context& context, Text& text) {
    text.add("# realtime thread/function links\n");
    for (const Thread* const thread : threads_slowest_first(context.session.model(), {})) {
        for (const LoadedFunction* const function : thread->init) {
            text.add("initf {} {}\n", function->name, thread->name);
        }
        for (const LoadedFunction* const function : thread->functions) {
            text.add("addf {} {}\n", function->name, thread->name);
        }
    }
}

struct Section {
    std::string_view name, also;
    void (*save)(Context&, Text&);
    bool in_all, in_allu;

    /// Returns whether `save WANTED` prints it.
    bool is_in(std::string_view wanted) const {
        if (wanted == "all") return in_all;
        if (wanted == "allu") return in_allu;
        return wanted == name || (!also.empty() && wanted == also);
    }
};

/// In the order of `save all`.
constexpr Section sections[] = {
    {"comp", "", save_comp, true, true},
    {"alias", "", save_alias, true, true},
    {"sigu", "", save_sigu, true, true},
    {"sig", "signal", save_sig, false, false},
    {"link", "", save_link, false, false},
    {"linka", "", save_linka, false, false},
    {"net", "", save_net, false, false},
    {"neta", "", save_neta, false, false},
    {"netl", "", save_netl, false, false},
    {"netla", "netal", save_netla, true, true},
    {"param", "parameter", save_param, true, true},
    {"unconnectedinpins", "", save_unconnected, false, true},
    {"signalvalues", "", save_signal_values, false, true},
    {"thread", "", save_thread, true, true},
};

}  // namespace

void command_save(Context& context) {
    const std::string_view wanted = context.argument_or(0, "all");
    Text text;
    bool known = false;
    for (const Section& section : sections) {
        if (!section.is_in(wanted)) continue;
        known = true;
        if (context.checking()) continue;
        section.save(context, text);
        if (context.interrupted()) return;
    }
    if (!known) {
        std::vector<std::string> names{"all", "allu"};
        for (const Section& section : sections) {
            names.emplace_back(section.name);
        }
        context.diagnostics.error(
            "unknown-word", context.span(0), "unknown kind '" + std::string(wanted) + "'",
            did_you_mean(wanted, names), "the choices are: " + listed(names, names.size()));
        return;
    }
    if (context.checking()) return;
    if (context.count() < 2) return context.output.out(text.text);
    if (const std::string problem = replace_file(context.path(context.argument(1)), text.text);
        !problem.empty()) {
        context.diagnostics.error("cannot-write", context.span(1),
                                  "'" + context.argument(1) + "' cannot be written: " + problem);
    }
}

}  // namespace hal
