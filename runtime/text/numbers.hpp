// SPDX-License-Identifier: MIT
// Numbers and durations as people write them. The locale never matters. Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hal {

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
