// SPDX-License-Identifier: MIT
// Between the registers of a slave and the bits of a value in the image.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "modbus/config/bus_config.hpp"

namespace hal::modbus {

/// How the pin of a value is: a float, a bit, or a whole number.
enum class PinForm : std::uint8_t { real, bit, signed_number, unsigned_number };
inline PinForm pin_form(const Value& v) {
    if (v.is_bit()) return PinForm::bit;
    if (v.scaled || bus::is_real(v.type)) return PinForm::real;
    return bus::is_signed(v.type) ? PinForm::signed_number : PinForm::unsigned_number;
}

/// The registers of a value, in the order of the wire.
struct Registers {
    std::array<std::uint16_t, 4> words{};
    std::size_t count = 0;
};

namespace detail {
constexpr std::uint16_t swapped(std::uint16_t word) {
    return static_cast<std::uint16_t>(word << 8 | word >> 8);
}
constexpr bool swaps_bytes(Order order) { return order == Order::badc || order == Order::dcba; }
constexpr bool low_word_first(Order order) { return order == Order::cdab || order == Order::dcba; }
/// Limits a number to a signed one of 16, 32 or 64 bits.
inline std::int64_t limited(std::int64_t number, unsigned bits) {
    const auto max = static_cast<std::int64_t>(~std::uint64_t{0} >> (65 - bits));
    return std::clamp(number, -max - 1, max);
}
inline std::int64_t limited(double number, unsigned bits) {
    const auto max = static_cast<std::int64_t>(~std::uint64_t{0} >> (65 - bits));
    if (number >= static_cast<double>(max)) return max;
    if (number <= -static_cast<double>(max)) return -max - 1;
    return std::llround(number);
}
}  // namespace detail

/// Returns the number in the registers, the first of them the most significant in the order `abcd`.
/// [any]
inline std::uint64_t joined(const Registers& r, Order order) {
    std::uint64_t number = 0;
    for (std::size_t n = 0; n < r.count; ++n) {
        const std::size_t at = detail::low_word_first(order) ? r.count - 1 - n : n;
        const std::uint16_t word = r.words[at];
        number = number << 16 | (detail::swaps_bytes(order) ? detail::swapped(word) : word);
    }
    return number;
}
/// The reverse of joined(). [any]
inline Registers split(std::uint64_t number, std::size_t count, Order order) {
    Registers r;
    r.count = count;
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t at = detail::low_word_first(order) ? n : count - 1 - n;
        const auto word = static_cast<std::uint16_t>(number >> 16 * n);
        r.words[at] = detail::swaps_bytes(order) ? detail::swapped(word) : word;
    }
    return r;
}

/// Returns the bits of a value for the image. A number that is not finite returns `last`. [any]
inline std::uint64_t decode_value(const Value& v, const Registers& r, std::uint64_t last) {
    const std::uint64_t number = joined(r, v.order);
    const std::uint64_t mask = v.mask != 0 ? v.mask : 1U;
    if (v.is_bit()) return static_cast<std::uint64_t>((number & mask) != 0);
    const unsigned bits = static_cast<unsigned>(r.count) * 16;
    const auto as_signed = static_cast<std::int64_t>(number << (64 - bits)) >> (64 - bits);
    double real = 0.0;
    if (v.type == bus::ValueType::f32) {
        real = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(number)));
    } else if (v.type == bus::ValueType::f64) {
        real = std::bit_cast<double>(number);
    } else if (bus::is_signed(v.type)) {
        if (!v.scaled) return static_cast<std::uint64_t>(as_signed);
        real = static_cast<double>(as_signed);
    } else {
        if (!v.scaled) return number;
        real = static_cast<double>(number);
    }
    if (v.scaled) {
        real = real * v.scale + v.offset;
    }
    return std::isfinite(real) ? std::bit_cast<std::uint64_t>(real) : last;
}

/// Encodes a value of the image, limited to the range of its type. Returns false for a number that
/// is not finite. [any]
inline bool encode_value(const Value& v, std::uint64_t cell, Registers& out) {
    const std::size_t count = v.size();
    if (v.is_bit()) {
        out = split(cell != 0 ? 1 : 0, 1, Order::abcd);
        return true;
    }
    const unsigned bits = static_cast<unsigned>(count) * 16;
    const PinForm form = pin_form(v);
    double real = 0.0;
    if (form == PinForm::real) {
        real = (std::bit_cast<double>(cell) - v.offset) / v.scale;
        if (!std::isfinite(real)) return false;
    }
    if (v.type == bus::ValueType::f32) {
        constexpr double limit = std::numeric_limits<float>::max();
        const auto narrow = static_cast<float>(std::clamp(real, -limit, limit));
        out = split(std::bit_cast<std::uint32_t>(narrow), count, v.order);
        return true;
    }
    if (v.type == bus::ValueType::f64) {
        out = split(std::bit_cast<std::uint64_t>(real), count, v.order);
        return true;
    }
    const std::uint64_t ones = ~std::uint64_t{0} >> (64 - bits);
    std::uint64_t number = 0;
    if (bus::is_signed(v.type)) {
        number = static_cast<std::uint64_t>(
            form == PinForm::real ? detail::limited(real, bits)
                                  : detail::limited(static_cast<std::int64_t>(cell), bits));
    } else if (form == PinForm::unsigned_number) {
        number = std::min(cell, ones);
    } else if (real >= static_cast<double>(ones)) {
        number = ones;
    } else if (real > 0) {
        number = static_cast<std::uint64_t>(std::round(real));
    }
    out = split(number & ones, count, v.order);
    return true;
}

}  // namespace hal::modbus
