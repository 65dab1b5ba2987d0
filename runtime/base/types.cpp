// SPDX-License-Identifier: MIT
#include "base/types.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

#include <locale.h>

namespace hal {

namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_word(std::string_view text, std::string_view lower_word) {
    if (text.size() != lower_word.size()) return false;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (lower(text[i]) != lower_word[i]) return false;
    return true;
}

/// The text as a message shows it: a book-length value is cut.
std::string shown(std::string_view text) {
    constexpr std::size_t most = 60;
    return text.size() <= most ? std::string(text) : std::string(text.substr(0, most)) + "…";
}

std::string quoted(std::string_view text) { return "'" + shown(text) + "'"; }

template <class T>
std::string out_of_range(std::string_view text, const char* type) {
    return shown(text) + " is out of range for " + type + " (" + std::to_string(std::numeric_limits<T>::min()) + " to " +
           std::to_string(std::numeric_limits<T>::max()) + ")";
}

void parse_bit(std::string_view text, bool& value, std::string& problem) {
    for (const char* word : {"true", "1", "yes", "on"})
        if (same_word(text, word)) return void(value = true);
    for (const char* word : {"false", "0", "no", "off"})
        if (same_word(text, word)) return void(value = false);
    problem = quoted(text) + " is not a bit (TRUE, FALSE, 1, 0, yes, no, on, off)";
}

/// As strtol with base 0 (0x… is hexadecimal, a leading 0 octal), but the whole range of the type is checked.
template <class T>
void parse_integer(std::string_view text, const char* type, T& value, std::string& problem) {
    std::string_view digits = text;
    const bool negative = !digits.empty() && digits[0] == '-';
    if (!digits.empty() && (digits[0] == '-' || digits[0] == '+')) digits.remove_prefix(1);
    int base = 10;
    if (digits.size() > 2 && digits[0] == '0' && lower(digits[1]) == 'x') {
        base = 16;
        digits.remove_prefix(2);
    } else if (digits.size() > 1 && digits[0] == '0') {
        base = 8;
    }
    std::uint64_t magnitude = 0;
    const auto [stop, status] = std::from_chars(digits.begin(), digits.end(), magnitude, base);
    if (digits.empty() || status == std::errc::invalid_argument || stop != digits.end()) {
        const bool octal = base == 8 && digits.find_first_not_of("0123456789") == digits.npos;
        problem = quoted(text) + (octal ? " is not a whole number (a leading 0 means octal)" : " is not a whole number");
        return;
    }
    const auto limit = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    const std::uint64_t negative_limit = std::is_signed_v<T> ? limit + 1 : 0;
    if (status != std::errc{} || magnitude > (negative ? negative_limit : limit)) {
        problem = out_of_range<T>(text, type);
        return;
    }
    value = static_cast<T>(negative ? 0 - magnitude : magnitude);
}

void parse_float(std::string_view text, double& value, std::string& problem) {
    // strtod reads what users of LinuxCNC may write (hexadecimal floats, inf); the locale must not turn "0.5" into "0,5".
    static const locale_t c_locale = newlocale(LC_ALL_MASK, "C", nullptr);
    const std::string copy(text);
    char* end = nullptr;
    const double read = strtod_l(copy.c_str(), &end, c_locale);
    const bool blank_first = copy.empty() || std::strchr(" \t\n\v\f\r", copy[0]) != nullptr;
    if (blank_first || end != copy.c_str() + copy.size()) {
        problem = quoted(text) + " is not a number";
        return;
    }
    const bool says_infinity = copy.find_first_of("nN") != copy.npos;  // "inf" in any case; no digit of any base is an n
    if (std::isinf(read) && !says_infinity) {
        problem = shown(text) + " is out of range for float (up to 1.797693e+308)";
        return;
    }
    value = read;
}

std::string decimal(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 7).ptr;
    return {text, end};
}

struct Unit {
    const char* name;
    double ns;
};
constexpr Unit units[] = {{"ns", 1}, {"us", 1e3}, {"µs", 1e3}, {"ms", 1e6}, {"s", 1e9}, {"min", 60e9}, {"h", 3600e9}};

}  // namespace

std::optional<hal_type> type_named(std::string_view name) {
    for (const TypeRow& row : types)
        if (name == row.name || (!name.empty() && name == row.newer)) return row.type;
    return std::nullopt;
}

Parsed parse_value(hal_type type, std::string_view text) {
    Parsed parsed;
    parsed.value.raw = 0;  // {} sets the first member of a union only
    if (!row(type).number) {
        parsed.problem = std::string("a ") + name(type) + " has no value to write";
        return parsed;
    }
    visit(type, parsed.value, [&](const auto& member) {
        using Member = std::decay_t<decltype(member)>;
        Member value{};
        if constexpr (std::is_same_v<Member, bool>) parse_bit(text, value, parsed.problem);
        else if constexpr (std::is_same_v<Member, double>) parse_float(text, value, parsed.problem);
        else parse_integer(text, name(type), value, parsed.problem);
        std::memcpy(&parsed.value, &value, sizeof value);
    });
    return parsed;
}

namespace {

/// `real` words a double; everything else has one form only.
template <class Real>
std::string format_with(hal_type type, const hal_value& value, Real&& real) {
    if (type == HAL_TYPE_PORT) return std::to_string(value.port == nullptr ? 0 : value.port->capacity);
    return visit(type, value, [&](const auto& member) -> std::string {
        using Member = std::decay_t<decltype(member)>;
        if constexpr (std::is_same_v<Member, bool>) return member ? "TRUE" : "FALSE";
        else if constexpr (std::is_same_v<Member, double>) return real(member);
        else return std::to_string(member);
    });
}

}  // namespace

std::string format_value(hal_type type, const hal_value& value) { return format_with(type, value, decimal); }

std::string format_exact(hal_type type, const hal_value& value) {
    return format_with(type, value, [](double real) {
        char text[32];
        return std::string(text, std::to_chars(text, text + sizeof text, real).ptr);
    });
}

std::optional<std::int64_t> parse_duration_ns(std::string_view text, bool bare_ns) {
    double number = 0;
    const auto [stop, status] = std::from_chars(text.begin(), text.end(), number);
    if (status != std::errc{} || !(number >= 0)) return std::nullopt;
    const std::string_view unit(stop, text.end());
    double factor = bare_ns ? 1 : 1e9;
    if (!unit.empty()) {
        factor = 0;
        for (const Unit& candidate : units)
            if (unit == candidate.name) factor = candidate.ns;
    }
    const double ns = number * factor;
    if (factor == 0 || !(ns < 9.2e18)) return std::nullopt;
    return std::llround(ns);
}

std::string format_duration(double ns) {
    static constexpr Unit shown_units[] = {{" s", 1e9}, {" ms", 1e6}, {" us", 1e3}, {" ns", 1}};
    const Unit* unit = shown_units;
    // 999.7 us is already 1.00 ms at three digits.
    while (unit->ns > 1 && std::fabs(ns) < 0.9995 * unit->ns) ++unit;
    const double number = ns / unit->ns, digits = std::fabs(number);
    const bool whole = number == std::floor(number);
    const int places = whole || digits >= 99.95 ? 0 : digits >= 9.995 ? 1 : 2;
    char text[400];
    const auto end = std::to_chars(text, text + sizeof text, number, std::chars_format::fixed, places).ptr;
    return std::string(text, end) + unit->name;
}

}  // namespace hal
