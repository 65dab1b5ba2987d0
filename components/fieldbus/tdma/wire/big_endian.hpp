// SPDX-License-Identifier: MIT
// Numbers in frames: big endian, as in all frames of RTnet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hal::tdma {

/// Reads the number of sizeof(T) bytes at `at`, which must be within `bytes`. [any]
template <class T>
constexpr T get(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
        value = value << 8 | bytes[at + i];
    }
    return static_cast<T>(value);
}

/// Writes the number at `at`, which must be within `bytes`. [any]
template <class T>
constexpr void put(std::span<std::uint8_t> bytes, std::size_t at, T value) noexcept {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
        bytes[at + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >>
                                                  (8 * (sizeof(T) - 1 - i)));
    }
}

}  // namespace hal::tdma
