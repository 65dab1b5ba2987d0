// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/format.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace hal::modules {
namespace {

// The longest double: 309 digits, a point, and 1074 digits that may differ from 0. More precision
// adds zeros.
constexpr int max_exact = 1074;
constexpr std::size_t number_length = 1500;

struct Output {
    char* to;
    std::size_t size, length = 0;

    void put(std::string_view text) noexcept {
        if (length < size && !text.empty()) {
            std::memcpy(to + length, text.data(), std::min(text.size(), size - length));
        }
        length += text.size();
    }
    void fill(char c, std::ptrdiff_t count) noexcept {
        if (count <= 0) return;
        const auto wanted = static_cast<std::size_t>(count);
        if (length < size) {
            std::memset(to + length, c, std::min(wanted, size - length));
        }
        length += wanted;
    }
};

struct Spec {
    bool left = false;
    bool plus = false;
    bool blank = false;
    bool zero = false;
    bool alternate = false;
    int width = 0;
    int precision = -1;  // -1: none
    int longs = 0;                  // -2 hh, -1 h, 1 l, 2 ll, j, z and t, 3 L
    char conversion = 0;

    bool upper() const noexcept { return conversion >= 'A' && conversion <= 'Z'; }
    std::string_view sign(bool negative) const noexcept {
        if (negative) return "-";
        if (plus) return "+";
        if (blank) return " ";
        return "";
    }
};

struct Arguments {
    va_list list;
};

/// PREFIX ZEROS BODY ZEROS TAIL, padded to the width on one side.
struct Number {
    std::string_view prefix, body, tail = {};
    std::ptrdiff_t zeros = 0;
    std::ptrdiff_t zeros_after = 0;
};

void put(Output& out, const Spec& spec, const Number& n, bool pad_with_zeros) noexcept {
    const auto own = static_cast<std::ptrdiff_t>(n.prefix.size() + n.body.size() + n.tail.size()) +
                     n.zeros + n.zeros_after;
    const std::ptrdiff_t padding = spec.width - own;
    const bool zeros = pad_with_zeros && spec.zero && !spec.left;
    if (!spec.left && !zeros) {
        out.fill(' ', padding);
    }
    out.put(n.prefix);
    out.fill('0', n.zeros + (zeros ? std::max<std::ptrdiff_t>(padding, 0) : 0));
    out.put(n.body);
    out.fill('0', n.zeros_after);
    out.put(n.tail);
    if (spec.left) {
        out.fill(' ', padding);
    }
}

void put_text(Output& out, const Spec& spec, std::string_view text) noexcept {
    put(out, spec, {{}, text}, false);
}

void raise_case(char* from, char* to) noexcept {
    for (; from != to; ++from) {
        if (*from >= 'a' && *from <= 'z') {
            *from = static_cast<char>(*from - 'a' + 'A');
        }
    }
}

int base_of(char conversion) noexcept {
    switch (conversion) {
    case 'o': return 8;
    case 'x':
    case 'X':
    case 'p': return 16;
    default: return 10;
    }
}

void put_integer(Output& out, const Spec& spec, std::uint64_t value,
                 std::string_view prefix) noexcept {
    char digits[32];
    const int base = base_of(spec.conversion);
    char* const end = std::to_chars(digits, std::end(digits), value, base).ptr;
    if (spec.upper()) {
        raise_case(digits, end);
    }
    std::string_view body(digits, static_cast<std::size_t>(end - digits));
    if (value == 0 && spec.precision == 0) {
        body = {};
    }
    if (base == 16 && value != 0 && spec.alternate) {
        prefix = spec.upper() ? "0X" : "0x";
    }
    std::ptrdiff_t zeros = spec.precision - static_cast<std::ptrdiff_t>(body.size());
    if (base == 8 && spec.alternate && zeros <= 0 && !body.starts_with('0')) {
        zeros = 1;
    }
    put(out, spec, {prefix, body, {}, std::max<std::ptrdiff_t>(zeros, 0)}, spec.precision < 0);
}

std::int64_t signed_argument(const Spec& spec, Arguments& arguments) noexcept {
    if (spec.longs >= 2) return va_arg(arguments.list, long long);
    if (spec.longs == 1) return va_arg(arguments.list, long);
    const int value = va_arg(arguments.list, int);
    if (spec.longs == -1) return static_cast<short>(value);
    if (spec.longs == -2) return static_cast<signed char>(value);
    return value;
}
std::uint64_t unsigned_argument(const Spec& spec, Arguments& arguments) noexcept {
    if (spec.longs >= 2) return va_arg(arguments.list, unsigned long long);
    if (spec.longs == 1) return va_arg(arguments.list, unsigned long);
    const unsigned value = va_arg(arguments.list, unsigned);
    if (spec.longs == -1) return static_cast<unsigned short>(value);
    if (spec.longs == -2) return static_cast<unsigned char>(value);
    return value;
}

/// %g with the alternate form keeps its zeros, so it is written as %e or %f with the digits that
/// are left.
void resolve_general(Spec& spec, double value) noexcept {
    const int digits = std::max(spec.precision, 1);
    char text[number_length];
    char* const end = std::to_chars(text, std::end(text), value, std::chars_format::scientific,
                                    std::min(digits - 1, max_exact))
                          .ptr;
    const std::string_view all(text, static_cast<std::size_t>(end - text));
    const auto e = all.rfind('e');
    int exponent = 0;
    std::from_chars(text + e + (all[e + 1] == '+' ? 2 : 1), end, exponent);
    const bool fixed = exponent >= -4 && exponent < digits;
    spec.precision = fixed ? digits - 1 - exponent : digits - 1;
    const bool upper = spec.upper();
    spec.conversion = fixed ? 'f' : 'e';
    if (upper) {
        spec.conversion = static_cast<char>(spec.conversion - ('a' - 'A'));
    }
}

std::chars_format format_of(char kind) noexcept {
    switch (kind) {
    case 'f': return std::chars_format::fixed;
    case 'e': return std::chars_format::scientific;
    case 'g': return std::chars_format::general;
    default: return std::chars_format::hex;
    }
}

/// Returns where the exponent begins, or the size.
std::size_t exponent_of(std::string_view digits, char kind) noexcept {
    if (kind == 'f' || kind == 'g') return digits.size();
    return std::min(digits.find_last_of(kind == 'e' ? "eE" : "pP"), digits.size());
}

void put_infinite(Output& out, const Spec& spec, std::string_view sign, bool nan) noexcept {
    char text[] = "inf";
    if (nan) {
        std::memcpy(text, "nan", 3);
    }
    if (spec.upper()) {
        raise_case(text, text + 3);
    }
    put(out, spec, {sign, {text, 3}}, false);
}

void put_real(Output& out, Spec spec, double value) noexcept {
    const std::string_view sign = spec.sign(std::signbit(value));
    value = std::fabs(value);
    if (!std::isfinite(value)) return put_infinite(out, spec, sign, std::isnan(value));
    char kind = static_cast<char>(spec.conversion | 0x20);
    if (spec.precision < 0 && kind != 'a') {
        spec.precision = 6;
    }
    if (kind == 'g' && spec.alternate) {
        resolve_general(spec, value);
        kind = static_cast<char>(spec.conversion | 0x20);
    }
    const std::chars_format format = format_of(kind);
    char digits[number_length];
    const int precision = std::min(spec.precision, max_exact);
    char* const end = spec.precision < 0
                          ? std::to_chars(digits, std::end(digits), value, format).ptr
                          : std::to_chars(digits, std::end(digits), value, format, precision).ptr;
    if (spec.upper()) {
        raise_case(digits, end);
    }
    const std::string_view all(digits, static_cast<std::size_t>(end - digits));
    const std::size_t exponent = exponent_of(all, kind);
    char prefix[4];
    std::size_t prefixed = sign.copy(prefix, 1);
    if (kind == 'a') {
        prefixed += std::string_view(spec.upper() ? "0X" : "0x").copy(prefix + prefixed, 2);
    }
    char body[number_length + 1];
    std::size_t length = all.substr(0, exponent).copy(body, number_length);
    if (spec.alternate && std::string_view(body, length).find('.') == std::string_view::npos) {
        body[length++] = '.';
    }
    const std::ptrdiff_t more = kind == 'g' ? 0 : std::max(spec.precision - precision, 0);
    put(out, spec, {{prefix, prefixed}, {body, length}, all.substr(exponent), 0, more}, true);
}

int number(const char*& at) noexcept {
    std::int64_t value = 0;
    for (; *at >= '0' && *at <= '9'; ++at) {
        value = std::min<std::int64_t>(value * 10 + (*at - '0'), INT_MAX);
    }
    return static_cast<int>(value);
}

/// Reads the flags before the width. Unknown ones to us, ' and I, are skipped.
void read_flags(const char*& at, Spec& spec) noexcept {
    struct Flag {
        char c;
        bool Spec::* member;
    };
    static constexpr Flag flags[] = {{'-', &Spec::left},
                                     {'+', &Spec::plus},
                                     {' ', &Spec::blank},
                                     {'0', &Spec::zero},
                                     {'#', &Spec::alternate}};
    for (;; ++at) {
        const auto flag = std::ranges::find(flags, *at, &Flag::c);
        if (flag != std::end(flags)) {
            spec.*flag->member = true;
        } else if (*at != '\'' && *at != 'I') {
            return;
        }
    }
}

/// Reads the length modifiers: h, l, L and their like.
void read_length(const char*& at, Spec& spec) noexcept {
    for (;; ++at) {
        switch (*at) {
        case 'h': --spec.longs; break;
        case 'l': ++spec.longs; break;
        case 'j':
        case 'q': spec.longs = 2; break;
        case 'z':
        case 't': spec.longs = 1; break;
        case 'L': spec.longs = 3; break;
        default: return;
        }
    }
}

/// Reads what follows the %. Returns false for an argument with a position.
bool read_spec(const char*& at, Spec& spec, Arguments& arguments) noexcept {
    read_flags(at, spec);
    if (*at == '*') {
        ++at;
        const int width = va_arg(arguments.list, int);
        spec.left |= width < 0;
        spec.width = width == INT_MIN ? INT_MAX : std::abs(width);
    } else {
        spec.width = number(at);
        if (*at == '$') return false;
    }
    if (*at == '.') {
        ++at;
        if (*at == '*') {
            spec.precision = std::max(va_arg(arguments.list, int), -1);
            ++at;
        } else {
            spec.precision = number(at);
        }
    }
    read_length(at, spec);
    spec.conversion = *at;
    return true;
}

void convert_signed(Output& out, const Spec& spec, Arguments& arguments) noexcept {
    const std::int64_t value = signed_argument(spec, arguments);
    const auto raw = static_cast<std::uint64_t>(value);
    put_integer(out, spec, value < 0 ? 0 - raw : raw, spec.sign(value < 0));
}

void convert_real(Output& out, const Spec& spec, Arguments& arguments) noexcept {
    const double value = spec.longs == 3 ? static_cast<double>(va_arg(arguments.list, long double))
                                         : va_arg(arguments.list, double);
    put_real(out, spec, value);
}

void convert_character(Output& out, const Spec& spec, Arguments& arguments) noexcept {
    const char c = static_cast<char>(va_arg(arguments.list, int));
    put_text(out, spec, {spec.longs > 0 ? "?" : &c, 1});
}

void convert_text(Output& out, const Spec& spec, Arguments& arguments) noexcept {
    constexpr std::string_view null = "(null)";
    const char* text = va_arg(arguments.list, const char*);
    const bool limited = spec.precision >= 0;
    const auto limit = static_cast<std::size_t>(std::max(spec.precision, 0));
    if (!text) {
        // as glibc: all of it or nothing
        text = limited && limit < null.size() ? "" : null.data();
    } else if (spec.longs > 0) {
        text = "?";  // a wide text
    }
    put_text(out, spec, {text, limited ? strnlen(text, limit) : std::strlen(text)});
}

void convert_pointer(Output& out, const Spec& spec, Arguments& arguments) noexcept {
    const void* const pointer = va_arg(arguments.list, const void*);
    if (!pointer) return put_text(out, spec, "(nil)");
    Spec hex = spec;
    hex.alternate = true;
    put_integer(out, hex, reinterpret_cast<std::uintptr_t>(pointer), "");
}

void convert_error(Output& out, const Spec& spec, int error) noexcept {
    Spec decimal = spec;
    decimal.conversion = 'd';
    out.put("error ");
    put_integer(out, decimal, static_cast<std::uint64_t>(error), "");
}

/// Returns false for an unknown conversion.
bool convert(Output& out, const Spec& spec, Arguments& arguments, int error) noexcept {
    if (spec.conversion == '\0') return false;
    if (std::strchr("di", spec.conversion)) {
        convert_signed(out, spec, arguments);
    } else if (std::strchr("uoxX", spec.conversion)) {
        put_integer(out, spec, unsigned_argument(spec, arguments), "");
    } else if (std::strchr("fFeEgGaA", spec.conversion)) {
        convert_real(out, spec, arguments);
    } else {
        switch (spec.conversion) {
        case 'c': convert_character(out, spec, arguments); break;
        case 's': convert_text(out, spec, arguments); break;
        case 'p': convert_pointer(out, spec, arguments); break;
        case 'n': (void)va_arg(arguments.list, void*); break;
        case 'm': convert_error(out, spec, error); break;
        case '%': out.put("%"); break;
        default: return false;
        }
    }
    return true;
}

}  // namespace

int format_text(char* to, std::size_t size, const char* format, va_list given) noexcept {
    const int error = errno;
    Output out{to, size > 0 ? size - 1 : 0};
    Arguments arguments;
    va_copy(arguments.list, given);
    while (*format) {
        const char* const percent = std::strchr(format, '%');
        if (!percent) break;
        out.put({format, static_cast<std::size_t>(percent - format)});
        const char* at = percent + 1;
        Spec spec;
        if (!read_spec(at, spec, arguments) || spec.conversion == '\0') {
            format = percent;
            break;
        }
        ++at;
        if (!convert(out, spec, arguments, error)) {
            out.put({percent, static_cast<std::size_t>(at - percent)});
        }
        format = at;
    }
    out.put(format);
    va_end(arguments.list);
    if (size > 0) {
        to[std::min(out.length, size - 1)] = '\0';
    }
    return out.length > INT_MAX ? -1 : static_cast<int>(out.length);
}

}  // namespace hal::modules
