// SPDX-License-Identifier: MIT
#include "run/journal_option.hpp"

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "commands/files.hpp"
#include "netlist/journal_line.hpp"

namespace hal::tools {
namespace {

std::optional<JournalLine> line_of(const std::string& path, Sources& texts, const Ini& ini) {
    std::string text;
    std::string ignored;  // loading it reports it
    const bool is_netlist = !path.ends_with(".tcl") && !path.ends_with(".ini");
    if (!is_netlist || !read_text_file(resolve_path(path, ""), text, ignored) ||
        text.find("journal") == std::string::npos) {
        return std::nullopt;
    }
    const auto variable = [](const std::string& name) -> std::optional<std::string> {
        const char* const value = std::getenv(name.c_str());
        return value ? value : name;
    };
    Diagnostics reported_when_run;
    const std::uint32_t source = texts.add(path, std::move(text));
    return find_journal_line(parse(texts, source, {&ini, variable}, reported_when_run));
}

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
        const auto line = line_of(path, texts, ini);
        if (!line) continue;
        options.journal = line->file;
        options.keep_ns = options.keep_ns > 0 ? options.keep_ns : line->keep_ns;
        return;
    }
}

}  // namespace hal::tools
