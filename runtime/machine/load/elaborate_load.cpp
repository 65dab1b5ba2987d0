// SPDX-License-Identifier: MIT
// The edits that load, unload and reload components.
#include "machine/load/elaborate.hpp"

#include <algorithm>
#include <array>

#include "machine/load/construct.hpp"
#include "machine/load/described_modules.hpp"
#include "machine/load/module_library.hpp"
#include "machine/load/thread_options.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

using edits::Args;

// of one loadrt; a slip of the finger must not take all memory
constexpr std::uint64_t max_instances = 200'000;

std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    for (std::size_t at; (at = text.find(',', from)) != std::string::npos; from = at + 1) {
        parts.push_back(text.substr(from, at - from));
    }
    parts.push_back(text.substr(from));
    return parts;
}

std::string unquoted(std::string text) {
    text.erase(std::remove(text.begin(), text.end(), '"'), text.end());
    if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') {
        text = text.substr(1, text.size() - 2);
    }
    return text;
}

void load_threads(Elaboration& on, const Token& name, Args args, const std::string& written) {
    std::vector<NewThread> threads;
    if (!parse_threads(args, name.span, threads, on.diagnostics)) {
        for (const Token& token : args) {
            if (token.text.starts_with("name")) {
                on.edit.absences().note(token.text.substr(token.text.find('=') + 1));
            }
        }
        return;
    }
    LoadedComponent* component = on.model.find_component("threads");
    if (!component) {
        component = &on.edit.add_component("threads", name.span);
    }
    Load load;
    for (const NewThread& thread : threads) {
        load.names.push_back(thread.name);
    }
    on.edit.note_arguments(*component, written, std::move(load));
    for (NewThread& thread : threads) {
        fit_period(on.model, thread, on.diagnostics);
        if (Thread* const made = on.edit.add_thread({thread.name, thread.at}, thread.options)) {
            made->component = component;
        }
    }
}

// count=, names= … are the component's own arguments: it names its pins itself.
bool names_itself(Elaboration& on, const Token& name, Origin origin) {
    if (const LoadedComponent* const loaded = on.model.find_component(name.text)) {
        return loaded->plugin && (loaded->plugin->flags & HAL_COMPONENT_WHOLE_NAMES);
    }
    Diagnostics ignored;
    const auto plugin = open_component(on.plugins, name.text, origin, name.span, ignored);
    return plugin && (plugin->component->flags & HAL_COMPONENT_WHOLE_NAMES);
}

/// `count=` as LinuxCNC reads it: 0x10 and 010 are hexadecimal and octal, nothing is the default.
/// Returns false after reporting.
bool read_count(Elaboration& on, const Token& token, const std::string& key,
                const std::string& value, LoadRequest& request) {
    if (value.empty()) return true;
    request.count_at = token.span;
    const Parsed number = parse_value(HAL_TYPE_U64, value);
    if (number.problem.empty() && number.value.u64 >= 1 && number.value.u64 <= max_instances) {
        request.count = static_cast<std::int64_t>(number.value.u64);
        return true;
    }
    const std::string range = "1.." + std::to_string(max_instances);
    const bool digits_only = value.find_first_not_of("0123456789") == value.npos;
    const bool too_many =
        number.problem.empty() ? number.value.u64 > max_instances : digits_only && value[0] != '0';
    if (too_many) {
        on.diagnostics.error("bad-argument", token.span,
                             key + "=" + value + " exceeds the limit of " +
                                 std::to_string(max_instances) + " instances per loadrt",
                             range);
    } else {
        on.diagnostics.error("bad-argument", token.span,
                             hal::quoted(value) + " is not a number of instances", range);
    }
    return false;
}

/// Sorts the arguments of one loadrt: those that name or count instances, and the component's own.
class RequestReader {
public:
    RequestReader(Elaboration& on, const Token& name, Origin origin, LoadRequest& request)
        : on_(on), name_(name), origin_(origin), request_(request) {
        request.at = name.span;
        request.on = &on;
        request.faults = on.faults;
    }

