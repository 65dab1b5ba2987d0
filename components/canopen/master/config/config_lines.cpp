// SPDX-License-Identifier: MIT
#include "config_lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace hal::canopen::config {

namespace {

constexpr std::string_view blanks = " \t\r";
constexpr std::size_t      most_lines = 20'000;

bool blank(char c) { return blanks.find(c) != blanks.npos; }
char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::uint32_t characters(std::string_view text) {
    return static_cast<std::uint32_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

/// One line of the text.
struct Raw {
    std::string_view text;
    std::uint32_t    number, offset;

    Word word(std::size_t begin, std::size_t end) const {
        while (begin < end && blank(text[begin])) ++begin;
        while (end > begin && blank(text[end - 1])) --end;
        return {std::string(text.substr(begin, end - begin)),
                {number, characters(text.substr(0, begin)) + 1, offset + static_cast<std::uint32_t>(begin),
                 static_cast<std::uint32_t>(end - begin)}};
    }
};

/// Where the comment begins: a # or ; at the beginning or after a blank.
std::size_t comment(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i)
        if ((text[i] == '#' || text[i] == ';') && (i == 0 || blank(text[i - 1]))) return i;
    return text.size();
}

Word part(const Word& whole, std::size_t begin, std::size_t end) {
    const Raw raw{whole.text, whole.at.line, whole.at.offset};
    Word      out = raw.word(begin, end);
    out.at.column += whole.at.column - 1;
    return out;
}

/// Levenshtein.
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t change = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
        }
    }
    return row.back();
}

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"canopen-line", "canopen-value", "canopen-object", "canopen-node", "canopen-load"};
    return codes[static_cast<std::size_t>(topic)];
}

std::vector<Section> split(std::string_view text, Report& report) {
    std::vector<Section> sections;
    std::uint32_t        number = 0, offset = 0;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3), offset = 3;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        Raw               raw{text.substr(0, end), ++number, offset};
        const std::size_t taken = std::min(end + 1, text.size());
        offset += static_cast<std::uint32_t>(taken);
        text.remove_prefix(taken);
        raw.text = raw.text.substr(0, comment(raw.text));
        const Word whole = raw.word(0, raw.text.size());
        if (whole.empty()) continue;
        if (number > most_lines) {
            report.error(Topic::line, whole.at, "the file has more than " + std::to_string(most_lines) + " lines; it is no configuration");
            break;
        }
        if (whole.text.front() == '[') {
            if (whole.text.back() != ']') {
                report.error(Topic::line, whole.at, "the section's name is not closed", "write [bus], [type NAME] or [node 5 NAME]",
                             "']' is missing");
                continue;
            }
            Section section;
            section.at = whole.at;
            section.words = words_of(part(whole, 1, whole.text.size() - 1));
            sections.push_back(std::move(section));
            continue;
        }
        const std::size_t equals = raw.text.find('=');
        Line              line;
        if (equals != raw.text.npos) line.key = raw.word(0, equals), line.value = raw.word(equals + 1, raw.text.size());
        if (line.key.empty()) {
            report.error(Topic::line, whole.at, "this is neither a [section] nor KEY = VALUE", "a comment begins with #");
            continue;
        }
        if (line.value.empty()) {
            report.error(Topic::value, line.key.at, "'" + line.key.text + "' has no value",
                         "write " + line.key.text + " = VALUE, or take the line away");
            continue;
        }
        line.written = line.key.text;
        std::transform(line.key.text.begin(), line.key.text.end(), line.key.text.begin(), [](char c) { return c == '_' ? '-' : small(c); });
        if (sections.empty()) {
            report.error(Topic::line, whole.at, "this line stands before the first section", "begin the file with [bus]");
            continue;
        }
        sections.back().lines.push_back(std::move(line));
    }
    return sections;
}

std::vector<Word> list_of(const Word& value, char by) {
    std::vector<Word> parts;
    for (std::size_t begin = 0; begin <= value.text.size();) {
        const std::size_t end = std::min(value.text.find(by, begin), value.text.size());
        parts.push_back(part(value, begin, end));
        begin = end + 1;
    }
    return parts;
}

