// SPDX-License-Identifier: MIT
// Values in frames, mailboxes and dictionaries: little endian on both buses.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "cia301/types.hpp"

namespace hal::cia301 {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

/// Returns the little-endian value at `from`, which need not be aligned. [any]
template <class T>
    requires std::is_trivially_copyable_v<T>
T load(const void* from) noexcept {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
/// Stores `value` little endian at `to`, which need not be aligned. [any]
template <class T>
    requires std::is_trivially_copyable_v<T>
void store(void* to, T value) noexcept {
    std::memcpy(to, &value, sizeof value);
}

/// Returns the number in the first eight bytes, or in all of fewer. [any]
inline std::uint64_t natural_of(std::span<const std::uint8_t> bytes) noexcept {
    std::uint64_t value = 0;
    if (bytes.empty()) return 0;
    std::memcpy(&value, bytes.data(), std::min(bytes.size(), sizeof value));
    return value;
}
/// Returns the low `bits` of a value, 1..64, with the sign of the highest of them. [any]
constexpr std::int64_t sign_extended(std::uint64_t value, unsigned bits) noexcept {
    const unsigned unused = 64 - bits;
    return static_cast<std::int64_t>(value << unused) >> unused;
}
/// Returns the number of IEEE 754 with these bits, 32 or 64. [any]
constexpr double real_of(std::uint64_t value, unsigned bits) noexcept {
    return bits == 32 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(value))}
                      : std::bit_cast<double>(value);
}
/// Returns the value of an integer type in at most eight bytes, with its sign. [any]
inline std::int64_t integer_of(Type type, std::span<const std::uint8_t> bytes) noexcept {
    const std::uint64_t raw = natural_of(bytes);
    return is_signed(type) ? sign_extended(raw, bits_of(type)) : static_cast<std::int64_t>(raw);
}

}  // namespace hal::cia301
