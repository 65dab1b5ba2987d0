// SPDX-License-Identifier: MIT
// The order of names for people: axis2 before axis10.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <string_view>

namespace hal {

namespace detail {

/// Returns the end of the digits that begin at `at`.
constexpr std::size_t end_of_digits(std::string_view name, std::size_t at) {
    while (at < name.size() && name[at] >= '0' && name[at] <= '9') {
        ++at;
    }
    return at;
}

/// Compares two numbers written in decimal, of any length.
constexpr std::strong_ordering compare_digits(std::string_view a, std::string_view b) {
    a.remove_prefix(std::min(a.find_first_not_of('0'), a.size()));
    b.remove_prefix(std::min(b.find_first_not_of('0'), b.size()));
    if (a.size() != b.size()) return a.size() <=> b.size();
    return a.compare(b) <=> 0;
}

}  // namespace detail

/// Compares names with their digits as numbers, and the rest byte by byte. Names that differ only
/// in leading zeros have the order of their bytes, so only equal names are equal. The page of
/// `hal panel` has the same order (tools/panel/page/names.js). [any]
constexpr std::strong_ordering compare_names(std::string_view a, std::string_view b) {
    std::size_t i = 0;
    std::size_t k = 0;
    while (i < a.size() && k < b.size()) {
        const std::size_t digits_a = detail::end_of_digits(a, i);
        const std::size_t digits_b = detail::end_of_digits(b, k);
        std::strong_ordering order = std::strong_ordering::equal;
        if (digits_a > i && digits_b > k) {
            order = detail::compare_digits(a.substr(i, digits_a - i), b.substr(k, digits_b - k));
            i = digits_a;
            k = digits_b;
        } else {
            order = static_cast<unsigned char>(a[i++]) <=> static_cast<unsigned char>(b[k++]);
        }
        if (order != 0) return order;
    }
    if (const auto rest = (a.size() - i) <=> (b.size() - k); rest != 0) return rest;
    return a.compare(b) <=> 0;
}

/// Whether `a` comes before `b`.
constexpr bool natural_less(std::string_view a, std::string_view b) {
    return compare_names(a, b) < 0;
}

}  // namespace hal
