// SPDX-License-Identifier: MIT
#include "session/elaborate.hpp"

#include <algorithm>
#include <charconv>
#include <span>

#include "base/words.hpp"
#include "model/order.hpp"
#include "session/construct.hpp"
#include "session/thread_options.hpp"

namespace hal {
namespace {

using Args = std::span<const Token>;

Word word(const Token& token) { return {token.text, token.span}; }

std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    for (std::size_t at; (at = text.find(',', from)) != std::string::npos; from = at + 1) parts.push_back(text.substr(from, at - from));
    parts.push_back(text.substr(from));
    return parts;
}

std::string unquoted(std::string text) {
    text.erase(std::remove(text.begin(), text.end(), '"'), text.end());
    if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') text = text.substr(1, text.size() - 2);
    return text;
}

void load_threads(Elaboration& on, const Token& name, Args args, const std::string& written) {
    std::vector<NewThread> threads;
    if (!parse_threads(args, name.span, threads, on.diagnostics)) {
        for (const Token& token : args)
            if (token.text.starts_with("name")) on.edit.note_absent(token.text.substr(token.text.find('=') + 1));
        return;
    }
    LoadedComponent* component = on.model.find_component("threads");
    if (!component) component = &on.edit.add_component("threads", name.span);
    on.edit.note_arguments(*component, written, {});
    for (NewThread& thread : threads) {
        fit_period(on.model, thread, on.diagnostics);
        if (Thread* const made = on.edit.add_thread({thread.name, thread.at}, thread.options)) made->component = component;
    }
}

// count=, names= … are the component's own arguments: it names its pins itself.
bool names_itself(Elaboration& on, const Token& name) {
    if (const LoadedComponent* const loaded = on.model.find_component(name.text))
        return loaded->plugin && (loaded->plugin->flags & HAL_COMPONENT_WHOLE_NAMES);
    Diagnostics ignored;
    const auto plugin = on.plugins.open(name.text, name.span, ignored);
    return plugin && (plugin->component->flags & HAL_COMPONENT_WHOLE_NAMES);
}

/// The arguments of loadrt that say which instances there shall be, and the others; false after saying what is wrong.
bool read_request(Elaboration& on, const Token& name, Args args, LoadRequest& request) {
    request.at = name.span;
    bool good = true;
    Span names_at;
    for (const Token& token : args) {
        const auto equals = token.text.find('=');
        if (equals == std::string::npos || equals == 0) {
            on.diagnostics.error("bad-argument", token.span, quoted(token.text) + " is not an argument", "",
                                 "arguments are written NAME=VALUE, without blanks around the =");
            good = false;
            continue;
        }
        const std::string key = token.text.substr(0, equals), value = unquoted(token.text.substr(equals + 1));
        const bool says_instances =
            (key == "names" || key == "count" || key == "num_chan" || key == "personality") && !names_itself(on, name);
        if (says_instances && key == "names") {
            request.names = split_list(value);
            names_at = token.span;
            for (const std::string& one : request.names)
                if (one.empty()) {
                    on.diagnostics.error("bad-argument", token.span, "names= lists an empty name", "",
                                         "write names=first,second without blanks");
                    good = false;
                }
        } else if (says_instances && key != "personality") {
            const auto [end, problem] = std::from_chars(value.data(), value.data() + value.size(), request.count);
            request.count_at = token.span;
            if (problem != std::errc{} || end != value.data() + value.size() || request.count < 1 || request.count > 10'000'000) {
                on.diagnostics.error("bad-argument", token.span, quoted(value) + " is not a number of instances", "1 or more");
                good = false;
            }
        } else if (says_instances) {
            request.personalities = split_list(value);
        } else if (!request.arguments.emplace(key, GivenArgument{value, token.span}).second) {
            on.diagnostics.error("bad-argument", token.span, "argument '" + key + "' is given twice", "second time");
            good = false;
        }
    }
    if (!request.names.empty() && request.count >= 0) {
        Diagnostic d{Severity::error,
                     "names-and-count",
                     "names= and count= are both given",
                     {{request.count_at, "how many"}, {names_at, "and which"}},
                     {"keep names=, it says how many there are"}};
        on.diagnostics.add(std::move(d));
        good = false;
    }
    return good;
}

bool make_instances(Elaboration& on, const Token& name, const LoadRequest& request, const std::string& written) {
    LoadedComponent* component = on.model.find_component(name.text);
    if (component && !component->plugin) {
        on.diagnostics.error("name-taken", name.span, quoted(name.text) + " is a program started by loadusr");
        return false;
    }
    if (!component) {
        auto plugin = on.plugins.open(name.text, name.span, on.diagnostics);
        if (!plugin) return false;
        component = &on.edit.add_component(plugin->component->name, name.span);
        component->plugin = plugin->component;
        component->library = plugin->library;
        component->path = plugin->path;
    }
    Load load;
    for (const auto& [key, given] : request.arguments) load.arguments.emplace(key, given.value);
    load.personalities = request.personalities;
    on.edit.note_arguments(*component, written, std::move(load));
    return construct(on.model, on.edit, *component, request, on.sources, on.diagnostics);
}

void loadrt(Elaboration& on, const Command&, Args args) {
    std::string written;
    for (const Token& token : args.subspan(1)) written += (written.empty() ? "" : " ") + token.text;
    if (args[0].text == "threads") return load_threads(on, args[0], args.subspan(1), written);
    LoadRequest request;
    if (read_request(on, args[0], args.subspan(1), request) && make_instances(on, args[0], request, written)) return;
    for (const std::string& name : request.names) on.edit.note_absent(name);
    if (!request.names.empty()) return;
    on.edit.note_absent(args[0].text);
    on.edit.note_absent(dashed(args[0].text));
}

LoadedComponent* loaded_component(Elaboration& on, const Token& name) {
    LoadedComponent* const component = on.model.find_component(name.text);
    if (component) return component;
    std::vector<std::string> loaded;
    for (const auto& one : on.model.components) loaded.push_back(one->name);
    on.diagnostics.error("no-such-component", name.span, "there is no component " + quoted(name.text) + " here",
                         did_you_mean(name.text, loaded), loaded.empty() ? "nothing is loaded" : "loaded: " + listed(loaded));
    return nullptr;
}

void unload(Elaboration& on, const Command&, Args args) {
    if (args[0].text == "all") {
        for (std::size_t i = on.model.components.size(); i-- > 0;) {
            LoadedComponent& component = *on.model.components[i];
            if (component.process == 0 && component.name != "threads") on.edit.remove_component(component);
        }
        while (!on.model.threads.empty()) on.edit.remove_thread({on.model.threads.back()->name, args[0].span});
        if (LoadedComponent* const threads = on.model.find_component("threads")) on.edit.remove_component(*threads);
        return;
    }
    if (Instance* const instance = on.model.find_instance(args[0].text); instance && !on.model.find_component(args[0].text)) {
        LoadedComponent& component = *instance->component;
        on.edit.remove_instance(*instance);
        if (component.instances.empty()) on.edit.remove_component(component);
        return;
    }
    LoadedComponent* const component = loaded_component(on, args[0]);
    if (!component) return;
    if (component->process != 0) {
        on.diagnostics.error("is-a-program", args[0].span, quoted(args[0].text) + " is a program's component", "",
                             "unloadusr " + component->name + " ends it");
        return;
    }
    if (component->name == "threads")
        for (std::size_t i = on.model.threads.size(); i-- > 0;)
            if (on.model.threads[i]->component == component) on.edit.remove_thread({on.model.threads[i]->name, args[0].span});
    on.edit.remove_component(*component);
}

void reload(Elaboration& on, const Command&, Args args) {
    const Token& name = args[0];
    if (const Instance* const instance = on.model.find_instance(name.text); instance && !on.model.find_component(name.text)) {
        on.diagnostics.error("no-such-component", name.span,
                             quoted(name.text) + " is an instance; a component is reloaded with all its instances", "",
                             "reload " + instance->component->name);
        return;
    }
    LoadedComponent* const component = loaded_component(on, name);
    if (!component) return;
    if (!component->plugin) {
        on.diagnostics.error(
            "no-such-component", name.span,
            component->process != 0 ? quoted(name.text) + " is a program, not a plugin" : quoted(name.text) + " belongs to the runtime", "",
            component->process != 0 ? "unload it and start it again by loadusr" : "its threads are removed by delthread");
        return;
    }
    auto plugin = on.plugins.open(name.text, name.span, on.diagnostics);
    if (!plugin) return;
    if (std::string_view(plugin->component->name) != component->name) {
        on.diagnostics.error("reload-conflict", name.span,
                             "'" + plugin->path + "' holds component '" + plugin->component->name + "' now, not '" + component->name + "'",
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
            for (auto it = component.instances.rbegin(); it != component.instances.rend(); ++it) destroy_instance(**it);
        }
    } undo{fresh};
    const bool made = construct_again(beside, making, *component, fresh, name.span, on.sources, on.diagnostics);
    on.model.next_id = beside.next_id;
    if (made) undo.taken = on.edit.replace(*component, beside.components.front(), name.span);
}

void newthread(Elaboration& on, const Command&, Args args) {
    NewThread thread;
    if (!parse_new_thread(args, thread, on.diagnostics)) return on.edit.note_absent(args[0].text);
    fit_period(on.model, thread, on.diagnostics);
    on.edit.add_thread({thread.name, thread.at}, thread.options);
}

void delthread(Elaboration& on, const Command&, Args args) { on.edit.remove_thread(word(args[0])); }

void add_automatically(Elaboration& on, Args args) {
    Thread* const thread = on.edit.thread(word(args[0]));
    if (!thread) return;
    AutoOrder order{thread, {}, args[0].span};
    if (args.size() > 1) {
        for (const Token& token : args.subspan(1))
            if (on.edit.add_function(word(token), word(args[0]), -1, {}, false))
                order.functions.push_back(on.model.find_function(token.text));
    } else {
        for (const auto& component : on.model.components)
            for (const auto& function : component->functions)
                if (!function->thread && on.edit.add_function({function->name, args[0].span}, word(args[0]), -1, {}, false))
                    order.functions.push_back(function.get());
        if (order.functions.empty()) on.diagnostics.error("no-such-function", args[0].span, "there is no function that is in no thread");
    }
    if (!order.functions.empty()) on.auto_orders.push_back(std::move(order));
}

void place_function(Elaboration& on, Args args, bool init) {
    int position = -1;
    Span position_at;
    if (args.size() > 2) {
        const std::string& text = args[2].text;
        position_at = args[2].span;
        const char* const first = text.data() + (text.starts_with('+') ? 1 : 0);
        const auto [end, problem] = std::from_chars(first, text.data() + text.size(), position);
        if (problem != std::errc{} || end != text.data() + text.size()) {
            on.diagnostics.error("bad-position", position_at, quoted(text) + " is not a position", "", "1 is the first place, -1 the last");
            return;
        }
    }
    on.edit.add_function(word(args[0]), word(args[1]), position, position_at, init);
}

void addf(Elaboration& on, const Command& command, Args args) {
    if (args[0].text == "--auto") return add_automatically(on, args.subspan(1));
    if (args.size() > 3) {
        on.diagnostics.error("wrong-arguments", args[3].span, "addf takes at most 3 arguments", "", "addf FUNCTION THREAD [POSITION]");
        return;
    }
    (void)command;
    place_function(on, args, false);
}

void initf(Elaboration& on, const Command&, Args args) { place_function(on, args, true); }

void delf(Elaboration& on, const Command&, Args args) { on.edit.remove_function(word(args[0]), word(args[1])); }

void net(Elaboration& on, const Command&, Args args) {
    struct Wanted {
        Pin* pin;
        const Token* token;
        Arrow arrow;
    };
    std::vector<Wanted> wanted;
    bool unknown_type = false;
    Arrow arrow = Arrow::none;
    for (const Token& token : args.subspan(1)) {
        if (is_arrow(token.text)) {
            arrow = token.text == "=>" ? Arrow::to_pin : token.text == "<=" ? Arrow::from_pin : Arrow::both;
            continue;
        }
        if (Pin* const pin = on.edit.pin(word(token))) wanted.push_back({pin, &token, arrow});
        unknown_type |= on.edit.is_absent(token.text);
    }
    Signal* signal = on.model.find_signal(args[0].text);
    if (!signal && unknown_type) return on.edit.note_absent(args[0].text);
    if (!signal) {
        if (on.model.find_pin(args[0].text)) {
            on.diagnostics.error("signal-named-like-pin", args[0].span, "signal name " + quoted(args[0].text) + " is the name of a pin",
                                 "a pin", "write the signal's name first: net SIGNAL " + args[0].text);
            return;
        }
        if (wanted.empty()) {
            on.edit.note_absent(args[0].text);
            if (args.size() < 2)
                on.diagnostics.error("wrong-arguments", args[0].span, "net needs a pin to make a new signal", "", "net SIGNAL PIN…");
            return;
        }
        signal = on.edit.add_signal(word(args[0]), wanted.front().pin->type, wanted.front().token->span);
        if (!signal) return;
    }
    for (const Wanted& one : wanted) on.edit.link(*one.pin, *signal, word(*one.token), one.arrow);
}

void newsig(Elaboration& on, const Command&, Args args) {
    const auto type = type_named(args[1].text);
    if (!type) {
        std::vector<std::string> all;
        for (const TypeRow& row : types) all.emplace_back(row.name);
        on.diagnostics.error("no-such-type", args[1].span, "there is no type " + quoted(args[1].text), did_you_mean(args[1].text, all),
                             "types: " + listed(all));
        return;
    }
    on.edit.add_signal(word(args[0]), *type, args[1].span);
}

void delsig(Elaboration& on, const Command&, Args args) {
    if (args[0].text == "all") on.edit.remove_all_signals();
    else on.edit.remove_signal(word(args[0]));
}

void link(Elaboration& on, const Token& pin_token, const Token& signal_token) {
    Pin* const pin = on.edit.pin(word(pin_token));
    Signal* const signal = on.edit.signal(word(signal_token));
    if (pin && signal) on.edit.link(*pin, *signal, word(pin_token), Arrow::none);
}

void linkps(Elaboration& on, const Command&, Args args) { link(on, args[0], args[1]); }
void linksp(Elaboration& on, const Command&, Args args) { link(on, args[1], args[0]); }

void linkpp(Elaboration& on, const Command&, Args args) {
    Pin* const first = on.edit.pin(word(args[0]));
    Pin* const second = on.edit.pin(word(args[1]));
    if (!first || !second) return;
    // the signal carries the first pin's name, as LinuxCNC does it; here '-sig' keeps the two apart
    const std::string name = first->signal ? first->signal->name : first->name + "-sig";
    Signal* signal = on.model.find_signal(name);
    if (!signal) signal = on.edit.add_signal({name, args[0].span}, first->type, args[0].span);
    if (!signal) return;
    on.edit.link(*first, *signal, word(args[0]), Arrow::none);
    on.edit.link(*second, *signal, word(args[1]), Arrow::none);
}

void unlinkp(Elaboration& on, const Command&, Args args) {
    if (Pin* const pin = on.edit.pin(word(args[0]))) on.edit.unlink(*pin);
}

void setp(Elaboration& on, const Command&, Args args) { on.edit.set_pin(word(args[0]), word(args[1])); }
void sets(Elaboration& on, const Command&, Args args) { on.edit.set_signal(word(args[0]), word(args[1])); }
void alias(Elaboration& on, const Command&, Args args) { on.edit.alias(word(args[0]), word(args[1]), word(args[2])); }
void unalias(Elaboration& on, const Command&, Args args) { on.edit.unalias(word(args[0]), word(args[1])); }

struct Row {
    std::string_view name;
    std::size_t least, most;
    const char* usage;
    void (*run)(Elaboration&, const Command&, Args);
    bool drops_arrows = false;
};

constexpr std::size_t any = SIZE_MAX;

constexpr Row rows[] = {
    {"addf", 2, any, "addf FUNCTION THREAD [POSITION], or addf --auto THREAD [FUNCTION…]", addf},
    {"alias", 3, 3, "alias pin|param NAME ALIAS", alias},
    {"delf", 2, 2, "delf FUNCTION THREAD", delf},
    {"delsig", 1, 1, "delsig SIGNAL|all", delsig},
    {"delthread", 1, 1, "delthread THREAD", delthread},
    {"initf", 2, 3, "initf FUNCTION THREAD [POSITION]", initf},
    {"linkpp", 2, 2, "linkpp PIN PIN", linkpp, true},
    {"linkps", 2, 2, "linkps PIN SIGNAL", linkps, true},
    {"linksp", 2, 2, "linksp SIGNAL PIN", linksp, true},
    {"loadrt", 1, any, "loadrt COMPONENT [ARGUMENT=VALUE…]", loadrt},
    {"net", 1, any, "net SIGNAL PIN…", net},
    {"newsig", 2, 2, "newsig SIGNAL TYPE", newsig},
    {"newthread", 2, any,
     "newthread NAME PERIOD_NS [cpu=N] [policy=fifo|deadline|other] [priority=N] [spin=TIME] [budget=TIME] [profile=every]", newthread},
    {"reload", 1, 1, "reload COMPONENT", reload},
    {"setp", 2, 2, "setp PIN VALUE", setp},
    {"sets", 2, 2, "sets SIGNAL VALUE", sets},
    {"unalias", 2, 2, "unalias pin|param ALIAS", unalias},
    {"unlinkp", 1, 1, "unlinkp PIN", unlinkp},
    {"unload", 1, 1, "unload COMPONENT|INSTANCE|all", unload},
    {"unloadrt", 1, 1, "unloadrt COMPONENT|INSTANCE|all", unload},
};

const Row* find_row(const Command& command) {
    const auto at = std::find_if(std::begin(rows), std::end(rows), [&](const Row& row) { return row.name == command.name.text; });
    return at == std::end(rows) ? nullptr : at;
}

bool is_assignment(const Command& command) { return !command.args.empty() && command.args[0].text == "="; }

}  // namespace

