// SPDX-License-Identifier: MIT
// Sorting that can be abandoned.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace hal {

/// Sorts in short steps, before each of which `stopped()` is asked. Once it returns true, the row is
/// emptied and sorted no further.
template <class T, class Less, class Stopped>
void sort_in_steps(std::vector<T>& row, Less less, Stopped stopped) {
    constexpr std::size_t step = 4096;
    const std::size_t size = row.size();
    const auto at = [&](std::size_t i) {
        return row.begin() + static_cast<std::ptrdiff_t>(std::min(i, size));
    };
    for (std::size_t first = 0; first < size; first += step) {
        if (stopped()) return row.clear();
        std::sort(at(first), at(first + step), less);
    }
    for (std::size_t width = step; width < size; width *= 2) {
        for (std::size_t first = 0; first + width < size; first += 2 * width) {
            if (stopped()) return row.clear();
            std::inplace_merge(at(first), at(first + width), at(first + 2 * width), less);
        }
    }
}

}  // namespace hal
