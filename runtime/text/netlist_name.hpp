// SPDX-License-Identifier: MIT
// Names that a netlist can contain: signals, pins, aliases, instances and threads have no others.
#pragma once

#include <string>
#include <string_view>

#include "text/characters.hpp"

namespace hal {

namespace detail {

/// Returns why the parser of netlists reads that character otherwise outside of quotes; nullptr for
/// a character that it leaves as it is.
constexpr const char* meaning_in_netlist(char c) {
    if (is_blank(c)) return "a blank ends the word";
    switch (c) {
    case '#': return "'#' begins a comment";
    case '$': return "'$' begins a variable";
    case '[': return "'[' begins a range or a reference to an INI file";
    case '{': return "'{' begins a set of names";
    default: return nullptr;
    }
}

constexpr bool is_control(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7F;
}

}  // namespace detail

/// Returns why a netlist cannot contain the name as one word: "'#' begins a comment". Returns ""
/// when it can. [any]
inline std::string name_problem(std::string_view name) {
    if (name.empty()) return "it is empty";
    char quote = 0;
    for (const char c : name) {
        if (detail::is_control(c)) return "it contains a line end or another control character";
        if (quote == c) {
            quote = 0;
        } else if (quote == 0 && (c == '"' || c == '\'')) {
            quote = c;
        } else if (const char* const meaning = detail::meaning_in_netlist(c);
                   quote == 0 && meaning) {
            return meaning;
        }
    }
    if (quote != 0) return std::string("the quote ") + quote + " is not closed";
    if (name.back() == '\\') return "a backslash at its end joins two lines";
    if (name == "=>" || name == "<=" || name == "<=>") return "it is an arrow";
    return "";
}

/// Returns the name as a message shows it: without control characters, at most 60 bytes. [any]
inline std::string shown_name(std::string_view name) {
    std::string shown(name.substr(0, 60));
    for (char& c : shown) {
        if (detail::is_control(c)) {
            c = ' ';
        }
    }
    return shown;
}

}  // namespace hal