std::vector<Word> words_of(const Word& value) {
    std::vector<Word>  parts;
    const std::string& t = value.text;
    for (std::size_t begin = t.find_first_not_of(blanks); begin != t.npos; begin = t.find_first_not_of(blanks, begin)) {
        const std::size_t end = std::min(t.find_first_of(blanks, begin), t.size());
        parts.push_back(part(value, begin, end));
        begin = end;
    }
    return parts;
}

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), small);
    return out;
}

std::string dashed(std::string_view name) {
    std::string out;
    for (const char c : name) {
        const char s = small(c);
        if ((s >= 'a' && s <= 'z') || (s >= '0' && s <= '9')) out += s;
        else if (!out.empty() && out.back() != '-') out += '-';
    }
    while (!out.empty() && out.back() == '-') out.pop_back();
    return out;
}

std::optional<std::uint64_t> natural(std::string_view text) {
    const bool hex = text.starts_with("0x") || text.starts_with("0X");
    if (hex) text.remove_prefix(2);
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return {};
    return value;
}

namespace {
/// A number with a unit behind it: the number, the unit in what is left of `text`.
std::optional<double> leading(std::string_view& text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
    if (error != std::errc() || !std::isfinite(value)) return {};
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    return value;
}
}  // namespace

std::optional<std::uint32_t> rate(std::string_view text) {
    const auto value = leading(text);
    if (!value) return {};
    const double unit = text == "k" ? 1e3 : text == "M" ? 1e6 : text.empty() ? 1 : 0;
    const double bits = *value * unit;
    if (bits < 5e3 || bits > 20e6) return {};
    return static_cast<std::uint32_t>(std::lround(bits));
}

std::optional<Time> duration(std::string_view text) {
    if (text == "0") return 0;
    const auto value = leading(text);
    if (!value || *value < 0) return {};
    const Time   unit = text == "us" ? microsecond : text == "ms" ? millisecond : text == "s" ? second : text == "min" ? 60 * second : 0;
    const double ns = *value * static_cast<double>(unit);
    if (unit == 0 || ns > 1e15) return {};
    return static_cast<Time>(std::llround(ns));
}

std::optional<bool> yes_or_no(std::string_view text) {
    const std::string word = lower(text);
    if (word == "yes" || word == "true" || word == "on" || word == "1") return true;
    if (word == "no" || word == "false" || word == "off" || word == "0") return false;
    return {};
}

std::string object_label(std::uint16_t index, unsigned sub, bool single) {
    constexpr char digits[] = "0123456789ABCDEF";
    std::string    out = "0x";
    for (int shift = 12; shift >= 0; shift -= 4) out += digits[index >> shift & 15];
    return single ? out : out + ":" + std::to_string(sub);
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
    std::vector<std::pair<std::size_t, const std::string*>> near;
    const std::size_t                                       limit = std::max<std::size_t>(1, word.size() / 3);
    for (const std::string& candidate : candidates) {
        if (candidate.size() > 200 || word.size() > 200) continue;
        std::size_t d = distance(word, candidate);
        // "position-actual" for "position-actual-value"
        if (word.size() >= 4 && candidate.find(word) != candidate.npos) d = std::min<std::size_t>(d, 1);
        if (d <= limit) near.emplace_back(d, &candidate);
    }
    std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (near.empty()) return {};
    std::string out = "did you mean '" + *near[0].second + "'";
    if (near.size() > 1) out += " or '" + *near[1].second + "'";
    return out + "?";
}

std::string listed(const std::vector<std::string>& names, std::size_t most) {
    std::string out;
    for (std::size_t i = 0; i < names.size() && i < most; ++i) out += (i == 0 ? "" : ", ") + names[i];
    if (names.size() > most) out += ", … (" + std::to_string(names.size() - most) + " more)";
    return out;
}

}  // namespace hal::canopen::config
