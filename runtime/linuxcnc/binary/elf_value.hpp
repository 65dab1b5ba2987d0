// SPDX-License-Identifier: MIT
// Structures in the bytes of a file that may be cut short.
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

namespace hal {

/// Returns the structure at `offset` of `content`, if all of it is there.
template <class T>
std::optional<T> at(std::string_view content, std::uint64_t offset) {
    T value;
    if (offset > content.size() || content.size() - offset < sizeof value) {
        return {};
    }
    std::memcpy(&value, content.data() + offset, sizeof value);
    return value;
}

}  // namespace hal
