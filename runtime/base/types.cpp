// SPDX-License-Identifier: MIT
#include "base/types.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

#include <locale.h>

#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace hal {

namespace {

/// Cuts a value that is too long for a message.
std::string shown(std::string_view text) {
    constexpr std::size_t max = 60;
    return text.size() <= max ? std::string(text) : std::string(text.substr(0, max)) + "…";
}

std::string quoted(std::string_view text) { return "'" + shown(text) + "'"; }

template <class T>
std::string out_of_range(std::string_view text, const char* type) {
    return shown(text) + " is out of range for " + type + " (" +
           std::to_string(std::numeric_limits<T>::min()) + " to " +
           std::to_string(std::numeric_limits<T>::max()) + ")";
}

void parse_bit(std::string_view text, bool& value, std::string& problem) {
    for (const char* word : {"true", "1", "yes", "on"}) {
        if (same_word(text, word)) return void(value = true);
    }
    for (const char* word : {"false", "0", "no", "off"}) {
        if (same_word(text, word)) return void(value = false);
    }
    problem = quoted(text) + " is not a bit (TRUE, FALSE, 1, 0, yes, no, on, off)";
}

/// As strtol with base 0 (0x… is hexadecimal, a leading 0 may mean octal), but the whole range of
/// the type is checked.
template <class T>
void parse_integer(std::string_view text, const char* type, LeadingZero zero, T& value,
                   std::string& problem) {
    std::string_view digits = text;
    const bool negative = !digits.empty() && digits[0] == '-';
    if (!digits.empty() && (digits[0] == '-' || digits[0] == '+')) {
        digits.remove_prefix(1);
    }
    int base = 10;
    if (remove_hex_prefix(digits)) {
        base = 16;
    } else if (digits.size() > 1 && digits[0] == '0' && zero == LeadingZero::octal) {
        base = 8;
    }
    std::uint64_t magnitude = 0;
    const auto [stop, status] = std::from_chars(digits.begin(), digits.end(), magnitude, base);
    if (digits.empty() || status == std::errc::invalid_argument || stop != digits.end()) {
        const bool octal = base == 8 && digits.find_first_not_of("0123456789") == digits.npos;
        problem = quoted(text) + (octal ? " is not a whole number (a leading 0 means octal)"
                                        : " is not a whole number");
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

/// Returns what to write in place of "1,5"; empty for any other text, and for "1,500", which may be
/// 1500.
std::string decimal_comma_help(std::string_view text) {
    const std::size_t comma = text.find(',');
    const std::string_view whole = text.substr(text.starts_with('-') ? 1 : 0);
    if (comma == text.npos || whole.front() == ',' || comma + 1 == text.size() ||
        text.size() - comma == 4 || whole.find_first_not_of("0123456789,") != whole.npos ||
        text.find_first_not_of("0123456789", comma + 1) != text.npos) {
        return {};
    }
    return "; write " + std::string(text.substr(0, comma)) + "." +
           std::string(text.substr(comma + 1));
}

void parse_float(std::string_view text, double& value, std::string& problem) {
    // strtod reads what users of LinuxCNC may write (hexadecimal floats, inf); the locale must not
    // turn "0.5" into "0,5".
    static const locale_t c_locale = newlocale(LC_ALL_MASK, "C", nullptr);
    const std::string copy(text);
    char* end = nullptr;
    const double read = strtod_l(copy.c_str(), &end, c_locale);
    const bool blank_first = copy.empty() || std::strchr(" \t\n\v\f\r", copy[0]) != nullptr;
    if (blank_first || end != copy.c_str() + copy.size()) {
        problem = quoted(text) + " is not a number" + decimal_comma_help(text);
        return;
    }
    // "inf" in any case; no digit of any base is an n
    const bool says_infinity = copy.find_first_of("nN") != copy.npos;
    if (std::isinf(read) && !says_infinity) {
        problem = shown(text) + " is out of range for float (up to 1.797693e+308)";
        return;
    }
    value = read;
}

std::string decimal(double value) {
    char text[32];
    const auto end =
        std::to_chars(text, text + sizeof text, value, std::chars_format::general, 7).ptr;
    return {text, end};
}

}  // namespace

std::optional<hal_type> type_named(std::string_view name) {
    for (const TypeRow& row : types) {
        if (same_word(name, row.name) || (!name.empty() && same_word(name, row.newer))) {
            return row.type;
        }
    }
    return std::nullopt;
}

Parsed parse_value(hal_type type, std::string_view text, LeadingZero zero) {
    Parsed parsed;
    parsed.value.raw = 0;  // {} sets the first member of a union only
    if (!row(type).number) {
        parsed.problem = std::string("a ") + name(type) + " has no value to write";
        return parsed;
    }
    visit(type, parsed.value, [&](const auto& member) {
        using Member = std::decay_t<decltype(member)>;
        Member value{};
        if constexpr (std::is_same_v<Member, bool>) {
            parse_bit(text, value, parsed.problem);
        } else if constexpr (std::is_same_v<Member, double>) {
            parse_float(text, value, parsed.problem);
        } else {
            parse_integer(text, name(type), zero, value, parsed.problem);
        }
        std::memcpy(&parsed.value, &value, sizeof value);
    });
    return parsed;
}

namespace {

/// A pattern of 32 bits, or a small negative number for a type without a sign: the author knows
/// what becomes of it.
bool is_bit_pattern(hal_type type, std::string_view text, const hal_value& wide) {
    if (type == HAL_TYPE_U64) return true;
    if (text.starts_with('-')) {
        return type == HAL_TYPE_U32 && wide.s64 >= std::numeric_limits<std::int32_t>::min();
    }
    return (text.starts_with("0x") || text.starts_with("0X")) &&
           wide.u64 <= std::numeric_limits<std::uint32_t>::max();
}

}  // namespace

Parsed parse_wrapping(hal_type type, std::string_view text) {
    Parsed parsed = parse_value(type, text);
    const bool negative = text.starts_with('-');
    const bool wraps =
        type == HAL_TYPE_S32 || type == HAL_TYPE_U32 || (type == HAL_TYPE_U64 && negative);
    if (parsed.problem.empty() || !wraps) return parsed;
    const Parsed wide = parse_value(negative ? HAL_TYPE_S64 : HAL_TYPE_U64, text);
    if (!wide.problem.empty()) return parsed;
    if (!is_bit_pattern(type, text, wide.value)) {
        parsed.warning = std::move(parsed.problem);
    }
    parsed.problem.clear();
    if (type == HAL_TYPE_U64) {
        parsed.value.u64 = wide.value.u64;
    } else {
        parsed.value.u32 = static_cast<std::uint32_t>(wide.value.u64);
    }
    return parsed;
}

namespace {

/// `real` formats a double; every other type has one form only.
template <class Real>
std::string format_with(hal_type type, const hal_value& value, Real&& real) {
    if (type == HAL_TYPE_PORT) {
        return std::to_string(value.port == nullptr ? 0 : value.port->capacity);
    }
    return visit(type, value, [&](const auto& member) -> std::string {
        using Member = std::decay_t<decltype(member)>;
        if constexpr (std::is_same_v<Member, bool>) {
            return member ? "TRUE" : "FALSE";
        } else if constexpr (std::is_same_v<Member, double>) {
            return real(member);
        } else {
            return std::to_string(member);
        }
    });
}

}  // namespace

std::string format_value(hal_type type, const hal_value& value) {
    return format_with(type, value, decimal);
}

std::string format_exact(hal_type type, const hal_value& value) {
    return format_with(type, value, [](double real) {
        char text[32];
        return std::string(text, std::to_chars(text, text + sizeof text, real).ptr);
    });
}

}  // namespace hal
