// SPDX-License-Identifier: MIT
#include "lsp/quick_fixes.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

namespace hal::tools {

namespace {

constexpr std::string_view suggestion = "did you mean '";

/// Returns the names of "did you mean 'a' or 'b'?".
std::vector<std::string> suggested_names(std::string_view text) {
    std::vector<std::string> names;
    auto at = text.find(suggestion);
    if (at == text.npos) return names;
    at += suggestion.size() - 1;
    while (at < text.size() && text[at] == '\'') {
        const auto end = text.find('\'', at + 1);
        if (end == text.npos) break;
        names.emplace_back(text.substr(at + 1, end - at - 1));
        constexpr std::string_view next = " or '";
        if (text.substr(end + 1, next.size()) != next) break;
        at = end + next.size();
    }
    return names;
}

bool is_keyword(std::string_view text) {
    return !text.empty() && std::ranges::all_of(text, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
    });
}

/// Returns the words of "write yes or no" and "write a, b or c"; none of another sentence.
std::vector<std::string> listed_words(std::string_view help) {
    constexpr std::string_view verb = "write ";
    constexpr std::string_view last = " or ";
    if (!help.starts_with(verb)) return {};
    help.remove_prefix(verb.size());
    const auto end = help.rfind(last);
    if (end == help.npos) return {};
    std::vector<std::string> words;
    std::string_view list = help.substr(0, end);
    while (true) {
        const auto comma = list.find(", ");
        words.emplace_back(list.substr(0, comma));
        if (comma == list.npos) break;
        list.remove_prefix(comma + 2);
    }
    words.emplace_back(help.substr(end + last.size()));
    return std::ranges::all_of(words, is_keyword) ? words : std::vector<std::string>{};
}

/// Returns what is behind `before` and in front of `after` in a text.
std::optional<std::string> between(std::string_view text, std::string_view before,
                                   std::string_view after) {
    const auto begin = text.find(before);
    if (begin == text.npos) return std::nullopt;
    const auto from = begin + before.size();
    const auto end = after.empty() ? text.size() : text.find(after, from);
    if (end == text.npos) return std::nullopt;
    return std::string(text.substr(from, end - from));
}

TextRange line_of(const TextDocument& document, std::uint32_t line) {
    const std::size_t begin = document.line_start(line);
    return document.range(begin, begin + document.line(line).size());
}

class Fixes {
public:
    Fixes(const FileDiagnostic& diagnostic, const TextDocument& document)
        : diagnostic_(diagnostic), document_(document) {}

    std::vector<QuickFix> all() {
        add_names(diagnostic_.label);
        add_names(diagnostic_.message);
        add_number();
        for (const std::string& help : diagnostic_.help) {
            add_names(help);
            for (const std::string& word : listed_words(help)) {
                replace_range(word);
            }
            add_line(help);
        }
        return std::move(fixes_);
    }

private:
    void add_names(const std::string& text) {
        for (const std::string& name : suggested_names(text)) {
            replace_range(name);
        }
    }

    /// "'1,5' is not a number; write 1.5", if that is what the text has at this place.
    void add_number() {
        const auto number = between(diagnostic_.message, "' is not a number; write ", "");
        const std::string& text = document_.text();
        const std::size_t begin = document_.offset(diagnostic_.range.begin);
        const std::size_t end = document_.offset(diagnostic_.range.end);
        if (number && text.substr(begin, end - begin).find(',') != text.npos) {
            replace_range(*number);
        }
    }

    void replace_range(const std::string& text) {
        fixes_.push_back({"Replace by '" + text + "'", diagnostic_.range, text});
    }

    void add_line(const std::string& help) {
        const std::uint32_t line = diagnostic_.range.begin.line;
        if (help == "delete the line") {
            fixes_.push_back({"Delete the line", {{line, 0}, {line + 1, 0}}, ""});
        } else if (const auto command = between(help, "create one with `", "`")) {
            fixes_.push_back(
                {"Insert '" + *command + "'", {{line, 0}, {line, 0}}, *command + "\n"});
        } else if (const auto whole = between(help, "write it without '=': ", "")) {
            fixes_.push_back({"Write '" + *whole + "'", line_of(document_, line), *whole});
        } else if (const auto word = between(help, "write '", "'; ")) {
            replace_range(*word);
        }
    }

    const FileDiagnostic& diagnostic_;
    const TextDocument& document_;
    std::vector<QuickFix> fixes_;
};

}  // namespace

std::vector<QuickFix> quick_fixes(const FileDiagnostic& diagnostic, const TextDocument& document) {
    return Fixes(diagnostic, document).all();
}

}  // namespace hal::tools
