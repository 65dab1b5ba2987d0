// SPDX-License-Identifier: MIT
#include "ethercat/devices/device_words.hpp"

#include "text/characters.hpp"

namespace hal::ethercat::devices {

namespace {

constexpr char quote = '\'';

/// Returns where a part ends that begins at `begin`: at a character outside of quotes for which
/// `ends` is true.
template <class Ends>
std::size_t end_of(std::string_view text, std::size_t begin, Ends ends) {
    bool quoted = false;
    std::size_t at = begin;
    while (at < text.size() && (quoted || !ends(text[at]))) {
        quoted = quoted != (text[at] == quote);
        ++at;
    }
    return at;
}

bool is_gap(char c) { return is_blank(c) || c == '\r'; }

}  // namespace

std::string device_lines(std::string_view list) {
    std::string lines;
    for (const std::string& device : device_list(list)) {
        lines += device + "\n";
    }
    return lines;
}

std::vector<std::string> device_list(std::string_view list) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= list.size();) {
        const std::size_t end = end_of(list, begin, [](char c) { return c == ','; });
        parts.emplace_back(trimmed(list.substr(begin, end - begin)));
        begin = end + 1;
    }
    return parts;
}

std::vector<text::Word> device_words(const text::Word& line) {
    const std::string_view text = line.text;
    std::vector<text::Word> words;
    for (std::size_t end = 0; end < text.size();) {
        std::size_t begin = end;
        while (begin < text.size() && is_gap(text[begin])) {
            ++begin;
        }
        end = end_of(text, begin, is_gap);
        if (end == begin) break;
        text::Word word = text::part(line, begin, end);
        word.text = without_device_quotes(word.text);
        words.push_back(std::move(word));
    }
    return words;
}

std::string without_device_quotes(std::string_view text) {
    std::string out;
    bool quoted = false;
    for (std::size_t n = 0; n < text.size(); ++n) {
        if (text[n] != quote) {
            out += text[n];
        } else if (quoted && n + 1 < text.size() && text[n + 1] == quote) {
            out += quote;
            ++n;
        } else {
            quoted = !quoted;
        }
    }
    return out;
}

std::string device_value(std::string_view value) {
    if (value.find_first_of(" \t,'") == value.npos) return std::string(value);
    std::string out(1, quote);
    for (const char c : value) {
        out += c;
        if (c == quote) {
            out += quote;
        }
    }
    return out + quote;
}

}  // namespace hal::ethercat::devices