bool is_edit(const Command& command) { return is_assignment(command) || find_row(command); }

void elaborate(Elaboration& on, const Command& command) {
    on.edit.diagnostics = &on.diagnostics;
    if (is_assignment(command)) {
        if (command.args.size() != 2)
            on.diagnostics.error("wrong-arguments", command.span, "an assignment takes one value", "", "PIN = VALUE");
        else
            on.edit.set_pin(word(command.name), word(command.args[1]));
        return;
    }
    const Row& row = *find_row(command);
    std::vector<Token> without_arrows;
    Args args = command.args;
    if (row.drops_arrows) {
        std::copy_if(command.args.begin(), command.args.end(), std::back_inserter(without_arrows),
                     [](const Token& t) { return !is_arrow(t.text); });
        args = without_arrows;
    }
    if (args.size() < row.least || args.size() > row.most) {
        const bool few = args.size() < row.least;
        const std::string bound =
            std::to_string(few ? row.least : row.most) + ((few ? row.least : row.most) == 1 ? " argument" : " arguments");
        const std::string how = row.least == row.most ? "" : few ? "at least " : "at most ";
        on.diagnostics.error("wrong-arguments", few ? command.name.span : args[row.most].span,
                             std::string(row.name) + " takes " + how + bound + ", not " + std::to_string(args.size()), "", row.usage);
        return;
    }
    row.run(on, command, args);
}

void apply_auto_order(Model&, Edit& edit, const std::vector<AutoOrder>& orders, Diagnostics& diagnostics) {
    for (const AutoOrder& order : orders) {
        std::vector<LoadedFunction*> there;
        for (LoadedFunction* function : order.functions)
            if (function->thread == order.thread) there.push_back(function);
        const std::vector<LoadedFunction*> sorted = dataflow_order(there, order.at, diagnostics);
        std::vector<LoadedFunction*> row = order.thread->functions;
        auto next = sorted.begin();
        for (LoadedFunction*& place : row)
            if (std::find(there.begin(), there.end(), place) != there.end()) place = *next++;
        edit.reorder(*order.thread, std::move(row));
    }
}

}  // namespace hal
