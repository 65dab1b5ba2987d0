// SPDX-License-Identifier: MIT
// Values in frames, mailboxes and dictionaries: little endian on both buses.
#pragma once

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

/// Returns the value of an integer type in at most eight bytes, with its sign. [any]
inline std::int64_t integer_of(Type type, std::span<const std::uint8_t> bytes) noexcept {
    std::uint64_t raw = 0;
    std::memcpy(&raw, bytes.data(), bytes.size() < sizeof raw ? bytes.size() : sizeof raw);
    const unsigned bits = bits_of(type);
    const bool negative = is_signed(type) && bits < 64 && (raw >> (bits - 1) & 1) != 0;
    if (negative) {
        raw |= ~std::uint64_t{0} << bits;
    }
    return static_cast<std::int64_t>(raw);
}

}  // namespace hal::cia301
