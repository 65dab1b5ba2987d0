// SPDX-License-Identifier: MIT
// Bytes as text, for comparisons.
#pragma once

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

namespace hal::test {

inline std::string hex(std::span<const std::uint8_t> bytes) {
    std::string text;
    char part[4];
    for (const std::uint8_t byte : bytes) {
        std::snprintf(part, sizeof part, "%02X ", byte);
        text += part;
    }
    if (!text.empty()) {
        text.pop_back();
    }
    return text;
}

inline std::vector<std::uint8_t> from_hex(const std::string& text) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t n = 0; n + 1 < text.size(); n += 3) {
        bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(n, 2), nullptr, 16)));
    }
    return bytes;
}

}  // namespace hal::test
