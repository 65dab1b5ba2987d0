// SPDX-License-Identifier: MIT
// Numbers of LBP16 and HostMot2 in bytes: little endian.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>

namespace hal::mesa {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

/// Returns the number at `from`, which need not be aligned. [any]
template <std::integral T>
T load(const void* from) noexcept {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
/// Stores a number at `to`, which need not be aligned. [any]
template <std::integral T>
void store(void* to, T value) noexcept {
    std::memcpy(to, &value, sizeof value);
}

}  // namespace hal::mesa
