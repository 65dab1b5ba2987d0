// SPDX-License-Identifier: MIT
#include "ethercat/config/config_text.hpp"

#include <bit>

namespace hal::ethercat::config {

namespace {

using master::Type;
static_assert(static_cast<Type>(bus::ValueType::f64) == Type::real64);
static_assert(static_cast<Type>(bus::ValueType::s8) == Type::s8);

DataType data_type(const bus::TypeName& name) { return {static_cast<Type>(name.type), name.bits}; }

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"ethercat-line", "ethercat-value", "ethercat-object",
                                     "ethercat-slave"};
    return codes[static_cast<std::size_t>(topic)];
}

std::optional<ObjectAddress> parse_address(const Word& word, Report& report) {
    const auto address = bus::parse_object_address(word.text);
    if (!address || address->index == 0) return std::nullopt;
    bus::warn_bare_hex(report, Topic::value, word, *address);
    bus::warn_two_digits(report, Topic::value, word, *address);
    return address;
}

std::optional<DataType> parse_type(const Word& word, Report& report) {
    if (const bus::TypeName type = bus::parse_value_type(word.text); type.name != nullptr) {
        bus::warn_old_type(report, Topic::value, word, type);
        return data_type(type);
    }
    const bus::TypeName type = bus::parse_esi_type(word.text);
    return type.name != nullptr ? std::optional(data_type(type)) : std::nullopt;
}

bool is_type(std::string_view word) {
    return bus::parse_value_type(word).name != nullptr || bus::parse_esi_type(word).name != nullptr;
}

Type described_type(const std::string& name, unsigned bits) {
    const bus::TypeName type = bus::parse_esi_type(name);
    if (type.name != nullptr && type.bits == bits) return data_type(type).type;
    return type_of(bits, name.starts_with("INT") || name.starts_with("DINT"));
}

Type type_of(unsigned bits, bool with_sign) {
    if (bits == 1) return Type::bit;
    unsigned width = 0;
    for (unsigned max = 8; bits > max && max < 64; max *= 2) {
        ++width;
    }
    return static_cast<Type>(static_cast<unsigned>(with_sign ? Type::s8 : Type::u8) + width);
}

using Bytes = std::vector<std::uint8_t>;

Bytes little_endian(std::uint64_t value, unsigned bits) {
    Bytes out;
    for (unsigned i = 0; i < (bits + 7) / 8; ++i) {
        out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    return out;
}

namespace {

std::uint64_t real_bits(double value, Type type) {
    if (type == Type::real32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return std::bit_cast<std::uint64_t>(value);
}

/// The range of an integer of some bits.
struct Range {
    std::uint64_t max_negative;  ///< magnitude; 0: unsigned
    std::uint64_t max_decimal;
    std::uint64_t all_ones;  ///< the largest hexadecimal number
};

Range range_of(DataType type) {
    const std::uint64_t ones =
        type.bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << type.bits) - 1;
    if (is_signed(type.type)) return {(ones >> 1) + 1, ones >> 1, ones};
    return {0, ones, ones};
}

std::optional<std::uint64_t> integer_bits(std::string_view text, const Range& range) {
    const bool negative = text.starts_with('-');
    const auto natural = parse_natural(negative ? text.substr(1) : text);
    if (!natural) return std::nullopt;
    if (negative) {
        if (*natural > range.max_negative || range.max_negative == 0) return std::nullopt;
        return 0 - *natural;
    }
    const std::uint64_t max = text.starts_with("0x") ? range.all_ones : range.max_decimal;
    return *natural <= max ? natural : std::nullopt;
}

}  // namespace

std::optional<Bytes> value_bytes(std::string_view value, DataType type, std::string& problem) {
    if (is_real(type.type)) {
        const auto real = parse_real(value);
        if (real) return little_endian(real_bits(*real, type.type), type.bits);
        problem = "a number, as in 1.5";
        return std::nullopt;
    }
    const Range range = range_of(type);
    const auto bits = integer_bits(value, range);
    if (bits) return little_endian(*bits, type.bits);
    problem = "a number of " + std::string(range.max_negative != 0 ? "-" : "") +
              std::to_string(range.max_negative) + ".." + std::to_string(range.max_decimal) +
              ", decimal or with 0x";
    return std::nullopt;
}

}  // namespace hal::ethercat::config