    /// Returns false after reporting.
    bool read(Args args) {
        bool good = true;
        for (const Token& token : args) {
            good = read_argument(token) && good;
        }
        return check_names_or_count() && good;
    }

private:
    bool read_argument(const Token& token) {
        const auto equals = token.text.find('=');
        if (equals == std::string::npos || equals == 0) {
            return error(token, hal::quoted(token.text) + " is not an argument", "",
                         "arguments are written NAME=VALUE, without blanks around the =");
        }
        const std::string key = token.text.substr(0, equals);
        const std::string value = unquoted(token.text.substr(equals + 1));
        const bool is_of_loadrt =
            key == "names" || key == "count" || key == "num_chan" || key == "personality";
        if (!is_of_loadrt || names_itself(on_, name_, origin_)) {
            return read_own(token, key, value);
        }
        if (key == "names") return read_names(token, value);
        if (key == "personality") {
            request_.personalities = split_list(value);
            return true;
        }
        return read_count(on_, token, key, value, request_);
    }

    bool read_names(const Token& token, const std::string& value) {
        names_at_ = token.span;
        request_.names = split_list(value);
        if (request_.names.size() > 1 && request_.names.back().empty()) {
            request_.names.pop_back();  // names=a,b, as real files have it
        }
        bool good = true;
        for (const std::string& one : request_.names) {
            if (one.empty()) {
                good = error(token, "names= lists an empty name", "",
                             "write names=first,second without blanks");
            } else {
                good = on_.edit.check_name("instance", {one, token.span}) && good;
            }
        }
        return good;
    }

    bool read_own(const Token& token, const std::string& key, const std::string& value) {
        const bool is_new =
            request_.arguments.emplace(key, GivenArgument{value, token.span}).second;
        return is_new || error(token, "argument '" + key + "' is given twice", "second time");
    }

    bool check_names_or_count() {
        if (request_.names.empty() || request_.count < 0) return true;
        Diagnostic d{Severity::error,
                     "names-and-count",
                     "names= and count= are both given",
                     {{request_.count_at, "how many"}, {names_at_, "and which"}},
                     {"remove count=; names= also gives the number of instances"}};
        on_.diagnostics.add(std::move(d));
        return false;
    }

    /// Always returns false.
    bool error(const Token& token, const std::string& message, const std::string& label,
               const std::string& help = "") {
        on_.diagnostics.error("bad-argument", token.span, message, label, help);
        return false;
    }

    Elaboration& on_;
    const Token& name_;
    Origin origin_;
    LoadRequest& request_;
    Span names_at_;
};

/// Returns false after reporting what stands against loading a component that is loaded already.
bool may_load_again(Elaboration& on, const Token& name, Origin origin,
                    const LoadedComponent& component) {
    if (is_module(component)) {
        on.diagnostics.error(
            "name-taken", name.span,
            hal::quoted(name.text) +
                " is a LinuxCNC module, which is loaded once, and it is already loaded",
            "", "for other arguments: unloadrt " + component.name + ", then loadrt again");
        return false;
    }
    if (origin != Origin::linuxcnc) return true;
    on.diagnostics.error(
        "name-taken", name.span,
        "the component " + hal::quoted(name.text) + " of this runtime is already loaded", "",
        "unloadrt " + component.name + " first, or leave out --linuxcnc");
    return false;
}

bool make_instances(Elaboration& on, const Token& name, Origin origin, const LoadRequest& request,
                    const std::string& written) {
    LoadedComponent* component = on.model.find_component(name.text);
    if (component && !component->plugin && component->process == 0) {
        on.diagnostics.error("name-taken", name.span,
                             hal::quoted(name.text) + " of this runtime is already loaded", "",
                             "create all threads with one of them: leave out --linuxcnc");
        return false;
    }
    if (component && !component->plugin) {
        on.diagnostics.error("name-taken", name.span,
                             hal::quoted(name.text) + " is a program started by loadusr");
        return false;
    }
    if (component && !may_load_again(on, name, origin, *component)) return false;
    if (!component) {
        auto plugin = open_component(on.plugins, name.text, origin, name.span, on.diagnostics);
        if (!plugin) return false;
        component = &on.edit.add_component(plugin->component->name, name.span);
        component->plugin = plugin->component;
        component->library = plugin->library;
        component->path = plugin->path;
        // LinuxCNC's modules call each other: the functions of one use the pins of another, such as
        // a kinematics module
        component->shares_pins = is_module(*component);
    }
    Load load;
    for (const auto& [key, given] : request.arguments) {
        load.arguments.emplace(key, LoadArgument{given.value});
    }
    load.names = request.names;
    load.personalities = request.personalities;
    on.edit.note_arguments(*component, written, std::move(load));
    return construct(on.model, on.edit, *component, request, on.sources, on.diagnostics);
}

