// SPDX-License-Identifier: MIT
#include "eds_types.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>

#include "cia301/values.hpp"
#include "eds_text.hpp"
#include "text/characters.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::canopen::eds {

namespace {

constexpr DataType table[] = {
    {0x01, "BOOLEAN", Kind::boolean, 1},
    {0x02, "INTEGER8", Kind::integer, 8},
    {0x03, "INTEGER16", Kind::integer, 16},
    {0x04, "INTEGER32", Kind::integer, 32},
    {0x05, "UNSIGNED8", Kind::natural, 8},
    {0x06, "UNSIGNED16", Kind::natural, 16},
    {0x07, "UNSIGNED32", Kind::natural, 32},
    {0x08, "REAL32", Kind::real, 32},
    {0x09, "VISIBLE_STRING", Kind::text, 0},
    {0x0A, "OCTET_STRING", Kind::octets, 0},
    {0x0B, "UNICODE_STRING", Kind::unicode, 0},
    {0x0C, "TIME_OF_DAY", Kind::time, 48},
    {0x0D, "TIME_DIFFERENCE", Kind::time, 48},
    {0x0F, "DOMAIN", Kind::domain, 0},
    {0x10, "INTEGER24", Kind::integer, 24},
    {0x11, "REAL64", Kind::real, 64},
    {0x12, "INTEGER40", Kind::integer, 40},
    {0x13, "INTEGER48", Kind::integer, 48},
    {0x14, "INTEGER56", Kind::integer, 56},
    {0x15, "INTEGER64", Kind::integer, 64},
    {0x16, "UNSIGNED24", Kind::natural, 24},
    {0x18, "UNSIGNED40", Kind::natural, 40},
    {0x19, "UNSIGNED48", Kind::natural, 48},
    {0x1A, "UNSIGNED56", Kind::natural, 56},
    {0x1B, "UNSIGNED64", Kind::natural, 64},
    {0x20, "PDO_COMMUNICATION_PARAMETER", Kind::structure, 0},
    {0x21, "PDO_MAPPING", Kind::structure, 0},
    {0x22, "SDO_PARAMETER", Kind::structure, 0},
    {0x23, "IDENTITY", Kind::structure, 0},
    {0x24, "DEBUGGER_PAR", Kind::structure, 0},
    {0x25, "COMMAND_PAR", Kind::structure, 0},
};

std::string quoted(std::string_view text) {
    constexpr std::size_t max = 60;
    return "'" + std::string(text.substr(0, max)) + (text.size() > max ? "…'" : "'");
}

struct Term {
    std::uint64_t value = 0;
    bool hex = false;
    Spelling spelling = Spelling::plain;
};

std::optional<Term> term(std::string_view text) {
    Term out;
    int base = 10;
    out.hex = remove_hex_prefix(text);
    if (out.hex) {
        base = 16;
    } else if (text.size() > 1 && text[0] == '0') {
        base = text.find_first_of("89") == std::string_view::npos ? 8 : 10;
        out.spelling = base == 8 ? Spelling::octal : Spelling::decimal_with_zero;
    }
    text = text.substr(0, text.find_last_not_of("uUlL") + 1);
    if (!parse_whole(text, out.value, base)) return {};
    // 00 and 007 are the same in both systems.
    if (out.spelling == Spelling::octal && out.value < 8) {
        out.spelling = Spelling::plain;
    }
    return out;
}

std::string range_of(const DataType& type) {
    if (type.kind == Kind::boolean) return "0..1";
    const std::uint64_t top = type.bits == 64 ? ~0ull : (1ull << type.bits) - 1;
    if (type.kind == Kind::natural || type.kind == Kind::time) return "0.." + std::to_string(top);
    return "-" + std::to_string((top >> 1) + 1) + ".." + std::to_string(top >> 1);
}

std::string unfitting(std::string_view text, const DataType& type) {
    return quoted(text) + " does not fit into " + std::string(type.name) + " (" + range_of(type) +
           ")";
}

std::vector<std::uint8_t> little(std::uint64_t value, unsigned bytes) {
    std::vector<std::uint8_t> out(bytes);
    for (unsigned i = 0; i < bytes; ++i) {
        out[i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
    return out;
}

/// A number in sign and magnitude.
struct Signed {
    bool negative = false;
    std::uint64_t magnitude = 0;
};

/// Returns the number with the node ID added where it has one; nothing: it overflows.
std::optional<Signed> with_node_id(const Number& number, unsigned node_id) {
    Signed out{number.negative && number.magnitude != 0, number.magnitude};
    if (!number.node_id) return out;
    if (!out.negative) {
        if (__builtin_add_overflow(out.magnitude, std::uint64_t{node_id}, &out.magnitude)) {
            return {};
        }
    } else if (out.magnitude > node_id) {
        out.magnitude -= node_id;
    } else {
        out = {false, node_id - out.magnitude};
    }
    return out;
}

/// How a number relates to the range of a type.
enum class Fit : std::uint8_t {
    no,
    yes,
    as_bits,  // -1 for 0xFF…, or 0xFF… for -1: the bits are clear
};
Fit fit_of(const Signed& value, const DataType& type) {
    const std::uint64_t top = type.bits == 64 ? ~0ull : (1ull << type.bits) - 1;
    const std::uint64_t half = top >> 1;
    if (type.kind == Kind::integer) {
        if (value.negative) return value.magnitude <= half + 1 ? Fit::yes : Fit::no;
        if (value.magnitude <= half) return Fit::yes;
        return value.magnitude <= top ? Fit::as_bits : Fit::no;
    }
    if (!value.negative) return value.magnitude <= top ? Fit::yes : Fit::no;
    return type.kind == Kind::natural && value.magnitude <= half + 1 ? Fit::as_bits : Fit::no;
}

/// Returns a fraction that is whole, as 12.0 is 12; nothing for any other text.
std::optional<Number> whole_fraction(std::string_view text) {
    const auto real = parse_real(text);
    if (!real || *real != std::floor(*real) || std::fabs(*real) > 9e15) return {};
    return Number{*real < 0, static_cast<std::uint64_t>(std::fabs(*real)), false, false,
                  Spelling::number_as_real};
}

Encoded integer(std::string_view text, const DataType& type, unsigned node_id) {
    Encoded out;
    std::optional<Number> number = parse_number(text);
    if (!number) {
        const bool is_true = same_word(text, "true");
        if (type.kind == Kind::boolean && (is_true || same_word(text, "false"))) {
            return {little(is_true ? 1 : 0, 1), false, Spelling::words, {}};
        }
        number = whole_fraction(text);
    }
    if (!number) {
        out.error = quoted(text) + " is not a number of type " + std::string(type.name);
        return out;
    }
    out.spelling = number->spelling;
    out.node_id = number->node_id;
    const std::optional<Signed> value = with_node_id(*number, node_id);
    const Fit fit = value ? fit_of(*value, type) : Fit::no;
    if (fit == Fit::no) {
        out.error = unfitting(text, type);
        return out;
    }
    if (fit == Fit::as_bits) {
        out.spelling = Spelling::unsigned_for_negative;
    }
    out.bytes = little(value->negative ? ~value->magnitude + 1 : value->magnitude, type.bytes());
    return out;
}

Encoded octets(std::string_view text) {
    Encoded out;
    remove_hex_prefix(text);
    int high = -1;
    for (const char c : text) {
        if (c == ' ' || c == '\t' || c == ',') continue;
        const int digit = hex_digit(c);
        if (digit < 0) {
            out.error = quoted(text) + " is not a sequence of hexadecimal bytes";
            out.bytes.clear();
            return out;
        }
        if (high < 0) {
            high = digit;
        } else {
            out.bytes.push_back(static_cast<std::uint8_t>(high << 4 | digit));
            high = -1;
        }
    }
    if (high < 0) return out;
    out.bytes.clear();
    if (text.size() == 1) {
        out.bytes.push_back(static_cast<std::uint8_t>(high));
    } else {
        out.error = quoted(text) + " has an odd number of hexadecimal digits";
    }
    return out;
}

/// A manufacturer's type: a number as large as it needs, or nothing that could be encoded.
Encoded without_spelling() {
    Encoded out;
    out.error = "values of this data type have no spelling in CiA 306";
    return out;
}

/// Days and milliseconds, with a blank between them. Nothing: all 48 bits are one number.
std::optional<Encoded> days_and_ms(std::string_view text) {
    const std::size_t gap = text.find(' ');
    if (gap == std::string_view::npos) return {};
    const auto days = parse_number(text.substr(0, gap));
    const auto ms = parse_number(text.substr(gap));
    if (!days || !ms || days->negative || ms->negative) return {};
    if (days->magnitude > 0xFFFF || ms->magnitude >= 1u << 28) return {};
    return Encoded{little(ms->magnitude | days->magnitude << 32, 6), false, Spelling::plain, {}};
}

/// Returns true if the text has the bits of a real number in hexadecimal, as some tools write them:
/// a hexadecimal number of their size is nothing else.
bool is_bit_pattern(const Number& number, std::string_view text, const DataType& type) {
    if (!number.hex || number.negative || number.node_id || number.magnitude <= 0xFFFF) {
        return false;
    }
    const unsigned digits = type.bits / 4;
    return number.magnitude >> (type.bits - 1) <= 1 && text.size() <= digits + 2;
}

Encoded real(std::string_view text, const DataType& type) {
    constexpr double max_real32 = 3.4028234663852886e38;
    Encoded out;
    const auto bits = parse_number(text);
    if (bits && is_bit_pattern(*bits, text, type)) {
        out.bytes = little(bits->magnitude, type.bytes());
        out.spelling = Spelling::real_as_bits;
        return out;
    }
    const auto value = parse_real(text);
    if (!value) {
        out.error = quoted(text) + " is not a number of type " + std::string(type.name);
        return out;
    }
    if (type.bits != 32) {
        out.bytes = little(std::bit_cast<std::uint64_t>(*value), 8);
        return out;
    }
    if (std::isfinite(*value) && std::fabs(*value) > max_real32) {
        out.error = quoted(text) + " does not fit into REAL32";
        return out;
    }
    out.bytes = little(std::bit_cast<std::uint32_t>(static_cast<float>(*value)), 4);
    return out;
}

/// Returns the bytes of a UTF-8 character by its first one.
std::size_t utf8_bytes(unsigned char first) {
    if (first < 0x80) return 1;
    if (first < 0xE0) return 2;
    return first < 0xF0 ? 3 : 4;
}

std::vector<std::uint8_t> utf16(std::string_view text) {
    std::vector<std::uint8_t> out;
    const auto unit = [&](std::uint32_t u) {
        out.push_back(static_cast<std::uint8_t>(u));

        out.push_back(static_cast<std::uint8_t>(u >> 8));
    };
    for (std::size_t i = 0; i < text.size();) {
        const auto first = static_cast<unsigned char>(text[i]);
        const std::size_t n = utf8_bytes(first);
        std::uint32_t c = n == 1 ? first : first & (0xFFu >> (n + 1));
        for (std::size_t k = 1; k < n && i + k < text.size(); ++k) {
            c = c << 6 | (static_cast<unsigned char>(text[i + k]) & 0x3Fu);
        }
        i += n;
        if (c < 0x10000) {
            unit(c);
        } else {
            unit(0xD800 + ((c - 0x10000) >> 10 & 0x3FF));
            unit(0xDC00 + ((c - 0x10000) & 0x3FF));
        }
    }
    return out;
}

/// A sum of numbers and at most one `$NODEID`, CiA 306-1: "$NODEID+0x180", "-5", "0x200 - 1".
class NumberParser {
public:
    explicit NumberParser(std::string_view text) : rest_(trimmed(text)) {}

    std::optional<Number> parse() {
        accept_sign();  // the only place of a sign that follows no term
        if (!parse_term()) return std::nullopt;
        while (!rest_.empty()) {
            if (!accept_sign() || !parse_term()) return std::nullopt;
        }
        return sum_;
    }

private:
    bool accept_sign() {
        minus_ = false;
        if (rest_.empty() || (rest_[0] != '+' && rest_[0] != '-')) return false;
        minus_ = rest_[0] == '-';
        rest_ = trimmed(rest_.substr(1));
        return true;
    }

    bool parse_term() {
        const std::size_t stop = std::min(rest_.find_first_of("+- \t"), rest_.size());
        const std::string_view word = rest_.substr(0, stop);
        rest_ = trimmed(rest_.substr(stop));
        if (same_word(word, "$NODEID")) return add_node_id();
        const auto one = term(word);
        return one && add(*one);
    }

    bool add_node_id() {
        if (sum_.node_id || minus_) return false;
        sum_.node_id = true;
        return true;
    }

    /// Returns false when the sum has more than 64 bits.
    bool add(const Term& one) {
        sum_.hex = sum_.hex || one.hex;
        if (one.spelling != Spelling::plain) {
            sum_.spelling = one.spelling;
        }
        if (sum_.negative == minus_ || sum_.magnitude == 0) {
            sum_.negative = minus_;
            return !__builtin_add_overflow(sum_.magnitude, one.value, &sum_.magnitude);
        }
        if (sum_.magnitude >= one.value) {
            sum_.magnitude -= one.value;
            return true;
        }
        sum_.magnitude = one.value - sum_.magnitude;
        sum_.negative = minus_;
        return true;
    }

    std::string_view rest_;
    bool minus_ = false;  // of the term that follows
    Number sum_;
};

}  // namespace

std::span<const DataType> data_types() { return table; }

const DataType* data_type(std::uint16_t code) { return find_row(table, code, &DataType::code); }

const DataType* data_type(std::string_view name) {
    return find_row_if(table, [&](const DataType& type) { return same_word(type.name, name); });
}

std::optional<Number> parse_number(std::string_view text) { return NumberParser(text).parse(); }

std::optional<double> parse_real(std::string_view text) {
    text = trimmed(text);
    if (const auto number = parse_number(text); number && !number->node_id) {
        return number->negative ? -static_cast<double>(number->magnitude)
                                : static_cast<double>(number->magnitude);
    }
    if (!text.empty() && text[0] == '+') {
        text.remove_prefix(1);
    }
    if (!text.empty() && (text.back() == 'f' || text.back() == 'F') &&
        text.find_first_of("xX") == std::string_view::npos && text.size() > 1 &&
        !same_word(text, "inf")) {
        text.remove_suffix(1);
    }
    double out = 0;
    return parse_whole(text, out) ? std::optional(out) : std::nullopt;
}

Encoded encode(std::string_view text, std::uint16_t code, unsigned node_id) {
    text = trimmed(text);
    if (text.empty()) {
        return {};
    }
    const DataType* type = data_type(code);
    if (type == nullptr) return without_spelling();
    switch (type->kind) {
    case Kind::time: {
        const auto parts = days_and_ms(text);
        return parts ? *parts : integer(text, *type, node_id);
    }
    case Kind::boolean:
    case Kind::integer:
    case Kind::natural: return integer(text, *type, node_id);
    case Kind::real: return real(text, *type);
    case Kind::text: {
        Encoded out;
        out.bytes.assign(text.begin(), text.end());
        return out;
    }
    case Kind::unicode: {
        Encoded out;
        out.bytes = utf16(text);
        return out;
    }
    case Kind::structure: return without_spelling();
    default: return octets(text);
    }
}

Encoded encode_strictly(std::string_view text, std::uint16_t code, unsigned node_id) {
    Encoded out = encode(text, code, node_id);
    if (out.spelling == Spelling::octal) {
        out.error = quoted(text) + " would be octal; write it without the 0 in front, or 0x…";
    } else if (out.spelling == Spelling::unsigned_for_negative) {
        const std::optional<Number> number = parse_number(text);
        if (!number || !number->hex || number->negative) {
            out.error = unfitting(text, *data_type(code));
        }
    }
    return out;
}

std::string spell(std::span<const std::uint8_t> bytes, std::uint16_t code) {
    const DataType* type = data_type(code);
    const Kind kind = type == nullptr ? Kind::octets : type->kind;
    if (kind == Kind::text) {
        return {bytes.begin(), bytes.end()};
    }
    if (kind == Kind::octets || kind == Kind::domain || kind == Kind::structure ||
        kind == Kind::unicode || bytes.size() > 8) {
        std::string out;
        for (const std::uint8_t byte : bytes) {
            std::array<char, 4> two{};
            std::snprintf(two.data(), two.size(), "%02X", byte);
            append_item(out, std::string(two.data()), " ");
        }
        return out;
    }
    const std::uint64_t value = cia301::natural_of(bytes);
    std::array<char, 64> text{};
    if (kind == Kind::real) {
        char* end = bytes.size() == 4
                        ? std::to_chars(text.data(), text.data() + text.size(),
                                        std::bit_cast<float>(static_cast<std::uint32_t>(value)))
                              .ptr
                        : std::to_chars(text.data(), text.data() + text.size(),
                                        std::bit_cast<double>(value))
                              .ptr;
        return {text.data(), end};
    }
    if (kind == Kind::integer) {
        return std::to_string(cia301::sign_extended(value, type->bits));
    }
    std::snprintf(text.data(), text.size(), "0x%0*llX", static_cast<int>(2 * bytes.size()),
                  static_cast<unsigned long long>(value));
    return text.data();
}

std::optional<Comparable> comparable(std::string_view text, std::uint16_t code, unsigned node_id) {
    const DataType* type = data_type(code);
    if (type == nullptr || trimmed(text).empty()) return {};
    const bool is_number = type->kind == Kind::boolean || type->kind == Kind::integer ||
                           type->kind == Kind::natural || type->kind == Kind::real;
    if (!is_number) return {};
    const Encoded value = encode(text, code, node_id);
    if (!value) return {};
    const std::uint64_t bits = cia301::natural_of(value.bytes);
    if (type->kind == Kind::real) return cia301::real_of(bits, type->bits);
    if (type->kind != Kind::integer) return bits;
    return cia301::sign_extended(bits, type->bits);
}

}  // namespace hal::canopen::eds
