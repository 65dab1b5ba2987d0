// SPDX-License-Identifier: MIT
// Numbers and durations as people write them. The locale never matters. Everything here is [setup].
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace hal {

/// Parses a text that is one number and nothing else, without a leading + or 0x. Returns false and
/// leaves `to` unchanged if it is not, or if the number is out of range for the type.
template <std::integral Number>
bool parse_whole(std::string_view text, Number& to, int base = 10) {
    Number value{};
    const auto [stop, status] = std::from_chars(text.begin(), text.end(), value, base);
    const bool good = status == std::errc{} && stop == text.end();
    to = good ? value : to;
    return good;
}
template <std::floating_point Number>
bool parse_whole(std::string_view text, Number& to) {
    Number value{};
    const auto [stop, status] = std::from_chars(text.begin(), text.end(), value);
    const bool good = status == std::errc{} && stop == text.end();
    to = good ? value : to;
    return good;
}

/// Removes 0x or 0X before digits. Returns whether it was there.
constexpr bool remove_hex_prefix(std::string_view& text) {
    const bool found = text.size() > 2 && (text.starts_with("0x") || text.starts_with("0X"));
    text.remove_prefix(found ? 2 : 0);
    return found;
}

/// Parses an unsigned integer, decimal or hexadecimal with 0x.
std::optional<std::uint64_t> parse_natural(std::string_view text);

/// Parses a finite decimal number, as in -1.5 or 2e-3.
std::optional<double> parse_real(std::string_view text);

/// A number and the word after it, with or without a blank between them: "500k", "12.5 us".
struct Quantity {
    double number = 0;
    std::string_view unit;  ///< empty: none
};
std::optional<Quantity> parse_quantity(std::string_view text);

/// Parses a duration of 0 or more, in ns: "10s", "250ms", "50us", "100ns", "2min", "1.5h". A number
/// without a unit counts in units of
/// `bare_unit_ns`; with 0 it is rejected, unless it is 0.
std::optional<std::int64_t> parse_duration_ns(std::string_view text, double bare_unit_ns = 1e9);
std::optional<std::int64_t> parse_duration_ns(std::string_view text, bool) = delete;

/// Formats a duration in ns with three digits: "1.50 ms", "12 us", "10 s".
std::string format_duration(double ns);

}  // namespace hal
