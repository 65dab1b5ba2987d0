// SPDX-License-Identifier: MIT
#include "spaces.hpp"

#include <algorithm>

namespace hal::mesa {

namespace {

constexpr std::uint16_t cookie = 0x5a00;

}  // namespace

std::array<std::uint8_t, Information::size> Information::encode() const noexcept {
    std::array<std::uint8_t, size> bytes{};
    unsigned flags = units & 0xfU;
    flags |= static_cast<unsigned>(kind) << 8;
    flags |= is_writable ? 0x8000U : 0U;
    store(bytes.data(), static_cast<std::uint16_t>(cookie | static_cast<unsigned>(space)));
    store(bytes.data() + 2, static_cast<std::uint16_t>(flags));
    store(bytes.data() + 4, range);
    store(bytes.data() + 6, pointer);
    std::copy(name.begin(), name.end(), bytes.begin() + 8);
    return bytes;
}

std::optional<Information> Information::decode(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < size) return {};
    const auto head = load<std::uint16_t>(bytes.data());
    if ((head & 0xfff8U) != cookie) return {};
    const auto flags = load<std::uint16_t>(bytes.data() + 2);
    Information result;
    result.space = static_cast<Space>(head & 7U);
    result.is_writable = (flags & 0x8000U) != 0;
    result.kind = static_cast<Kind>(flags >> 8 & 0x7fU);
    result.units = static_cast<std::uint8_t>(flags & 0xfU);
    result.range = load<std::uint16_t>(bytes.data() + 4);
    result.pointer = load<std::uint16_t>(bytes.data() + 6);
    std::copy_n(bytes.begin() + 8, result.name.size(), result.name.begin());
    return result;
}

std::string_view Information::name_text() const noexcept { return text_of(name); }

std::string_view text_of(std::span<const char> field) noexcept {
    const auto end = std::find(field.begin(), field.end(), '\0');
    return {field.data(), static_cast<std::size_t>(end - field.begin())};
}

std::array<std::uint8_t, 6> reversed_mac(std::span<const std::uint8_t, 6> bytes) noexcept {
    std::array<std::uint8_t, 6> result;
    std::reverse_copy(bytes.begin(), bytes.end(), result.begin());
    return result;
}

}  // namespace hal::mesa
