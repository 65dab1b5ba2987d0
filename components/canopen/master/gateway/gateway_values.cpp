// SPDX-License-Identifier: MIT
#include "gateway_values.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>

#include "canopen/eds/eds_text.hpp"
#include "cia301/values.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::canopen::gateway {

namespace {

constexpr Format table[] = {
    {"b", Type::boolean},
    {"i8", Type::integer8},
    {"i16", Type::integer16},
    {"i24", Type::integer24},
    {"i32", Type::integer32},
    {"i40", Type::integer40},
    {"i48", Type::integer48},
    {"i56", Type::integer56},
    {"i64", Type::integer64},
    {"u8", Type::unsigned8},
    {"u16", Type::unsigned16},
    {"u24", Type::unsigned24},
    {"u32", Type::unsigned32},
    {"u40", Type::unsigned40},
    {"u48", Type::unsigned48},
    {"u56", Type::unsigned56},
    {"u64", Type::unsigned64},
    {"r32", Type::real32},
    {"r64", Type::real64},
    {"t", Type::time_of_day},
    {"td", Type::time_difference},
    {"vs", Type::visible_string},
    {"os", Type::octet_string},
    {"us", Type::unicode_string},
    {"d", Type::domain},
    {"x8", Type::unsigned8, true},
    {"x16", Type::unsigned16, true},
    {"x32", Type::unsigned32, true},
    {"x64", Type::unsigned64, true},
    {"hex", Type::none, true},
};

constexpr std::string_view digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string number_text(std::span<const std::uint8_t> bytes, const Format& format) {
    std::uint64_t value = 0;
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::uint8_t*>(&value));
    std::array<char, 40> text{};
    if (format.hex) {
        std::snprintf(text.data(), text.size(), "0x%0*llX", static_cast<int>(2 * bytes.size()),
                      static_cast<unsigned long long>(value));
        return text.data();
    }
    char* end = text.data();
    char* const limit = text.data() + text.size();
    if (format.type == Type::real32) {
        end = std::to_chars(end, limit, load<float>(bytes.data())).ptr;
    } else if (format.type == Type::real64) {
        end = std::to_chars(end, limit, load<double>(bytes.data())).ptr;
    } else if (is_signed(format.type)) {
        end = std::to_chars(end, limit, cia301::sign_extended(value, bits_of(format.type))).ptr;
    } else {
        end = std::to_chars(end, limit, value).ptr;
    }
    return {text.data(), end};
}

std::string quoted(std::span<const std::uint8_t> bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"') {
            out += '"';
        }
        out += c == '\r' || c == '\n' || c == '\0' ? ' ' : c;  // an answer is one line
    }
    return out + "\"";
}

/// Returns the largest magnitude of a number: a hexadecimal one may have all bits of its type.
std::uint64_t max_magnitude(const Format& format, bool negative, bool hexadecimal) {
    const unsigned bits = bits_of(format.type);
    const std::uint64_t all_ones = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    if (negative) return is_signed(format.type) ? (all_ones >> 1) + 1 : 0;
    return is_signed(format.type) && !hexadecimal ? all_ones >> 1 : all_ones;
}

bool real(std::string_view text, const Format& format, std::uint64_t& value) {
    double number = 0;
    if (!parse_whole(text, number)) return false;
    if (format.type == Type::real32) {
        store(&value, static_cast<float>(number));
    } else {
        store(&value, number);
    }
    return true;
}

bool integer(std::string_view text, const Format& format, std::uint64_t& value) {
    bool negative = false;
    if (!read_number(text, negative, value)) return false;
    if (value > max_magnitude(format, negative, text.starts_with("0x"))) return false;
    if (negative) {
        value = ~value + 1;
    }
    return true;
}

bool number(std::string_view text, const Format& format, std::vector<std::uint8_t>& bytes) {
    std::uint64_t value = 0;
    const bool valid =
        is_real(format.type) ? real(text, format, value) : integer(text, format, value);
    if (!valid) return false;
    bytes.resize((bits_of(format.type) + 7) / 8);
    std::copy_n(reinterpret_cast<const std::uint8_t*>(&value), bytes.size(), bytes.begin());
    return true;
}

bool hex_bytes(std::span<const std::string> words, std::vector<std::uint8_t>& bytes) {
    bytes.clear();
    for (const std::string& word : words) {
        if (word.size() % 2 != 0) return false;
        for (std::size_t n = 0; n < word.size(); n += 2) {
            std::uint8_t byte = 0;
            if (!parse_whole(std::string_view(word).substr(n, 2), byte, 16)) return false;
            bytes.push_back(byte);
        }
    }
    return true;
}

