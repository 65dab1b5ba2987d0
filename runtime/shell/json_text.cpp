// SPDX-License-Identifier: MIT
#include "shell/json_text.hpp"

#include <cmath>

namespace hal {
namespace {

/// The length of the UTF-8 sequence at the beginning of `text`, 0 when it is not one.
std::size_t sequence(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(0);
    const std::size_t length = first < 0x80 ? 1 : first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
    if (length > text.size()) return 0;
    for (std::size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xC0) != 0x80) return 0;
    if (length < 3) return length;
    const unsigned char second = byte(1);  // no overlong forms, no surrogates, nothing beyond U+10FFFF
    const bool good = first == 0xE0   ? second >= 0xA0
                      : first == 0xED ? second < 0xA0
                      : first == 0xF0 ? second >= 0x90
                      : first == 0xF4 ? second < 0x90
                                      : true;
    return good ? length : 0;
}

}  // namespace

void json_quote(std::string& to, std::string_view text) {
    static constexpr char digits[] = "0123456789abcdef";
    to += '"';
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '"' || c == '\\') {
            to += '\\';
            to += c;
            ++i;
        } else if (c == '\n') {
            to += "\\n";
            ++i;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            to += "\\u00";
            to += digits[(c >> 4) & 15];
            to += digits[c & 15];
            ++i;
        } else if (const std::size_t length = sequence(text.substr(i))) {
            to.append(text, i, length);
            i += length;
        } else {
            to += "\xEF\xBF\xBD";
            ++i;
        }
    }
    to += '"';
}

void json_value(std::string& to, hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_BIT) {
        to += value.bit ? "true" : "false";
    } else if (type == HAL_TYPE_FLOAT && !std::isfinite(value.real)) {
        to += std::isnan(value.real) ? "\"nan\"" : value.real > 0 ? "\"inf\"" : "\"-inf\"";
    } else {
        to += format_exact(type, value);
    }
}

}  // namespace hal
