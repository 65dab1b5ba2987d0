// SPDX-License-Identifier: MIT
#include "commands/linuxcnc_check.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "commands/table.hpp"
#include "text/characters.hpp"
#include "text/quoting.hpp"

namespace hal {

namespace {

constexpr std::size_t max_name_length = 47;
// LinuxCNC makes a pin of this name for each function
constexpr std::string_view time_suffix = ".time";

/// Commands of ours that halcmd 2.9 does not have.
constexpr std::array<std::string_view, 12> own_commands{
    "abort", "advance",   "begin", "commit", "delthread", "explain",
    "fault", "newthread", "node",  "initf",  "journal",   "reload"};
/// What stands in the place of some of them.
std::string replacement_of(std::string_view command) {
    if (command == "newthread") return "loadrt threads name1=NAME period1=NS";
    if (command == "advance") return "loadusr -w sleep SECONDS";
    return {};
}

bool is_linuxcnc_bit(std::string_view word) {
    return word == "1" || word == "0" || same_word(word, "TRUE") || same_word(word, "FALSE");
}

bool is_linuxcnc_type(std::string_view word) {
    constexpr std::array<std::string_view, 5> names{"bit", "float", "s32", "u32", "port"};
    return std::any_of(names.begin(), names.end(),
                       [&](std::string_view name) { return same_word(word, name); });
}

/// NAME and VALUE of a command that sets something, or nullptr.
struct Setting {
    const Token *name = nullptr, *value = nullptr;
};
Setting setting_of(const Command& command) {
    if (command.args.size() != 2) {
        return {};
    }
    if (command.args[0].text == "=") {
        return {&command.name, &command.args[1]};
    }
    if (command.name.text == "setp" || command.name.text == "sets") {
        return {&command.args[0], &command.args[1]};
    }
    return {};
}

std::optional<hal_type> type_of(const std::string& name, const Model& model) {
    if (const Pin* const pin = model.find_pin(name)) return pin->type;
    if (const Signal* const signal = model.find_signal(name)) return signal->type;
    return std::nullopt;
}

void check_value(const Command& command, const Model& model, Diagnostics& diagnostics) {
    const Setting setting = setting_of(command);
    if (!setting.name || type_of(setting.name->text, model) != HAL_TYPE_BIT ||
        is_linuxcnc_bit(setting.value->text)) {
        return;
    }
    diagnostics.error("linuxcnc-value", setting.value->span,
                      "LinuxCNC 2.9 takes TRUE, FALSE, 1 or 0 for a bit, not " +
                          hal::quoted(setting.value->text));
}

void check_type(const Command& command, Diagnostics& diagnostics) {
    if (command.name.text != "newsig" || command.args.size() != 2 ||
        is_linuxcnc_type(command.args[1].text)) {
        return;
    }
    if (!type_named(command.args[1].text)) {
        return;  // an error here, too
    }
    diagnostics.error(
        "linuxcnc-value", command.args[1].span,
        "halcmd of LinuxCNC 2.9 creates no signal of type " + hal::quoted(command.args[1].text), "",
        "types: bit, float, s32, u32, port");
}

void check_range(const Command& command, Diagnostics& diagnostics) {
    constexpr std::array<std::string_view, 8> without{"print",  "echo", "help", "loadusr",
                                                      "source", "save", "show", "list"};
    if (std::find(without.begin(), without.end(), command.name.text) != without.end()) return;
    const auto check = [&](const Token& token) {
        Diagnostics ignored;
        const auto plain = expand({{"show", {}}, {token}, {}}, ignored);
        const bool is_range =
            plain.size() != 1 || plain[0].args.size() != 1 || plain[0].args[0].text != token.text;
        if (is_range) {
            diagnostics.error("linuxcnc-command", token.span,
                              "LinuxCNC has no ranges and sets of names: " +
                                  hal::quoted(token.text) + " is one name there",
                              "", "write a line for each name");
        }
        return is_range;
    };
    if (check(command.name)) return;
    for (const Token& token : command.args) {
        if (check(token)) return;
    }
}

void check_alias(const Command& command, const Model& model, Diagnostics& diagnostics) {
    const bool names_one = (command.name.text == "alias" && command.args.size() == 3) ||
                           (command.name.text == "unalias" && command.args.size() == 2);
    if (!names_one) return;
    const std::string& kind = command.args[0].text;
    const Pin* const pin = model.find_pin(command.args[1].text);
    if (!pin) return;
    const char* const wanted = pin->dir == HAL_DIR_PARAM ? "param" : "pin";
    if (kind != wanted) {
        diagnostics.error("linuxcnc-command", command.args[0].span,
                          hal::quoted(command.args[1].text) + " is a " +
                              (pin->dir == HAL_DIR_PARAM ? "parameter" : "pin") +
                              ": halcmd of LinuxCNC finds it only as one",
                          "", command.name.text + " " + wanted + " " + command.args[1].text);
    }
}

/// Options and arguments of ours, of commands that halcmd has.
void check_arguments(const Command& command, const Model& model, Diagnostics& diagnostics) {
    const std::string& verb = command.name.text;
    if (command.args.empty()) return;
    const Token& first = command.args[0];
    const auto unsupported = [&](const Token& token, const std::string& help) {
        diagnostics.error("linuxcnc-command", token.span,
                          verb + " of LinuxCNC has no option " + hal::quoted(token.text), "", help);
    };
    if (verb == "addf" && first.text == "--auto") {
        return unsupported(first, "write a line for each function: addf FUNCTION THREAD");
    }
    if (verb == "print" && command.args.size() > 1) {
        return diagnostics.error("linuxcnc-command", command.args[1].span,
                                 "print of LinuxCNC takes one argument", "",
                                 "write the text between quotes");
    }
    if (verb == "unloadrt" && !model.find_component(first.text) &&
        model.find_instance(first.text)) {
        return diagnostics.error("linuxcnc-command", first.span,
                                 "unloadrt of LinuxCNC unloads whole components: " +
                                     hal::quoted(first.text) + " is an instance");
    }
    if (verb != "loadusr" && verb != "waitusr") return;
    for (const Token& token : command.args) {
        if (!token.text.starts_with('-')) return;
        if (token.text == "-t" || token.text.starts_with("--restart")) {
            return unsupported(token, "");
        }
        if (token.text.ends_with('n')) {
            return;  // the next one is a name
        }
    }
}

/// The model keeps them by period.
std::vector<const Thread*> in_order_of_creation(const Model& model) {
    std::vector<const Thread*> all;
    for (const auto& thread : model.threads) {
        all.push_back(thread.get());
    }
    std::stable_sort(all.begin(), all.end(), [](const Thread* a, const Thread* b) {
        return std::pair(a->made.source, a->made.begin) < std::pair(b->made.source, b->made.begin);
    });
    return all;
}

}  // namespace

void LinuxcncCheck::command(const Command& command, const Model& model, Diagnostics& diagnostics) {
    const std::string& verb = command.name.text;
    if (std::find(own_commands.begin(), own_commands.end(), verb) != own_commands.end()) {
        return diagnostics.error("linuxcnc-command", command.name.span,
                                 "halcmd of LinuxCNC 2.9 has no command " + hal::quoted(verb), "",
                                 replacement_of(verb));
    }
    if (loads_again(command, model, diagnostics)) return;
    check_range(command, diagnostics);
    check_value(command, model, diagnostics);
    check_type(command, diagnostics);
    check_alias(command, model, diagnostics);
    check_arguments(command, model, diagnostics);
    if (verb == "loadrt") {
        check_linuxcnc_arguments(command, diagnostics);
        floating_point_.load(command);
    }
    if (verb == "addf") {
        floating_point_.add(command, model, diagnostics);
    }
    if (verb == "alias" && command.args.size() == 3) {
        name(command.args[2].text, "alias", command.args[2].span, diagnostics);
    }
}

bool LinuxcncCheck::loads_again(const Command& command, const Model& model,
                                Diagnostics& diagnostics) const {
    if (command.name.text != "loadrt" || command.args.empty()) return false;
    const Token& first = command.args[0];
    if (first.text == "--native" || first.text == "--linuxcnc") {
        diagnostics.error("linuxcnc-command", first.span,
                          "loadrt of LinuxCNC has no option " + hal::quoted(first.text));
        return true;
    }
    const LoadedComponent* const loaded = model.find_component(first.text);
    if (!loaded) return false;
    Diagnostic found{
        Severity::error,
        "linuxcnc-command",
        "LinuxCNC loads a component once: " + hal::quoted(first.text) + " is loaded already",
        {{first.span, "again"}},
        {"write one loadrt with all instances: names=a,b"}};
    if (loaded->loaded.known()) {
        found.labels.push_back({loaded->loaded, "loaded here"});
    }
    diagnostics.add(std::move(found));
    return true;
}

void LinuxcncCheck::name(const std::string& name, const char* kind, Span at,
                         Diagnostics& diagnostics) {
    if (name.size() <= max_name_length || !reported_.insert(name).second) return;
    diagnostics.error("linuxcnc-name", at,
                      std::string("the name of ") + kind + " " + hal::quoted(name) + " has " +
                          std::to_string(name.size()) + " characters; LinuxCNC takes " +
                          std::to_string(max_name_length));
}

void LinuxcncCheck::model(const Model& model, Diagnostics& diagnostics) {
    for (const auto& signal : model.signals) {
        name(signal->name, "signal", signal->made, diagnostics);
    }
    for (const auto& component : model.components) {
        name(component->name, "component", component->loaded, diagnostics);
        for (const auto& instance : component->instances) {
            const auto max = std::max_element(
                instance->pins.begin(), instance->pins.end(),
                [](const auto& a, const auto& b) { return a->name.size() < b->name.size(); });
            if (max != instance->pins.end()) {
                name((*max)->name, "pin", instance->loaded, diagnostics);
            }
        }
        for (const auto& function : component->functions) {
            if (component->plugin) {
                name(function->name + std::string(time_suffix), "pin", component->loaded,
                     diagnostics);
            }
        }
    }
    const Thread* first = nullptr;
    for (const Thread* const thread : in_order_of_creation(model)) {
        name(thread->name + std::string(time_suffix), "pin", thread->made, diagnostics);
        if (!first) {
            first = thread;
        }
        if (thread->options.period_ns >= first->options.period_ns ||
            !reported_.insert("thread " + thread->name).second) {
            continue;
        }
        diagnostics.add({Severity::error,
                         "linuxcnc-threads",
                         "LinuxCNC creates the fastest thread first: " + hal::quoted(thread->name) +
                             " is faster than " + hal::quoted(first->name),
                         {{thread->made, "faster"}, {first->made, "created first"}},
                         {"name them in the order of their periods: name1= and period1= are those "
                          "of the fastest"}});
    }
}

}  // namespace hal
