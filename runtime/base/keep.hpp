// SPDX-License-Identifier: MIT
// Objects that are never freed: a hung thread may still use them, or the process ends.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>

namespace hal {

/// Keeps an object for ever. Its address stays reachable, so that a leak checker does not report
/// it. [any]
template <class T>
void keep_for_good(std::unique_ptr<T> object) noexcept {
    static std::array<std::atomic<void*>, 64> kept;
    static std::atomic<std::size_t> count;
    T* const last = object.release();
    if (const std::size_t i = count++; i < kept.size()) {
        kept[i] = last;
    }
}

}  // namespace hal
