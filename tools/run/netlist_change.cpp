// SPDX-License-Identifier: MIT
#include "run/netlist_change.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/core.h>
#include <optional>
#include <utility>

#include "commands/files.hpp"
#include "commands/table.hpp"
#include "netlist/netlist.hpp"
#include "run/applied_changes.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

constexpr int max_depth = 20;  // of sourced files

std::string line_of(const std::vector<std::string>& words) {
    std::string line;
    for (const std::string& word : words) {
        append_item(line, written(word), " ");
    }
    return line + "\n";
}

std::vector<std::string> words_of(const Command& command) {
    std::vector<std::string> words{command.name.text};
    for (const Token& token : command.args) {
        words.push_back(token.text);
    }
    return words;
}

std::string first_error(const Diagnostics& diagnostics) {
    for (const Diagnostic& one : diagnostics.all()) {
        if (one.severity == Severity::error) return one.message;
    }
    return "";
}

/// A netlist as its edits, each in a line.
class FlatNetlist {
public:
    FlatNetlist(Sources& sources, const Ini& ini) : sources_(sources), ini_(ini) {}

    /// Returns why the file, or one that it sources, cannot be read.
    std::string add(const std::string& name, const std::string& folder, int depth = 0) {
        std::string path;
        std::string text;
        std::string problem;
        if (depth > max_depth) return fmt::format("'{}' sources itself", name);
        if (!read_netlist(name, folder, path, text, problem)) {
            return fmt::format("cannot read '{}': {}", name, problem);
        }
        const auto variable = [](const std::string& key) -> std::optional<std::string> {
            const char* const value = std::getenv(key.c_str());
            return value ? std::optional<std::string>(value) : std::nullopt;
        };
        Diagnostics diagnostics;
        const std::uint32_t source = sources_.add(path, std::move(text));
        for (const Command& command : parse(sources_, source, {&ini_, variable}, diagnostics)) {
            if (command.name.text == "source" && !command.args.empty()) {
                problem = add(command.args[0].text, folder_of(path), depth + 1);
                if (!problem.empty()) return problem;
                continue;
            }
            const CommandRow* const row = row_of(command);
            if (!row) {
                return fmt::format("'{}', line {}: unknown command '{}'", path,
                                   sources_.place(command.span).line, command.name.text);
            }
            if (row->edits()) {
                text_ += line_of(words_of(command));
            }
        }
        problem = first_error(diagnostics);
        return problem.empty() ? "" : fmt::format("'{}': {}", path, problem);
    }
    const std::string& text() const { return text_; }

private:
    Sources& sources_;
    const Ini& ini_;
    std::string text_;
};

/// The edits of a journal, each in a line; those of programs, which have no line, are left out.
std::string text_of(const JournalFile& file, std::size_t entries) {
    std::string text;
    for (std::size_t i = 0; i < std::min(entries, file.entries().size()); ++i) {
        if (file.entries()[i].kind != ExecutionEntry::Kind::edit) continue;
        for (const auto& words : file.entries()[i].commands) {
            const bool has_line = !words.empty() && !words.front().starts_with(':');
            text += has_line ? line_of(words) : "";
        }
    }
    return text;
}

bool concerns_threads(const Command& command) {
    const std::string& name = command.name.text;
    const bool loads_threads =
        name == "loadrt" && !command.args.empty() && command.args[0].text == "threads";
    return loads_threads || name == "newthread" || name == "delthread";
}

}  // namespace

std::string NetlistChange::read(const std::string& path, const std::string& ini_path) {
    Sources sources;
    Diagnostics diagnostics;
    Ini ini;
    if (!ini_path.empty()) {
        ini = Ini::read(sources, ini_path, diagnostics);
    }
    FlatNetlist netlist(sources, ini);
    std::string problem = first_error(diagnostics);
    if (problem.empty()) {
        problem = netlist.add(path, "");
    }
    if (!problem.empty()) return problem;
    path_ = path;
    text_ = netlist.text();
    return "";
}

std::string NetlistChange::apply(Session& session, const JournalFile& file, std::size_t entries) {
    const NetlistChanges changes = netlist_changes(text_of(file, entries), text_, {});
    not_applied_ = changes.not_sent;
    Sources sources;
    Diagnostics diagnostics;
    const std::uint32_t source = sources.add("changes", changes.removed + changes.changed);
    std::vector<Command> commands;
    for (const Command& command : parse(sources, source, {}, diagnostics)) {
        if (concerns_threads(command)) {
            return fmt::format("'{}' has other threads, and the journal has no cycles of them",
                               path_);
        }
        std::ranges::move(expand(command, diagnostics), std::back_inserter(commands));
    }
    Transaction transaction = session.begin();
    for (const Command& command : commands) {
        apply_edit(transaction, command, diagnostics);
    }
    const bool done = transaction.commit(diagnostics);
    return done ? "" : fmt::format("'{}' cannot be applied: {}", path_, first_error(diagnostics));
}

}  // namespace hal::tools
