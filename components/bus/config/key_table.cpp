// SPDX-License-Identifier: MIT
#include "bus/config/key_table.hpp"

namespace hal::bus {

namespace {

/// Puts each part of a list in backquotes: a table of Markdown needs `\|` for a bar even there.
std::string code(std::string_view text) {
    std::string out = "`";
    for (const char c : text) {
        out += c == '|' ? "\\|" : std::string(1, c);
    }
    return out + "`";
}

}  // namespace

std::string usage_of(const KeyInfo& key) { return key.name + " " + key.form.usage; }

void reject_value(const Entry& entry, const std::string& expected, KeyReport& report) {
    report.error(Subject::value, entry.value.at,
                 "invalid " + entry.key.text + " '" + entry.value.text + "'", "write " + expected);
}

std::string reference_row(const std::string& prefix, const KeyInfo& key) {
    const std::string written = key.max_words > 1 ? usage_of(key) : key.name;
    return "| " + code(prefix + written) + " | " + key.form.range + " | " + key.usual + " | " +
           key.about + " |\n";
}

bool check_words(const KeyInfo& key, const std::vector<Word>& words, KeyReport& report) {
    const std::size_t values = words.size() - 1;
    const std::string what = key.form.expected.empty() ? "" : ": " + key.form.expected;
    const std::string help = "write " + usage_of(key) + what;
    if (values > key.max_words) {
        report.error(Subject::line, words[key.max_words + 1].at, "unexpected text", help);
        return false;
    }
    if (values < key.min_words) {
        const char* problem = values == 0 ? "' has no value" : "' is incomplete";
        report.error(Subject::line, words.front().at, "'" + words.front().text + problem, help);
        return false;
    }
    return true;
}

bool check_first(const Word& key, GivenKeys& given, KeyReport& report) {
    const auto [before, is_new] = given.emplace(key.text, key.at.line);
    if (is_new) return true;
    report.error(Subject::line, key.at, "duplicate key '" + key.text + "'",
                 "first in line " + std::to_string(before->second) + "; delete one of them",
                 "duplicate");
    return false;
}

}  // namespace hal::bus
