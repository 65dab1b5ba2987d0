// SPDX-License-Identifier: MIT
#include "text/numbers.hpp"

#include <charconv>
#include <cmath>

#include "text/characters.hpp"

namespace hal {

namespace {

struct Unit {
    const char* name;
    double ns;
};
constexpr Unit duration_units[] = {{"ns", 1},  {"us", 1e3},   {"µs", 1e3},  {"ms", 1e6},
                                   {"s", 1e9}, {"min", 60e9}, {"h", 3600e9}};

}  // namespace

std::optional<std::uint64_t> parse_natural(std::string_view text) {
    const int base = remove_hex_prefix(text) ? 16 : 10;
    std::uint64_t value = 0;
    return parse_whole(text, value, base) ? std::optional(value) : std::nullopt;
}

std::optional<double> parse_real(std::string_view text) {
    const auto quantity = parse_quantity(text);
    return quantity && quantity->unit.empty() && !is_blank(text.back())
               ? std::optional(quantity->number)
               : std::nullopt;
}

std::optional<Quantity> parse_quantity(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
        text.remove_prefix(1);
    }
    Quantity out;
    const auto [stop, status] = std::from_chars(text.begin(), text.end(), out.number);
    if (status != std::errc{} || !std::isfinite(out.number)) return std::nullopt;
    out.unit = std::string_view(stop, text.end());
    while (!out.unit.empty() && is_blank(out.unit.front())) {
        out.unit.remove_prefix(1);
    }
    return out;
}

std::optional<std::int64_t> parse_duration_ns(std::string_view text, double bare_unit_ns) {
    const auto quantity = parse_quantity(text);
    if (!quantity || !(quantity->number >= 0)) return std::nullopt;
    double unit_ns = bare_unit_ns;
    if (!quantity->unit.empty()) {
        unit_ns = 0;
        for (const Unit& unit : duration_units) {
            if (quantity->unit == unit.name) {
                unit_ns = unit.ns;
            }
        }
        if (unit_ns == 0) return std::nullopt;
    }
    const double ns = quantity->number * unit_ns;
    if ((unit_ns == 0 && quantity->number != 0) || !(ns < 9.2e18)) return std::nullopt;
    return std::llround(ns);
}

std::string format_duration(double ns) {
    static constexpr Unit shown_units[] = {{" s", 1e9}, {" ms", 1e6}, {" us", 1e3}, {" ns", 1}};
    const Unit* unit = shown_units;
    // 999.7 us is already 1.00 ms at three digits.
    while (unit->ns > 1 && std::fabs(ns) < 0.9995 * unit->ns) {
        ++unit;
    }
    const double number = ns / unit->ns;
    const double magnitude = std::fabs(number);
    int decimals = 2;
    if (number == std::floor(number) || magnitude >= 99.95) {
        decimals = 0;
    } else if (magnitude >= 9.995) {
        decimals = 1;
    }
    char text[400];
    const auto end =
        std::to_chars(text, text + sizeof text, number, std::chars_format::fixed, decimals).ptr;
    return std::string(text, end) + unit->name;
}

}  // namespace hal
