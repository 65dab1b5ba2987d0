// SPDX-License-Identifier: MIT
// Words with boundaries of their own, and how they are written in a netlist.
#include <algorithm>

#include "netlist/line.hpp"
#include "netlist/netlist.hpp"

namespace hal {

namespace {

/// True when the parser of netlists would end the word somewhere, or take it for a comment.
bool splits(std::string_view word) {
    if (word.empty()) return true;
    for (std::size_t at = 0; at < word.size(); ++at) {
        if (is_blank(word[at]) || word[at] == '#') return true;
        if (word[at] != '"' && word[at] != '\'') continue;
        at = word.find(word[at], at + 1);
        if (at == word.npos) return true;
    }
    return false;
}

}  // namespace

std::string written(std::string_view word) {
    if (!splits(word)) return std::string(word);
    // The quotes enclose the value only: a component takes them off there.
    const auto equals = word.find('=');
    const std::size_t head = equals == word.npos || splits(word.substr(0, equals)) ? 0 : equals + 1;
    const char quote = word.find('"') == word.npos ? '"' : '\'';
    return std::string(word.substr(0, head)) + quote + std::string(word.substr(head)) + quote;
}

std::string_view without_quotes(std::string_view word) {
    const bool enclosed = word.size() >= 2 && (word[0] == '"' || word[0] == '\'') &&
                          word.find(word[0], 1) == word.size() - 1;
    return enclosed ? word.substr(1, word.size() - 2) : word;
}

Command command_of(const std::vector<std::string>& words, std::uint32_t source, std::string& text) {
    Command command;
    for (const std::string& word : words) {
        if (!text.empty()) {
            text += &word == words.data() ? '\n' : ' ';
        }
        std::string shown = written(word);
        std::replace_if(shown.begin(), shown.end(),
                        [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
        const auto begin = static_cast<std::uint32_t>(text.size());
        text += shown;
        Token token{word, {source, begin, static_cast<std::uint32_t>(text.size())}};
        if (&word == words.data()) {
            command.name = std::move(token);
        } else {
            command.args.push_back(std::move(token));
        }
    }
    command.span = {source, command.name.span.begin, static_cast<std::uint32_t>(text.size())};
    return command;
}

}  // namespace hal
