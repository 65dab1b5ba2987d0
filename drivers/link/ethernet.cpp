// SPDX-License-Identifier: MIT
#include "link/ethernet.hpp"

#include <algorithm>

namespace hal::ethernet {

const char* to_string(Sent sent) noexcept {
    constexpr const char* words[] = {"queued", "full", "late", "down", "rejected"};
    return words[static_cast<std::size_t>(sent)];
}

std::string to_string(const Address& address) {
    std::string text;
    for (const auto b : address) {
        if (!text.empty()) {
            text += ':';
        }
        text += "0123456789abcdef"[b >> 4];
        text += "0123456789abcdef"[b & 15];
    }
    return text;
}

std::optional<Address> parse_address(std::string_view text) noexcept {
    Address address{};
    if (text.size() != 17) return std::nullopt;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (i % 3 == 2) {
            if (text[i] != ':' && text[i] != '-') return std::nullopt;
            continue;
        }
        const auto digit = std::string_view("0123456789ABCDEFabcdef").find(text[i]);
        if (digit == std::string_view::npos) return std::nullopt;
        auto& byte = address[i / 3];
        byte = static_cast<std::uint8_t>(byte << 4 | (digit < 16 ? digit : digit - 6));
    }
    return address;
}

}  // namespace hal::ethernet