/// Takes --native or --linuxcnc from the front of the arguments. Returns false after reporting.
bool take_origin(Elaboration& on, Args& args, Origin& origin) {
    Span option{};
    while (!args.empty() && (args[0].text == "--native" || args[0].text == "--linuxcnc")) {
        const Origin wanted = args[0].text == "--native" ? Origin::native : Origin::linuxcnc;
        if (origin != Origin::any && origin != wanted) {
            Diagnostic d{
                Severity::error,
                "wrong-arguments",
                "--native and --linuxcnc are both given: a component is taken from one place",
                {{args[0].span, "and the other"}, {option, "one option"}},
                {"loadrt --native NAME loads Halcyon's component, loadrt --linuxcnc NAME "
                 "LinuxCNC's module"}};
            on.diagnostics.add(std::move(d));
            return false;
        }
        origin = wanted;
        option = args[0].span;
        args = args.subspan(1);
    }
    if (args.empty()) {
        on.diagnostics.error("wrong-arguments", option,
                             "the name of a component is missing after the option", "",
                             "loadrt --linuxcnc NAME");
        return false;
    }
    const std::string preference = origin == Origin::any ? meaningless_preference() : "";
    if (preference.empty()) return true;
    on.diagnostics.error("wrong-arguments", args[0].span,
                         "HALCYON_MODULES is " + hal::quoted(preference) +
                             " in the environment of the machine; its only value is 'linuxcnc'",
                         "",
                         "unset HALCYON_MODULES, or export HALCYON_MODULES=linuxcnc to load "
                         "LinuxCNC's modules first; then start the machine again");
    return false;
}

/// `hal check` does not run a module: it may access hardware. So neither its arguments nor what
/// names its pins is checked.
bool is_unchecked(Elaboration& on, const Token& name, Origin origin) {
    Diagnostics ignored;
    const auto plugin = open_component(on.plugins, name.text, origin, name.span, ignored);
    return plugin && (plugin->component->flags & HAL_COMPONENT_MODULE);
}

/// LinuxCNC's drivers of Mesa cards: they use symbols of hostmot2.
constexpr std::array<std::string_view, 8> hostmot2_drivers{
    "hm2_7i43", "hm2_7i90", "hm2_eth", "hm2_pci", "hm2_rpspi", "hm2_spi", "hm2_spix", "hm2_test"};

/// What a module would report when it runs: that the module whose symbols it uses is not loaded.
void check_module_order(Elaboration& on, const Token& name) {
    constexpr const char* needed = "hostmot2";
    if (std::ranges::find(hostmot2_drivers, name.text) == hostmot2_drivers.end()) return;
    if (on.edit.absences().is_assumed(needed)) return;
    on.diagnostics.error("construct-failed", name.span,
                         "module " + hal::quoted(name.text) + " uses " + hal::quoted(needed) +
                             ", which is not loaded before it",
                         "", std::string("load that first: loadrt ") + needed);
}

/// Returns true after reporting that a loaded module uses symbols of this one.
bool is_used(Elaboration& on, const LoadedComponent& component, Span at) {
    if (!is_module(component)) return false;
    std::string users, commands;
    for (std::size_t i = 0;; ++i) {
        const std::string user = user_of_module(*component.plugin, i);
        if (user.empty()) break;
        if (!on.model.find_component(user)) {
            continue;  // unloaded in the same transaction
        }
        append_item(users, user);
        commands += (commands.empty() ? "unloadrt " : ", then unloadrt ") + user;
    }
    if (users.empty()) return false;
    on.diagnostics.error(
        "module-in-use", at,
        hal::quoted(component.name) + " cannot be unloaded: its code is used by " + users, "",
        "unload what uses it first: " + commands);
    return true;
}

LoadedComponent* loaded_component(Elaboration& on, const Token& name) {
    LoadedComponent* const component = on.model.find_component(name.text);
    if (component) return component;
    std::vector<std::string> loaded;
    for (const auto& one : on.model.components) {
        loaded.push_back(one->name);
    }
    on.diagnostics.error("no-such-component", name.span,
                         "component " + hal::quoted(name.text) + " is not loaded",
                         did_you_mean(name.text, loaded),
                         loaded.empty() ? "no component is loaded" : "loaded: " + listed(loaded));
    return nullptr;
}

/// Returns where a component that names no origin comes from: one that is loaded keeps its own.
Origin origin_of(const Elaboration& on, const Token& name, Origin written) {
    if (written != Origin::any) return written;
    const LoadedComponent* const loaded = on.model.find_component(name.text);
    return loaded && !is_module(*loaded) ? written : usual_origin(name.text);
}

