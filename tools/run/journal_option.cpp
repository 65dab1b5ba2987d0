// SPDX-License-Identifier: MIT
#include "run/journal_option.hpp"

#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "commands/files.hpp"
#include "netlist/journal_line.hpp"

namespace hal::tools {
namespace {

/// Looks for the line in a netlist and in those that it sources, in the order of their commands.
class JournalSearch {
public:
    JournalSearch(Sources& texts, Ini ini) : texts_(texts), ini_(std::move(ini)) {}

    /// `beside`: the netlist that sources it, or "".
    std::optional<JournalLine> find(const std::string& name, const std::string& beside) {
        std::string path;
        std::string text;
        const bool is_netlist = !name.ends_with(".tcl") && !name.ends_with(".ini");
        if (!is_netlist || !read(name, beside, path, text) ||
            !searched_.insert(canonical_path(path)).second || !may_have_line(text)) {
            return std::nullopt;
        }
        const auto variable = [](const std::string& known) -> std::optional<std::string> {
            const char* const value = std::getenv(known.c_str());
            return value ? value : known;
        };
        Diagnostics reported_when_run;
        const std::uint32_t source = texts_.add(path, std::move(text));
        for (const Command& command : parse(texts_, source, {&ini_, variable}, reported_when_run)) {
            const bool sources = command.name.text == "source" && command.args.size() == 1;
            auto line = sources ? find(command.args[0].text, path) : journal_line(command);
            if (line) return line;
        }
        return std::nullopt;
    }

    /// Looks in the netlists of [HAL]HALFILE, as the machine finds them.
    std::optional<JournalLine> find_in_ini(const std::string& path) {
        Diagnostics reported_when_run;
        ini_ = Ini::read(texts_, path, reported_when_run);
        directory_ = folder_of(path);
        for (const std::string& entry : ini_.all("HAL", "HALFILE")) {
            const std::string name = entry.substr(0, entry.find_first_of(" \t"));
            if (auto line = find(name, path)) return line;
        }
        return std::nullopt;
    }

private:
    /// As the command `source` finds it.
    bool read(const std::string& name, const std::string& beside, std::string& path,
              std::string& text) const {
        std::string ignored;  // loading it reports it
        if (read_netlist(name, directory_, path, text, ignored)) return true;
        path = resolve_path(name, folder_of(beside));
        return !beside.empty() && read_text_file(path, text, ignored);
    }
    static bool may_have_line(const std::string& text) {
        const auto has = [&text](const char* word) { return text.find(word) != std::string::npos; };
        return has("journal") || has("source");
    }

    Sources& texts_;
    Ini ini_;
    std::string directory_;
    std::set<std::string> searched_;
};

}  // namespace

void add_journal_of_netlists(RunOptions& options) {
    if (!options.journal.empty() || options.classic) return;
    Sources texts;
    Diagnostics reported_when_run;
    Ini ini;
    if (!options.ini.empty()) {
        ini = Ini::read(texts, options.ini, reported_when_run);
    }
    for (const std::string& path : options.words) {
        JournalSearch search(texts, ini);
        const auto line = path.ends_with(".ini") ? search.find_in_ini(path) : search.find(path, "");
        if (!line) continue;
        options.journal = line->file;
        options.is_of_netlist = true;
        options.keep_ns = options.keep_ns > 0 ? options.keep_ns : line->keep_ns;
        return;
    }
}

}  // namespace hal::tools
