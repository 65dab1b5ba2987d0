// SPDX-License-Identifier: MIT
#include "commands/script_texts.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "commands/files.hpp"
#include "commands/table.hpp"
#include "netlist/nodes.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

/// What $NAME means to the shell of a node, which has a variable NODE besides.
std::optional<std::string> variable_of_node(const std::string& name, const ShellOptions& options,
                                            const Shell::State& state) {
    if (name == "NODE") return options.node;
    if (state.variable) return state.variable(name);
    const char* const value = std::getenv(name.c_str());
    return value ? std::optional<std::string>(value) : std::nullopt;
}

/// Quotes remain in the words of a netlist, but do not belong to the name of a file.
void unquote_paths(std::vector<Command>& commands) {
    for (Command& command : commands) {
        const CommandRow* const row = find_command(command.name.text);
        if (!row || row->behaviour.operands != Operands::paths) continue;
        for (Token& word : command.args) {
            word.text = without_quotes(word.text);
        }
    }
}

}  // namespace

ScriptTexts::~ScriptTexts() {
    Sources& sources = state_.session.sources;
    for (const std::uint32_t text : texts_) {
        sources.release(text);
        if (!kept_ && !shell_.options.check) {
            sources.drop(text);
        }
    }
    state_.session.sweep_texts();
}

std::uint32_t ScriptTexts::add(std::string name, std::string text, std::uint32_t first_line) {
    Sources& sources = state_.session.sources;
    texts_.reserve(texts_.size() + 1);
    const std::uint32_t source = sources.add(std::move(name), std::move(text), first_line);
    sources.hold(source);
    texts_.push_back(source);
    return source;
}

bool ScriptTexts::is_file(std::uint32_t source) const {
    return !state_.session.sources.get(source).name.starts_with('<');
}

/// Returns the canonical path of a text that is a file, else "".
std::string ScriptTexts::own_path(std::uint32_t source) const {
    if (!is_file(source)) return "";
    const std::string& name = state_.session.sources.get(source).name;
    return canonical_path(resolve_path(name, shell_.options.directory));
}

bool ScriptTexts::is_open(const std::string& canonical) const {
    return std::ranges::find(files_, canonical, &OpenFile::path) != files_.end();
}

bool ParsedText::is_ignored() const {
    return std::ranges::any_of(problems.all(), [](const Diagnostic& problem) {
        return problem.code == "binary-text" || problem.code == "too-many-words";
    });
}

ParsedText ScriptTexts::parse(std::uint32_t source) {
    Session& session = state_.session;
    ParsedText parsed;
    auto variable = state_.variable;
    if (!shell_.options.node.empty()) {
        variable = [this](const std::string& name) {
            return variable_of_node(name, shell_.options, state_);
        };
    }
    const Ini* const ini = state_.ini ? &*state_.ini : &session.ini;
    parsed.commands =
        hal::parse(session.sources, source, {ini, std::move(variable)}, parsed.problems);
    unquote_paths(parsed.commands);
    const auto files =
        std::ranges::count_if(files_, [](const OpenFile& file) { return !file.path.empty(); });
    if (files <= 1 && is_file(source)) {
        keep_part(source, parsed);
    }
    if (shell_.options.observer) {
        shell_.options.observer->parsed(session.sources, source, parsed.commands);
    }
    return parsed;
}

/// Keeps this machine's part of a netlist for several machines.
void ScriptTexts::keep_part(std::uint32_t source, ParsedText& parsed) const {
    const auto line = std::find_if(parsed.commands.begin(), parsed.commands.end(), is_node_line);
    if (line == parsed.commands.end()) return;
    std::vector<NodeLine> nodes;
    collect_nodes(parsed.commands, nodes, parsed.problems);
    if (!shell_.options.node.empty()) {
        return hal::keep_part(shell_.options.node, parsed.commands);
    }
    if (!nodes.empty()) {
        std::vector<std::string> names;
        for (const NodeLine& node : nodes) {
            names.push_back(node.name);
        }
        parsed.problems.clear();  // of a text that is nobody's; $(NODE) has no value here
        parsed.problems.error(
            "several-nodes", line->span,
            "this netlist is for " + counted(nodes.size(), "machine") + ": " + listed(names, 100),
            "",
            "hal run " + state_.session.sources.get(source).name + " --node " + names.front() +
                " loads the part of one");
    }
    parsed.commands.clear();
}

}  // namespace hal
