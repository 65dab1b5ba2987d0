// SPDX-License-Identifier: MIT
#include "lsp/netlist_index.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <utility>

#include "commands/files.hpp"
#include "commands/table.hpp"
#include "lsp/command_words.hpp"
#include "netlist/line.hpp"

namespace hal::tools {

namespace {

constexpr std::string_view names_argument = "names=";

const std::vector<Occurrence> none;

/// Kinds of the words of the usages, but for those with several meanings.
constexpr std::array<std::pair<std::string_view, NameKind>, 6> plain_kinds{{
    {"SIGNAL", NameKind::signal},
    {"PIN", NameKind::pin},
    {"FUNCTION", NameKind::function},
    {"THREAD", NameKind::thread},
    {"FILE", NameKind::file},
    {"VALUE", NameKind::value},
}};

bool makes_signal(std::string_view command) { return command == "net" || command == "newsig"; }

}  // namespace

NetlistIndex::NetlistIndex(const CheckedNetlist& netlist, const CheckedNetlist& model)
    : netlist_(netlist) {
    for (const Session* const session : model.sessions()) {
        models_.push_back(&session->model());
    }
    for (const CheckedNetlist::Text& text : netlist.texts()) {
        Diagnostics ignored;
        for (const Command& command : text.commands) {
            for (const Command& one : expand(command, ignored)) {
                add(text, one);
            }
        }
    }
    add_unnamed_instances(model);
    const auto order = [](const Occurrence& a, const Occurrence& b) {
        return std::tie(a.begin, a.end, a.kind, a.name) < std::tie(b.begin, b.end, b.kind, b.name);
    };
    const auto same = [](const Occurrence& a, const Occurrence& b) {
        return std::tie(a.begin, a.end, a.kind, a.name) == std::tie(b.begin, b.end, b.kind, b.name);
    };
    for (auto& [path, all] : texts_) {
        std::stable_sort(all.begin(), all.end(), order);
        all.erase(std::unique(all.begin(), all.end(), same), all.end());
    }
}

void NetlistIndex::add(const CheckedNetlist::Text& text, const Command& command) {
    if (command.name.span.known()) {
        put(text, NameKind::command, command.name, false);
    }
    const std::vector<std::string_view> usages = usage_of_arguments(command);
    for (std::size_t i = 0; i < usages.size(); ++i) {
        add_argument(text, command, usages[i], command.args[i]);
    }
}

void NetlistIndex::add_argument(const CheckedNetlist::Text& text, const Command& command,
                                std::string_view usage, const Token& argument) {
    if (usage == "ARGUMENT=VALUE") {
        if (argument.text.starts_with(names_argument)) return add_names(text, argument);
        const auto equals = argument.text.find('=');
        if (equals == argument.text.npos) return;
        return add_file(text, argument, std::string_view(argument.text).substr(equals + 1));
    }
    if (const auto kind = kind_of(usage, command, argument.text)) {
        const bool defines = (*kind == NameKind::signal && makes_signal(command.name.text)) ||
                             (*kind == NameKind::thread && command.name.text == "newthread");
        put(text, *kind, argument, defines);
    }
}

/// Returns what a word stands for; nothing for another word.
std::optional<NameKind> NetlistIndex::kind_of(std::string_view usage, const Command& command,
                                              const std::string& name) const {
    for (const auto& [word, kind] : plain_kinds) {
        if (usage == word) return kind;
    }
    if (usage == "PIN-OR-PARAMETER") {
        const bool is_assignment = !command.name.span.known();  // NAME = VALUE
        return is_assignment && find_signal(name) ? NameKind::signal : NameKind::pin;
    }
    if (usage == "ALIAS") return NameKind::pin;
    if (usage == "NAME") {
        if (command.name.text == "newsig") return NameKind::signal;
        return command.name.text == "alias" ? NameKind::pin : NameKind::thread;
    }
    if (has_alternative(usage, "INSTANCE") && find_instance(name)) return NameKind::instance;
    if (has_alternative(usage, "COMPONENT")) return NameKind::component;
    if (has_alternative(usage, "SIGNAL")) return NameKind::signal;
    return std::nullopt;
}

std::string NetlistIndex::instance_of(NameKind kind, const std::string& name) const {
    if (kind == NameKind::pin) {
        const Pin* const pin = find_pin(name);
        return pin && pin->instance && pin->name == name ? pin->instance->name : "";
    }
    const LoadedFunction* const function =
        kind == NameKind::function ? find_function(name) : nullptr;
    const bool of_one = function && !function->shared && function->instances.size() == 1;
    return of_one ? function->instances.front()->name : "";
}

/// Returns where the INI file has a value that is the whole word.
std::optional<DiagnosticPlace> NetlistIndex::ini_value(const CheckedNetlist::Text& text,
                                                       const Token& token) const {
    const Sources& sources = text.session->sources;
    const std::string_view written = sources.text(token.span);
    if (!written.starts_with('[')) return std::nullopt;
    const Reference reference = reference_at(written, 0);
    if (reference.kind != Reference::key || reference.length != written.size()) return std::nullopt;
    const Ini::Entry* const entry = text.session->ini.find(reference.section, reference.name);
    if (!entry || !entry->at.known() || entry->value != token.text) return std::nullopt;
    const std::string path = netlist_.path_of(sources, entry->at.source);
    if (path.empty()) return std::nullopt;
    const TextDocument& document = netlist_.document(*text.session, entry->at.source);
    return DiagnosticPlace{path, document.range(entry->at.begin, entry->at.end), entry->value};
}

void NetlistIndex::put(const CheckedNetlist::Text& text, NameKind kind, const Token& token,
                       bool defines) {
    if (token.span.source != text.source) return;
    Occurrence occurrence{.kind = kind,
                          .name = token.text,
                          .path = text.path,
                          .begin = token.span.begin,
                          .end = token.span.end,
                          .verbatim = text.session->sources.text(token.span) == token.text,
                          .defines = defines};
    occurrence.instance = instance_of(kind, token.text);
    if (!occurrence.verbatim) {
        occurrence.ini_value = ini_value(text, token);
    }
    texts_[text.path].push_back(std::move(occurrence));
}

/// names=a,b makes an instance for each name of the list.
void NetlistIndex::add_names(const CheckedNetlist::Text& text, const Token& argument) {
    const std::string_view written = text.session->sources.text(argument.span);
    const bool verbatim = written == argument.text;
    // one reference to an INI file may stand for all names
    const bool has_prefix = written.starts_with(names_argument);
    const std::string_view names = std::string_view(argument.text).substr(names_argument.size());
    for (std::size_t at = 0; at <= names.size();) {
        const auto comma = std::min(names.find(',', at), names.size());
        Token name{std::string(names.substr(at, comma - at)), argument.span};
        if (verbatim) {
            name.span.begin += static_cast<std::uint32_t>(names_argument.size() + at);
            name.span.end = name.span.begin + static_cast<std::uint32_t>(comma - at);
        } else if (has_prefix) {
            name.span.begin += static_cast<std::uint32_t>(names_argument.size());
        }
        if (!name.text.empty()) {
            put(text, NameKind::instance, name, true);
        }
        at = comma + 1;
    }
}

/// A load argument that names a file: config=line.canopen.
void NetlistIndex::add_file(const CheckedNetlist::Text& text, const Token& argument,
                            std::string_view file) {
    std::error_code ignored;
    const std::string path = resolve_path(std::string(file), folder_of(text.path));
    if (file.empty() || !std::filesystem::is_regular_file(path, ignored)) return;
    Token token{std::string(file), argument.span};
    if (text.session->sources.text(argument.span) == argument.text) {
        token.span.begin = token.span.end - static_cast<std::uint32_t>(file.size());
    }
    put(text, NameKind::file, token, false);
}

/// Numbered instances are made by the whole command.
void NetlistIndex::add_unnamed_instances(const CheckedNetlist& model) {
    std::set<std::string_view> named;
    for (const auto& [path, all] : texts_) {
        for (const Occurrence& one : all) {
            if (one.kind == NameKind::instance && one.defines) {
                named.insert(one.name);
            }
        }
    }
    std::vector<Occurrence> numbered;
    for (Session* const session : model.sessions()) {
        for (const auto& [name, instance] : session->model().instance) {
            const Span at = instance->loaded;
            if (!at.known() || named.contains(name)) continue;
            numbered.push_back({.kind = NameKind::instance,
                                .name = std::string(name),
                                .path = model.path_of(session->sources, at.source),
                                .begin = at.begin,
                                .end = at.end,
                                .verbatim = false,
                                .defines = true});
        }
    }
    for (Occurrence& one : numbered) {
        texts_[one.path].push_back(std::move(one));
    }
}

const std::vector<Occurrence>& NetlistIndex::in_text(const std::string& path) const {
    const auto found = texts_.find(path);
    return found == texts_.end() ? none : found->second;
}

std::optional<NamedThing> NetlistIndex::at(const std::string& path, std::size_t offset) const {
    const Occurrence* best = nullptr;
    for (const Occurrence& one : in_text(path)) {
        if (one.begin > offset) break;
        const bool contains = offset <= one.end;
        // the narrowest: a numbered instance spans its whole command
        if (contains && (!best || one.end - one.begin < best->end - best->begin)) {
            best = &one;
        }
    }
    if (!best || (best->kind == NameKind::instance && !best->verbatim && !best->ini_value)) {
        return std::nullopt;
    }
    const std::size_t prefix = best->instance.size();
    const bool on_instance = best->verbatim && prefix > 0 &&
                             best->name.starts_with(best->instance + ".") &&
                             offset <= best->begin + prefix;
    if (on_instance) {
        return NamedThing{NameKind::instance, best->instance, best->begin, best->begin + prefix};
    }
    return NamedThing{best->kind, best->name, best->begin, best->end};
}

std::vector<Occurrence> NetlistIndex::mentions(const NamedThing& thing) const {
    std::vector<Occurrence> found;
    for (const auto& [path, all] : texts_) {
        for (const Occurrence& one : all) {
            if (one.kind == thing.kind && one.name == thing.name) {
                found.push_back(one);
            } else if (thing.kind == NameKind::instance && one.instance == thing.name &&
                       one.name.starts_with(thing.name)) {
                found.push_back(one);
                if (one.verbatim) {
                    found.back().end = one.begin + thing.name.size();
                }
            }
        }
    }
    return found;
}

std::vector<Occurrence> NetlistIndex::definitions(const NamedThing& thing) const {
    NamedThing maker = thing;
    const bool is_part = thing.kind == NameKind::pin || thing.kind == NameKind::function;
    if (is_part) {
        maker = {NameKind::instance, instance_of(thing.kind, thing.name)};
    }
    std::vector<Occurrence> found;
    std::set<std::string_view> seen;
    for (const CheckedNetlist::Text& text : netlist_.texts()) {
        if (!seen.insert(text.path).second) continue;
        for (const Occurrence& one : in_text(text.path)) {
            if (one.defines && one.kind == maker.kind && one.name == maker.name) {
                found.push_back(one);
            }
        }
    }
    // the first mention makes a signal
    if (thing.kind == NameKind::signal && found.size() > 1) {
        found.resize(1);
    }
    return found;
}

namespace {

template <class Thing>
const Thing* find_in(const std::vector<const Model*>& models,
                     Thing* (Model::*find)(std::string_view) const, std::string_view name) {
    for (const Model* const model : models) {
        if (const Thing* const found = (model->*find)(name)) return found;
    }
    return nullptr;
}

}  // namespace

const Pin* NetlistIndex::find_pin(std::string_view name) const {
    return find_in<Pin>(models_, &Model::find_pin, name);
}

const Signal* NetlistIndex::find_signal(std::string_view name) const {
    return find_in<Signal>(models_, &Model::find_signal, name);
}

const LoadedFunction* NetlistIndex::find_function(std::string_view name) const {
    return find_in<LoadedFunction>(models_, &Model::find_function, name);
}

const Instance* NetlistIndex::find_instance(std::string_view name) const {
    return find_in<Instance>(models_, &Model::find_instance, name);
}

const Thread* NetlistIndex::find_thread(std::string_view name) const {
    return find_in<Thread>(models_, &Model::find_thread, name);
}

}  // namespace hal::tools