/// Returns why it is accepted that nothing is made of a component; none: it must be found.
std::optional<Absences::Cause> accepted_absence(Elaboration& on, const Token& name, Origin origin,
                                                bool known) {
    Absences& absences = on.edit.absences();
    std::optional<Absences::Cause> cause;
    if (!known || origin == Origin::linuxcnc || on.check_only) {
        cause = absences.assumed(name.text);
    }
    if (cause || !on.check_only || !is_unchecked(on, name, origin)) return cause;
    check_module_order(on, name);
    absences.assume(name.text);
    return absences.assumed(name.text);
}

/// Returns why nothing was made of a component: the first error after `before` diagnostics, or else
/// that its hardware may not be accessed.
Absences::Cause cause_of_failure(Elaboration& on, const Token& name, const LoadRequest& request,
                                 std::size_t before) {
    // without names= the instances may have any name: that of a card, for example
    const auto scope = request.names.empty() ? Absences::Scope::component : Absences::Scope::names;
    const auto reported = std::span(on.diagnostics.all()).subspan(before);
    const auto error = std::ranges::find(reported, Severity::error, &Diagnostic::severity);
    if (error == reported.end()) {
        return on.edit.absences().add(hal::quoted(name.text),
                                      "whose hardware is not contacted here", {}, scope);
    }
    const Span at = error->labels.empty() ? name.span : error->labels[0].span;
    return on.edit.absences().add("component " + hal::quoted(name.text), "which is missing", at,
                                  scope);
}

/// Notes the names of a component of which nothing was made.
void note_absence(Elaboration& on, const Token& name, const LoadRequest& request,
                  Absences::Cause cause) {
    Absences& absences = on.edit.absences();
    const bool has_names = !request.names.empty();
    for (const std::string& instance : request.names) {
        absences.note(instance, cause);
    }
    if (has_names) return;
    absences.note(name.text, cause);
    absences.note(dashed(name.text), cause);
    const bool may_home_joints = name.text.find("home") != std::string::npos;
    if (may_home_joints) {
        absences.note("joint", cause);
    }
}

/// `hal check`: declares what a module of LinuxCNC has that does not run here. Returns false when
/// that is unknown.
bool describe_module(Elaboration& on, const Token& name, const LoadRequest& request,
                     const std::string& written) {
    const hal_component* const description = on.check_only ? description_of(name.text) : nullptr;
    if (description == nullptr || on.model.find_component(name.text) != nullptr) return false;
    LoadedComponent& component = on.edit.add_component(description->name, name.span);
    component.plugin = description;
    component.shares_pins = true;
    Load load;
    for (const auto& [key, given] : request.arguments) {
        load.arguments.emplace(key, LoadArgument{given.value});
    }
    on.edit.note_arguments(component, written, std::move(load));
    if (!construct(on.model, on.edit, component, request, on.sources, on.diagnostics)) return false;
    if (name.text == "motmod") {
        on.edit.absences().add("programs of LinuxCNC", "which are not started here", {},
                               Absences::Scope::component);
    }
    return true;
}

}  // namespace

/// `loadrt NAME ARGUMENT…`: makes the instances of a component, or threads. The names of a
/// component that is missing are noted as absent, so that lines that use them cause no further
/// errors.
void edits::loadrt(Elaboration& on, Args args) {
    Origin origin = Origin::any;
    if (!take_origin(on, args, origin)) return;
    const Token& name = args[0];
    const Args arguments = args.subspan(1);
    origin = origin_of(on, name, origin);
    std::string text;
    for (const Token& token : arguments) {
        append_item(text, written(token.text), " ");
    }
    if (name.text == "threads" && origin != Origin::linuxcnc) {
        return load_threads(on, name, arguments, text);
    }
    LoadRequest request;
    const bool known = on.model.find_component(name.text) || !on.plugins.find(name.text).empty();
    const auto cause = accepted_absence(on, name, origin, known);
    const std::size_t before = on.diagnostics.all().size();
    const bool readable = RequestReader(on, name, origin, request).read(arguments);
    if (readable && !cause && make_instances(on, name, origin, request, text)) return;
    if (readable && describe_module(on, name, request, text)) {
        if (cause) {
            on.edit.absences().narrow(*cause);
        }
        return;
    }
    note_absence(on, name, request, cause ? *cause : cause_of_failure(on, name, request, before));
}

