// SPDX-License-Identifier: MIT
#include "bus/config/object_address.hpp"

#include <algorithm>
#include <cstdio>

#include "text/numbers.hpp"

namespace hal::bus {

namespace {

constexpr std::size_t index_digits = 4;

bool has_prefix(std::string_view text) { return text.starts_with("0x") || text.starts_with("0X"); }

std::optional<unsigned> parse_hex(std::string_view digits, unsigned max) {
    unsigned value = 0;
    if (!parse_whole(digits, value, 16) || value > max) return std::nullopt;
    return value;
}

std::optional<unsigned> parse_index(std::string_view text) {
    const bool prefixed = has_prefix(text);
    if (prefixed) {
        text.remove_prefix(2);
    }
    const bool complete = prefixed ? text.size() <= index_digits : text.size() == index_digits;
    return complete ? parse_hex(text, 0xffff) : std::nullopt;
}

/// Sets `sub` and `form`. Returns false for an invalid sub-index.
bool parse_sub(std::string_view text, ObjectAddress& to) {
    if (const auto value = parse_natural(text)) {
        if (*value > 0xff) return false;
        to.sub = static_cast<std::uint8_t>(*value);
        if (text.size() == 2 && *value >= 10) {
            to.form = SubForm::two_digits;
        }
        return true;
    }
    const auto value = text.size() <= 2 ? parse_hex(text, 0xff) : std::nullopt;
    if (!value) return false;
    to.sub = static_cast<std::uint8_t>(*value);
    to.form = SubForm::bare_hex;
    return true;
}

}  // namespace

std::optional<ObjectAddress> parse_object_address(std::string_view text) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const auto index = parse_index(text.substr(0, colon));
    if (!index) return std::nullopt;
    ObjectAddress out;
    out.index = static_cast<std::uint16_t>(*index);
    out.has_sub = colon < text.size();
    if (out.has_sub && !parse_sub(text.substr(colon + 1), out)) return std::nullopt;
    return out;
}

std::string hex_text(unsigned value, int min_digits) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%0*X", min_digits, value);
    return text;
}

std::string index_text(std::uint16_t index) { return hex_text(index, index_digits); }

std::string object_text(std::uint16_t index, unsigned sub) {
    return index_text(index) + ":" + std::to_string(sub);
}

}  // namespace hal::bus