/// Days and milliseconds: 6 bytes, the milliseconds first.
bool time(std::string_view days, std::string_view ms, std::vector<std::uint8_t>& bytes) {
    bool minus = false;
    bool sign = false;
    std::uint64_t d = 0;
    std::uint64_t m = 0;
    if (!read_number(days, minus, d) || !read_number(ms, sign, m) || minus || sign || d > 0xffff ||
        m >= 1U << 28) {
        return false;
    }
    bytes.resize(6);
    store(bytes.data(), static_cast<std::uint32_t>(m));
    store(bytes.data() + 4, static_cast<std::uint16_t>(d));
    return true;
}

}  // namespace

std::span<const Format> formats() { return table; }

const Format* format(std::string_view word) {
    const auto* found = std::find_if(std::begin(table), std::end(table),
                                     [&](const Format& f) { return eds::same_word(f.word, word); });
    return found == std::end(table) ? nullptr : found;
}

const Format* format(Type type) {
    const auto* found = std::find_if(std::begin(table), std::end(table),
                                     [&](const Format& f) { return f.type == type; });
    return found == std::end(table) ? nullptr : found;
}

std::string text_of(std::span<const std::uint8_t> bytes, const Format& format) {
    switch (format.type) {
    case Type::visible_string: return quoted(bytes);
    case Type::octet_string:
    case Type::unicode_string:
    case Type::domain: return base64(bytes);
    case Type::time_of_day:
    case Type::time_difference:
        if (bytes.size() == 6) {
            return std::to_string(load<std::uint16_t>(bytes.data() + 4)) + " " +
                   std::to_string(load<std::uint32_t>(bytes.data()) & 0x0fffffff);
        }
        break;
    default:
        if (bytes_of(format.type) == bytes.size() && !bytes.empty()) {
            return number_text(bytes, format);
        }
    }
    std::string text;
    for (const std::uint8_t byte : bytes) {
        std::array<char, 4> two{};
        std::snprintf(two.data(), two.size(), "%02X", byte);
        append_item(text, std::string(two.data()), " ");
    }
    return text;
}

bool bytes_of(std::span<const std::string> words, const Format& format,
              std::vector<std::uint8_t>& bytes) {
    if (words.size() < words_of(format) ||
        (words.size() > words_of(format) && format.type != Type::none)) {
        return false;
    }
    switch (format.type) {
    case Type::none: return hex_bytes(words, bytes);
    case Type::visible_string: bytes.assign(words[0].begin(), words[0].end()); return true;
    case Type::octet_string:
    case Type::unicode_string:
    case Type::domain: return base64(words[0], bytes);
    case Type::time_of_day:
    case Type::time_difference: return time(words[0], words[1], bytes);
    default: return number(words[0], format, bytes);
    }
}

bool read_number(std::string_view text, bool& negative, std::uint64_t& magnitude) {
    negative = !text.empty() && text[0] == '-';
    if (negative || (!text.empty() && text[0] == '+')) {
        text.remove_prefix(1);
    }
    int base = 10;
    if (remove_hex_prefix(text)) {
        base = 16;
    } else if (text.size() > 1 && text[0] == '0') {
        base = 8;
    }
    return parse_whole(text, magnitude, base);
}

std::string base64(std::span<const std::uint8_t> bytes) {
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t n = 0; n < bytes.size(); n += 3) {
        const std::size_t have = std::min<std::size_t>(3, bytes.size() - n);
        std::uint32_t group = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            group = group << 8 | (i < have ? bytes[n + i] : 0U);
        }
        for (std::size_t i = 0; i < 4; ++i) {
            text += i <= have ? digits[group >> (18 - 6 * i) & 63] : '=';
        }
    }
    return text;
}

bool base64(std::string_view text, std::vector<std::uint8_t>& bytes) {
    bytes.clear();
    if (text.size() % 4 != 0) return false;
    std::size_t padding = 0;
    while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') {
        ++padding;
    }
    std::uint32_t group = 0;
    for (std::size_t n = 0; n < text.size(); ++n) {
        const bool pad = n >= text.size() - padding;
        const auto digit = pad ? 0 : digits.find(text[n]);
        if (digit == std::string_view::npos) return false;
        group = group << 6 | static_cast<std::uint32_t>(digit);
        if (n % 4 != 3) continue;
        const std::size_t have = n + 1 == text.size() ? 3 - padding : 3;
        for (std::size_t i = 0; i < have; ++i) {
            bytes.push_back(static_cast<std::uint8_t>(group >> (16 - 8 * i)));
        }
        group = 0;
    }
    return true;
}

}  // namespace hal::canopen::gateway