/// `unloadrt NAME`: removes a component with its instances, one instance, or with `all` everything
/// but programs.
void edits::unload(Elaboration& on, Args args) {
    if (args[0].text == "all") {
        for (std::size_t i = on.model.components.size(); i-- > 0;) {
            LoadedComponent& component = *on.model.components[i];
            if (component.process == 0 && component.name != "threads") {
                on.edit.remove_component(component);
            }
        }
        while (!on.model.threads.empty()) {
            on.edit.remove_thread({on.model.threads.back()->name, args[0].span});
        }
        if (LoadedComponent* const threads = on.model.find_component("threads")) {
            on.edit.remove_component(*threads);
        }
        return;
    }
    if (Instance* const instance = on.model.find_instance(args[0].text);
        instance && !on.model.find_component(args[0].text)) {
        LoadedComponent& component = *instance->component;
        if (is_used(on, component, args[0].span)) return;
        on.edit.remove_instance(*instance);
        if (component.instances.empty()) {
            on.edit.remove_component(component);
        }
        return;
    }
    LoadedComponent* const component = loaded_component(on, args[0]);
    if (!component) return;
    if (component->process != 0) {
        on.diagnostics.error("is-a-program", args[0].span,
                             hal::quoted(args[0].text) + " is a program's component", "",
                             "unloadusr " + component->name + " ends it");
        return;
    }
    if (is_used(on, *component, args[0].span)) return;
    if (component->name == "threads" && !component->plugin) {
        for (std::size_t i = on.model.threads.size(); i-- > 0;) {
            if (on.model.threads[i]->component == component) {
                on.edit.remove_thread({on.model.threads[i]->name, args[0].span});
            }
        }
    }
    on.edit.remove_component(*component);
}

/// `reload NAME`: replaces the code of a component. All instances are constructed again from the
/// file as it is now, beside the model, and only when that succeeds exchanged for the old ones;
/// pins, links and values stay.
void edits::reload(Elaboration& on, Args args) {
    const Token& name = args[0];
    if (const Instance* const instance = on.model.find_instance(name.text);
        instance && !on.model.find_component(name.text)) {
        on.diagnostics.error("no-such-component", name.span,
                             hal::quoted(name.text) +
                                 " is an instance; a component is reloaded with all its instances",
                             "", "reload " + instance->component->name);
        return;
    }
    LoadedComponent* const component = loaded_component(on, name);
    if (!component) return;
    if (!component->plugin) {
        on.diagnostics.error("no-such-component", name.span,
                             component->process != 0
                                 ? hal::quoted(name.text) + " is a program, not a plugin"
                                 : hal::quoted(name.text) + " belongs to the runtime",
                             "",
                             component->process != 0 ? "unload it and start it again by loadusr"
                                                     : "its threads are removed by delthread");
        return;
    }
    if (is_module(*component)) {
        on.diagnostics.error(
            "reload-conflict", name.span,
            hal::quoted(name.text) +
                " is a LinuxCNC module, whose static variables allow one copy at a time",
            "", "unloadrt " + component->name + ", then loadrt again");
        return;
    }
    // a component of ours is not replaced by a module of its name
    auto plugin = open_component(on.plugins, name.text, Origin::native, name.span, on.diagnostics);
    if (!plugin) return;
    if (std::string_view(plugin->component->name) != component->name) {
        on.diagnostics.error(
            "reload-conflict", name.span,
            "'" + plugin->path + "' holds component '" + plugin->component->name + "' now, not '" +
                component->name + "'",
            "", "load it beside the old one: loadrt " + std::string(plugin->component->name));
        return;
    }
    // constructed beside the model; what was made and is not taken over is destroyed here
    Model beside = on.model.beside();
    Edit making(beside);
    LoadedComponent& fresh = making.add_component(component->name, name.span);
    fresh.plugin = plugin->component;
    fresh.library = plugin->library;
    fresh.path = plugin->path;
    struct Undo {
        LoadedComponent& component;
        bool taken = false;
        ~Undo() {
            if (taken) return;
            for (auto it = component.instances.rbegin(); it != component.instances.rend(); ++it) {
                destroy_instance(**it);
            }
        }
    } undo{fresh};
    const bool made = construct_again(beside, making, *component, fresh, name.span, on.faults,
                                      on.sources, on.diagnostics);
    on.model.next_id = beside.next_id;
    if (made) {
        undo.taken = on.edit.replace(*component, beside.components.front(), name.span);
    }
}

}  // namespace hal
