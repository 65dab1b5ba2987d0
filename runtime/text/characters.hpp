// SPDX-License-Identifier: MIT
// Letters and blanks of names and files, whatever the locale. Everything here is [any].
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

namespace hal {

/// Returns whether `c` separates words within a line.
constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

/// Returns the lower-case form of an ASCII letter, any other byte unchanged.
constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Returns the upper-case form of an ASCII letter, any other byte unchanged.
constexpr char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

/// Returns whether `c` is a decimal digit.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Returns whether `c` is an ASCII letter.
constexpr bool is_letter(char c) { return lower(c) >= 'a' && lower(c) <= 'z'; }

/// Returns whether `c` is an ASCII letter or a digit.
constexpr bool is_alphanumeric(char c) { return is_letter(c) || is_digit(c); }

/// Returns whether `c` may be part of a name: a letter, a digit, or one of . - _
constexpr bool is_name_character(char c) {
    return is_alphanumeric(c) || c == '.' || c == '-' || c == '_';
}

/// Returns the value of a hexadecimal digit; -1 for any other character.
constexpr int hex_digit(char c) {
    if (is_digit(c)) return c - '0';
    return lower(c) >= 'a' && lower(c) <= 'f' ? lower(c) - 'a' + 10 : -1;
}

/// Returns the text with its ASCII letters in lower case.
inline std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), [](char c) { return lower(c); });
    return out;
}

/// Compares two texts without regard to the case of ASCII letters.
inline bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return lower(x) == lower(y); });
}

/// Returns the index of the first character from `from` on that does not satisfy the predicate; the
/// size of the text if all do.
template <class Predicate>
constexpr std::size_t end_of_run(std::string_view text, std::size_t from, Predicate satisfies) {
    while (from < text.size() && satisfies(text[from])) {
        ++from;
    }
    return from;
}

/// Removes blanks and line ends at both ends.
constexpr std::string_view trimmed(std::string_view text) {
    const auto gap = [](char c) { return is_blank(c) || c == '\r' || c == '\n'; };
    while (!text.empty() && gap(text.front())) {
        text.remove_prefix(1);
    }
    while (!text.empty() && gap(text.back())) {
        text.remove_suffix(1);
    }
    return text;
}

/// Makes a HAL name: lower case, and one dash for each run of other characters than letters and
/// digits.
inline std::string dashed(std::string_view name) {
    std::string out;
    for (const char c : name) {
        const char s = lower(c);
        if (is_alphanumeric(s)) {
            out += s;
        } else if (!out.empty() && out.back() != '-') {
            out += '-';
        }
    }
    while (!out.empty() && out.back() == '-') {
        out.pop_back();
    }
    return out;
}

/// Counts the characters of a UTF-8 text.
inline std::uint32_t characters(std::string_view text) {
    return static_cast<std::uint32_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace hal
