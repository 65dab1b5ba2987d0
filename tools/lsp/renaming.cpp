// SPDX-License-Identifier: MIT
#include "lsp/renaming.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <set>

#include "lsp/editor_texts.hpp"
#include "lsp/protocol.hpp"
#include "text/netlist_name.hpp"

namespace hal::tools {

namespace {

using protocol::ErrorCode;
using protocol::RequestError;

[[noreturn]] void reject(const std::string& reason) {
    throw RequestError(ErrorCode::request_failed, reason);
}

bool is_taken(const NetlistIndex& index, NameKind kind, const std::string& name) {
    switch (kind) {
    case NameKind::signal: return index.find_signal(name) || index.find_pin(name);
    case NameKind::instance: return index.find_instance(name);
    case NameKind::thread: return index.find_thread(name);
    default: return true;
    }
}

std::string location(const Workspace& workspace, const Occurrence& mention) {
    const TextPosition at = workspace.text_of(mention.path).position(mention.begin);
    return fmt::format("{}:{}", mention.path, at.line + 1);
}

void check_mention(const Workspace& workspace, const Occurrence& mention, const std::string& name) {
    if (mention.path.empty()) {
        reject(fmt::format("'{}' is used by HALCMD of an INI file; change it there by hand", name));
    }
    if (mention.verbatim || mention.ini_value) return;
    reject(
        fmt::format("{}: '{}' is not written in full there, but made by a range, a count or a "
                    "variable; change this line by hand",
                    location(workspace, mention), name));
}

FileEdits edits_of(const Workspace& workspace, const std::vector<Occurrence>& mentions,
                   const NamedThing& thing, const std::string& new_name) {
    std::map<std::string, std::set<TextEdit>> edits;
    std::map<std::string, TextDocument> texts;
    for (const Occurrence& mention : mentions) {
        check_mention(workspace, mention, thing.name);
        if (mention.ini_value) {
            const std::string rest = mention.ini_value->text.substr(
                std::min(thing.name.size(), mention.ini_value->text.size()));
            edits[mention.ini_value->path].insert({mention.ini_value->range, new_name + rest});
            continue;
        }
        const auto [text, fresh] = texts.try_emplace(mention.path);
        if (fresh) {
            text->second = workspace.text_of(mention.path);
        }
        edits[mention.path].insert({text->second.range(mention.begin, mention.end), new_name});
    }
    FileEdits sorted;
    for (const auto& [path, all] : edits) {
        sorted[path].assign(all.begin(), all.end());
    }
    return sorted;
}

/// Loads the netlist with the edits. Throws when it has another number of errors.
void check_result(const Workspace& workspace, const CheckedNetlist& netlist,
                  const FileEdits& edits) {
    std::map<std::string, std::string> texts;
    for (const auto& [path, all] : edits) {
        TextDocument text = workspace.text_of(path);
        for (auto edit = all.rbegin(); edit != all.rend(); ++edit) {
            text.replace(edit->range, edit->text);
        }
        texts[path] = text.text();
    }
    const EditorTexts::Override renamed(std::move(texts));
    const CheckedNetlist after(netlist.root());
    const auto errors_of = [](const CheckedNetlist& checked) {
        std::multiset<std::string> codes;
        for (const FileDiagnostic& one : checked.diagnostics()) {
            if (one.severity == Severity::error) {
                codes.insert(one.code);
            }
        }
        return codes;
    };
    if (errors_of(after) == errors_of(netlist)) return;
    for (const FileDiagnostic& one : after.diagnostics()) {
        if (one.severity == Severity::error) {
            reject("the renamed netlist would have an error: " + one.message);
        }
    }
    reject("the renamed netlist would have other errors");
}

}  // namespace

void check_renaming(const NetlistIndex& index, const NamedThing& thing) {
    switch (thing.kind) {
    case NameKind::signal:
    case NameKind::thread: break;
    case NameKind::instance:
        if (index.definitions(thing).empty()) {
            reject("no line of the netlist makes '" + thing.name + "'");
        }
        break;
    case NameKind::pin:
    case NameKind::function:
        reject("the component gives '" + thing.name +
               "' its name; put the cursor on the name of the instance to rename that");
    default: reject("only signals, instances and threads can be renamed");
    }
    for (const Occurrence& made : index.definitions(thing)) {
        if (made.verbatim || made.ini_value) continue;
        const bool is_instance = thing.kind == NameKind::instance;
        reject(is_instance ? fmt::format("'{}' is numbered or made by a range; give it a name "
                                         "first: names={}",
                                         thing.name, thing.name)
                           : fmt::format("'{}' is made by a range or a variable; change its line "
                                         "by hand",
                                         thing.name));
    }
}

FileEdits rename(const Workspace& workspace, const CheckedNetlist& netlist,
                 const NetlistIndex& index, const NamedThing& thing, const std::string& new_name) {
    check_renaming(index, thing);
    if (const std::string problem = name_problem(new_name); !problem.empty()) {
        reject(fmt::format("'{}' is not a valid name: {}", shown_name(new_name), problem));
    }
    if (new_name == thing.name) return {};
    if (is_taken(index, thing.kind, new_name)) {
        reject(fmt::format("the name '{}' is taken", new_name));
    }
    FileEdits edits = edits_of(workspace, index.mentions(thing), thing, new_name);
    check_result(workspace, netlist, edits);
    return edits;
}

}  // namespace hal::tools
