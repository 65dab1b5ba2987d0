// SPDX-License-Identifier: MIT
// Text from outside, made safe to print: control characters and broken UTF-8 as escapes, widths in
// terminal columns.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hal {

/// One character of a text and how a terminal shows it.
struct Glyph {
    std::size_t bytes = 0;    ///< how many of the text it takes; at least 1
    std::size_t columns = 0;  ///< 0 combining, 1, 2 for wide ones; an escape as long as it is
    /// a control character, a direction mark or a broken byte: shown as \xNN
    bool escaped = false;
};

/// The glyph that starts at `at` < text.size(). [any]
Glyph glyph_at(std::string_view text, std::size_t at);

/// Appends the glyph as it is printed.
void append_glyph(std::string& out, std::string_view text, std::size_t at, Glyph glyph);

/// The text on one line: line breaks and tabs as blanks, what cannot be printed as escapes; a word
/// of more than
/// `max_word_size` bytes keeps its beginning and its end with `…` between them.
std::string printable(std::string_view text, std::size_t max_word_size = 200);

/// Terminal columns of a text as printable() shows it.
std::size_t columns(std::string_view text);

}  // namespace hal
