// SPDX-License-Identifier: MIT
// What several `hal ethercat` commands print and read.
#pragma once

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <fmt/core.h>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "commands/json_text.hpp"

namespace hal::tools {

/// Returns a number in decimal, 0x… or 0…; nullopt: invalid, or above `max`. [any]
inline std::optional<std::uint64_t> ethercat_number(const std::string& text, std::uint64_t max) {
    char* end = nullptr;
    errno = 0;
    const std::uint64_t value = std::strtoull(text.c_str(), &end, 0);
    if (text.empty() || text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0 ||
        value > max) {
        return std::nullopt;
    }
    return value;
}

/// Returns "0x12 0x34". [any]
inline std::string hex_text(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t b : bytes) {
        text += fmt::format("{}0x{:02x}", text.empty() ? "" : " ", b);
    }
    return text;
}

/// Returns what a command prints: its JSON `items`, which begin with "[" unless there are none, as
/// a whole list, or its text. [any]
inline std::string list_or_text(bool json, const std::string& items, const std::string& text) {
    if (!json) return text;
    return (items.empty() ? "[" : items) + "]\n";
}

/// Returns a text as a JSON string. [any]
inline std::string json_string(std::string_view text) {
    std::string out;
    json_quote(out, text);
    return out;
}

}  // namespace hal::tools
