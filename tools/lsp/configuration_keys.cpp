// SPDX-License-Identifier: MIT
#include "lsp/configuration_keys.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <set>
#include <sstream>
#include <string_view>

#include "lsp/protocol.hpp"
#include "text/characters.hpp"

namespace hal::tools {

using protocol::Json;

namespace {

constexpr int property_item = 10;  // CompletionItemKind of Language Server Protocol 3.17
constexpr int module_item = 9;

/// Returns what the program of the bus commands prints; empty when this build leaves it out.
std::string printed_keys(const std::string& component) {
    const auto program =
        std::filesystem::read_symlink("/proc/self/exe").replace_filename("hal-bus").string();
    std::string quoted;
    for (const char c : program) {
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    const std::string command = fmt::format("'{}' {} keys 2>/dev/null", quoted, component);
    const std::unique_ptr<FILE, int (*)(FILE*)> output(::popen(command.c_str(), "re"), ::pclose);
    std::string text;
    std::array<char, 4096> part{};
    while (output) {
        const std::size_t got = std::fread(part.data(), 1, part.size(), output.get());
        if (got == 0) break;
        text.append(part.data(), got);
    }
    return text;
}

/// Returns the cells of a row of a table in Markdown, in which `\|` is a character.
std::vector<std::string> cells_of(std::string_view row) {
    std::vector<std::string> cells(1);
    for (std::size_t i = 1; i < row.size(); ++i) {
        if (row[i] == '\\' && i + 1 < row.size() && row[i + 1] == '|') {
            cells.back() += row[++i];
        } else if (row[i] == '|') {
            cells.emplace_back();
        } else {
            cells.back() += row[i];
        }
    }
    for (std::string& cell : cells) {
        cell = std::string(trimmed(cell));
    }
    return cells;
}

std::string without_backquotes(std::string text) {
    std::erase(text, '`');
    return text;
}

std::string first_word(std::string_view text) {
    const std::string_view rest = trimmed(text);
    return std::string(rest.substr(0, rest.find_first_of(" \t=")));
}

/// Returns the first word of the section that a line is in; empty above all of them.
std::string section_at(const TextDocument& document, std::uint32_t line) {
    for (std::uint32_t number = line + 1; number-- > 0;) {
        const std::string_view text = trimmed(document.line(number));
        if (text.starts_with('[') && number < line) {
            return std::string(text.substr(1, text.find_first_of(" ]") - 1));
        }
    }
    return "";
}

}  // namespace

std::vector<ConfigurationKeys::Key> ConfigurationKeys::parse(const std::string& tables) {
    std::vector<Key> keys;
    std::istringstream lines(tables);
    std::string section;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("## ")) {
            section = line.substr(3);
        }
        if (!line.starts_with("| `")) continue;
        const std::vector<std::string> cells = cells_of(line);
        if (cells.size() < 4) continue;
        keys.push_back({section, without_backquotes(cells[0]), cells[1], cells[2], cells[3]});
    }
    return keys;
}

const std::vector<ConfigurationKeys::Key>& ConfigurationKeys::keys_of(
    const ConfigurationKind& kind) {
    const auto [found, fresh] = keys_.try_emplace(kind.component);
    if (fresh) {
        found->second = parse(printed_keys(kind.component));
    }
    return found->second;
}

/// A table is that of a section, "[bus]", of something in one, "clock of a slave", or of a file
/// without sections.
bool ConfigurationKeys::belongs(const Key& key, const std::string& section) {
    if (section.empty())
        return !key.section.starts_with('[') && key.section.find(" of a ") == key.section.npos;
    if (section == "defaults" || section == "type") return key.section != "[bus]";
    return key.section.starts_with("[" + section) || key.section.ends_with(" of a " + section);
}

std::string ConfigurationKeys::text_about(const Key& key) {
    std::string text = fmt::format("`{}`", key.name);
    if (!key.value.empty()) {
        text += ": " + key.value;
    }
    if (!key.fallback.empty()) {
        text += fmt::format(" (default {})", key.fallback);
    }
    return text + "\n\n" + key.meaning + "\n";
}

Json ConfigurationKeys::complete(const ConfigurationKind& kind, const TextDocument& document,
                                 TextPosition at) {
    const std::size_t offset = document.offset(at);
    const std::size_t begin = document.line_start(at.line);
    const std::string before = document.text().substr(begin, offset - begin);
    const std::size_t word = std::min(before.find_first_not_of(" \t"), before.size());
    const std::string typed = before.substr(word);
    Json items = Json::array();
    if (typed.find_first_of(" \t=") != typed.npos) {
        return {{"isIncomplete", false}, {"items", items}};
    }
    const Json range = protocol::to_json(document.range(begin + word, offset));
    const std::string section = section_at(document, at.line);
    std::set<std::string> offered;
    const auto offer = [&](const std::string& label, const std::string& text, const Key* key) {
        if (!text.starts_with(typed) || !offered.insert(label).second) return;
        Json item{{"label", label},
                  {"kind", key ? property_item : module_item},
                  {"filterText", text},
                  {"textEdit", {{"range", range}, {"newText", text}}}};
        if (key) {
            item["detail"] = without_backquotes(key->value);
            item["documentation"] = {{"kind", "markdown"}, {"value", text_about(*key)}};
        }
        items.push_back(std::move(item));
    };
    for (const Key& key : keys_of(kind)) {
        if (key.section.starts_with('[')) {
            offer(key.section, key.section, nullptr);
        }
        if (belongs(key, section)) {
            offer(key.name, first_word(key.name), &key);
        }
    }
    return {{"isIncomplete", false}, {"items", std::move(items)}};
}

std::string ConfigurationKeys::hover(const ConfigurationKind& kind, const TextDocument& document,
                                     TextPosition at) {
    const std::string_view line = document.line(at.line);
    const std::string word = first_word(line);
    const std::size_t offset = document.offset(at) - document.line_start(at.line);
    if (word.empty() || offset > line.find(word) + word.size()) return "";
    const std::string section = section_at(document, at.line);
    for (const Key& key : keys_of(kind)) {
        if (belongs(key, section) && first_word(key.name) == word) return text_about(key);
    }
    return "";
}

}  // namespace hal::tools
