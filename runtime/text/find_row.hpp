// SPDX-License-Identifier: MIT
// Searches in small tables. Everything here is [any].
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>

namespace hal {

/// Returns the first row that satisfies the predicate; nullptr: none.
template <class Rows, class Predicate>
constexpr auto* find_row_if(Rows&& rows, Predicate satisfies) {
    const auto found = std::ranges::find_if(rows, satisfies);
    return found == std::ranges::end(rows) ? nullptr : &*found;
}

/// Returns the first row whose member equals `key`; nullptr: none.
template <class Rows, class Key, class Member>
constexpr auto* find_row(Rows&& rows, const Key& key, Member member) {
    return find_row_if(rows, [&](const auto& row) { return std::invoke(member, row) == key; });
}

}  // namespace hal
