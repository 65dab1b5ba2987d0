// SPDX-License-Identifier: MIT
#include "lsp/command_words.hpp"

#include <algorithm>

#include "commands/table.hpp"

namespace hal::tools {

namespace {

/// Returns whether the word of an option of the usage is this argument.
bool is_option(const UsageWord& word, const std::string& argument) {
    return word.text.starts_with('-') && has_alternative(word.text, argument);
}

/// Returns the index of the next word of the usage that the argument may be; the size for none.
std::size_t next_word(const std::vector<UsageWord>& words, std::size_t at,
                      const std::string& argument) {
    while (at < words.size()) {
        const UsageWord& word = words[at];
        const bool fits = word.text.starts_with('-') ? is_option(word, argument) : true;
        if (fits) return at;
        do {
            ++at;
        } while (at < words.size() && words[at].of_option);
    }
    return at;
}

const std::vector<UsageWord>& form_of(const CommandRow& row, const Command& command) {
    const auto& forms = usage_forms(row.arguments);
    for (const auto& form : forms) {
        const bool begins = !form.empty() && !command.args.empty() && !form[0].optional &&
                            is_option(form[0], command.args[0].text);
        if (begins) return form;
    }
    return forms.front();
}

}  // namespace

bool has_alternative(std::string_view usage_word, std::string_view alternative) {
    while (true) {
        const auto bar = usage_word.find('|');
        if (usage_word.substr(0, bar) == alternative) return true;
        if (bar == usage_word.npos) return false;
        usage_word.remove_prefix(bar + 1);
    }
}

std::vector<std::string_view> usage_of_arguments(const Command& command) {
    const CommandRow* const row = row_of(command);
    if (!row || usage_forms(row->arguments).empty()) return {};
    const std::vector<UsageWord>& words = form_of(*row, command);
    std::vector<std::string_view> found;
    std::size_t at = 0;
    for (const Token& argument : command.args) {
        if (is_arrow(argument.text)) {
            found.emplace_back();
            continue;
        }
        at = next_word(words, at, argument.text);
        if (at == words.size()) {
            found.emplace_back();
            continue;
        }
        found.push_back(words[at].text);
        if (!words[at].repeats) {
            ++at;
        }
    }
    return found;
}

}  // namespace hal::tools
