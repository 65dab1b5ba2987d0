// SPDX-License-Identifier: MIT
// The numbers in the words of `hal can` and `hal node`.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

namespace hal::tools {

/// Returns a number in decimal or 0x…; nullopt: invalid, or above 64 bits. [any]
inline std::optional<std::uint64_t> parse_number(std::string_view text) {
    const bool hex = text.starts_with("0x");
    const std::string_view digits = text.substr(hex ? 2 : 0);
    const int base = hex ? 16 : 10;
    const char* end = digits.data() + digits.size();
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(digits.data(), end, value, base);
    if (error != std::errc() || stop != end) return std::nullopt;
    return value;
}

}  // namespace hal::tools
