// SPDX-License-Identifier: MIT
#include "text/glyphs.hpp"

#include <algorithm>
#include <iterator>

namespace hal {

namespace {

struct Range {
    char32_t first, last;
};
// The scripts and signs that occur in file names and comments; the rest counts as one column.
constexpr Range combining[] = {
    {0x300, 0x36F},   {0x483, 0x489},   {0x591, 0x5BD},   {0x610, 0x61A},   {0x64B, 0x65F},
    {0x200B, 0x200D}, {0x20D0, 0x20F0}, {0xFE00, 0xFE0F}, {0xFE20, 0xFE2F}, {0xFEFF, 0xFEFF}};
constexpr Range wide[] = {{0x1100, 0x115F},   {0x2E80, 0x303E},   {0x3041, 0xA4CF},
                          {0xAC00, 0xD7A3},   {0xF900, 0xFAFF},   {0xFE30, 0xFE6F},
                          {0xFF00, 0xFF60},   {0xFFE0, 0xFFE6},   {0x1F300, 0x1F64F},
                          {0x1F680, 0x1F6FF}, {0x1F900, 0x1F9FF}, {0x20000, 0x3FFFD}};
// C1 controls and marks that reorder a line: printed raw they would make it read as something else.
constexpr Range unsafe[] = {{0x80, 0x9F}, {0x200E, 0x200F}, {0x2028, 0x202E}, {0x2066, 0x2069}};

template <std::size_t n>
bool in(const Range (&ranges)[n], char32_t code) {
    return std::any_of(std::begin(ranges), std::end(ranges),
                       [code](Range r) { return r.first <= code && code <= r.last; });
}

/// The bytes of a code point that begins with `first`; 0 when none does.
std::size_t encoded_length(unsigned char first) {
    if (first < 0xC2 || first >= 0xF5) return 0;
    if (first < 0xE0) return 2;
    return first < 0xF0 ? 3 : 4;
}

/// The code point at `at` and its length, or length 0 when the bytes are not valid UTF-8.
std::size_t decode(std::string_view text, std::size_t at, char32_t& code) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(at);
    const std::size_t length = encoded_length(first);
    if (length == 0 || at + length > text.size()) return 0;
    code = first & (0x7Fu >> length);
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xC0) != 0x80) return 0;
        code = code << 6 | (byte(at + i) & 0x3Fu);
    }
    constexpr char32_t min_codes[] = {0, 0, 0x80, 0x800, 0x10000};  // by length
    if (code < min_codes[length] || code > 0x10FFFF) return 0;
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    return surrogate ? 0 : length;
}

}  // namespace

Glyph glyph_at(std::string_view text, std::size_t at) {
    const auto first = static_cast<unsigned char>(text[at]);
    if (first < 0x80) {
        const bool control = first < 0x20 || first == 0x7F;
        return {1, control ? 4u : 1u, control};
    }
    char32_t code = 0;
    const std::size_t length = decode(text, at, code);
    if (length == 0) {
        return {1, 4, true};
    }
    if (in(unsafe, code)) {
        return {length, 4 * length, true};
    }
    if (in(combining, code)) return {length, 0, false};
    return {length, in(wide, code) ? 2u : 1u, false};
}

void append_glyph(std::string& out, std::string_view text, std::size_t at, Glyph glyph) {
    if (!glyph.escaped) {
        out += text.substr(at, glyph.bytes);
        return;
    }
    static constexpr char hex[] = "0123456789abcdef";
    for (std::size_t i = at; i < at + glyph.bytes; ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        out += {'\\', 'x', hex[byte >> 4], hex[byte & 15]};
    }
}

namespace {

constexpr std::string_view blanks = " \t\r\n";

void append_printable(std::string& out, std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const Glyph glyph = glyph_at(text, at);
        append_glyph(out, text, at, glyph);
        at += glyph.bytes;
    }
}

}  // namespace

std::string printable(std::string_view text, std::size_t max_word_size) {
    std::string out;
    out.reserve(std::min<std::size_t>(text.size(), 4096));
    for (std::size_t at = 0; at < text.size();) {
        if (blanks.find(text[at]) != blanks.npos) {
            out += ' ';
            ++at;
            continue;
        }
        const std::size_t stop = std::min(text.find_first_of(blanks, at), text.size());
        const std::string_view word = text.substr(at, stop - at);
        at = stop;
        if (word.size() <= max_word_size) {
            append_printable(out, word);
            continue;
        }
        // Cut between characters: not in front of a continuation byte.
        const auto cut = [&](std::size_t offset) {
            while (offset > 0 && offset < word.size() && (word[offset] & 0xC0) == 0x80) {
                --offset;
            }
            return offset;
        };
        append_printable(out, word.substr(0, cut(max_word_size * 2 / 3)));
        out += "…";
        append_printable(out, word.substr(cut(word.size() - max_word_size / 4)));
    }
    return out;
}

std::size_t columns(std::string_view text) {
    std::size_t sum = 0;
    for (std::size_t at = 0; at < text.size();) {
        const Glyph glyph = glyph_at(text, at);
        sum += blanks.find(text[at]) != blanks.npos ? 1 : glyph.columns;
        at += glyph.bytes;
    }
    return sum;
}

}  // namespace hal
