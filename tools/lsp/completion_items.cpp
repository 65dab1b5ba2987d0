// SPDX-License-Identifier: MIT
#include "lsp/completion_items.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <string>
#include <string_view>

#include "commands/table.hpp"
#include "lsp/command_words.hpp"
#include "lsp/protocol.hpp"
#include "text/natural_order.hpp"

namespace hal::tools {

using protocol::Json;

namespace {

constexpr std::size_t max_items = 500;  // the client asks again after the next character

/// CompletionItemKind of Language Server Protocol 3.17.
enum ItemKind { function = 3, variable = 6, module = 9, property = 10, keyword = 14, file = 17 };

/// The text of the logical line up to the cursor, on one line.
std::string line_before(const TextDocument& document, std::uint32_t line, std::size_t offset) {
    while (line > 0 && document.line(line - 1).ends_with('\\')) {
        --line;
    }
    std::string text =
        document.text().substr(document.line_start(line), offset - document.line_start(line));
    for (auto at = text.find("\\\n"); at != text.npos; at = text.find("\\\n", at)) {
        text.replace(at, 2, "  ");
    }
    return text;
}

ItemKind kind_of(const Model& model, const Candidate& candidate, bool is_command) {
    if (is_command) return keyword;
    if (model.find_signal(candidate.text)) return variable;
    if (model.find_pin(candidate.text)) return property;
    if (model.find_function(candidate.text)) return function;
    return candidate.text.ends_with('/') || candidate.hint == "folder" ? file : module;
}

/// The keys of the INI file, behind a `[`.
std::vector<Candidate> ini_keys(const Session& session, std::string_view typed) {
    std::vector<Candidate> found;
    for (const std::string& name : session.ini.names()) {
        if (!name.starts_with(typed)) continue;
        const auto bracket = name.find(']');
        const auto value = session.ini.get(name.substr(1, bracket - 1), name.substr(bracket + 1));
        found.push_back({name, value.value_or("")});
    }
    std::sort(found.begin(), found.end(),
              [](const Candidate& a, const Candidate& b) { return natural_less(a.text, b.text); });
    return found;
}

}  // namespace

Json complete_netlist(CheckedNetlist& model, const TextDocument& document, TextPosition at) {
    const std::size_t offset = document.offset(at);
    const std::string line = line_before(document, at.line, offset);
    Session& session = *model.sessions().front();
    Completion completion = model.shell().complete(line, line.size());
    const std::string_view typed = std::string_view(line).substr(completion.begin);
    if (const auto bracket = typed.rfind('[');
        bracket != typed.npos && typed.find(']', bracket) == typed.npos) {
        completion.begin += bracket;
        completion.candidates = ini_keys(session, typed.substr(bracket));
    }
    const bool is_command = line.find_first_not_of(" \t") == line.npos ||
                            line.find_last_of(" \t") == line.npos ||
                            line.find_first_not_of(" \t") > line.find_last_of(" \t");
    const TextRange word = document.range(offset - (line.size() - completion.begin), offset);
    Json items = Json::array();
    for (const Candidate& candidate : completion.candidates) {
        if (items.size() == max_items) break;
        items.push_back(
            {{"label", candidate.text},
             {"kind", kind_of(session.model(), candidate, is_command)},
             {"detail", candidate.hint},
             {"sortText", fmt::format("{:06}", items.size())},
             {"filterText", candidate.text},
             {"textEdit", {{"range", protocol::to_json(word)}, {"newText", candidate.text}}}});
    }
    return {{"isIncomplete", completion.candidates.size() > items.size()},
            {"items", std::move(items)}};
}

}  // namespace hal::tools
