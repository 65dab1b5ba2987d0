// SPDX-License-Identifier: MIT
// Little-endian fields of EtherCAT frames, registers and mailboxes.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>

namespace hal::ethercat {

static_assert(std::endian::native == std::endian::little, "fields are copied as they are");

/// Reads a field of `sizeof(T)` bytes. [any]
template <class T>
inline T get(const std::uint8_t* from) noexcept {
    T value{};
    std::memcpy(&value, from, sizeof value);
    return value;
}
/// Writes a field of `sizeof(T)` bytes. [any]
template <class T>
inline void put(std::uint8_t* to, T value) noexcept {
    std::memcpy(to, &value, sizeof value);
}

}  // namespace hal::ethercat
