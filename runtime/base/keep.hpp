// SPDX-License-Identifier: MIT
// What can never be given back, because a thread that hangs in a component may still use it.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>

namespace hal {

/// Never frees what it is given, and remembers where it is, so that a leak checker can tell it from what was lost. [any]
template <class T>
void keep_for_good(std::unique_ptr<T> object) noexcept {
    static std::array<std::atomic<void*>, 64> kept;
    static std::atomic<std::size_t> count;
    T* const last = object.release();
    if (const std::size_t i = count++; i < kept.size()) kept[i] = last;
}

}  // namespace hal
