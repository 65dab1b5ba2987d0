// SPDX-License-Identifier: MIT
// Between the value of a pin and the bits of a number on a bus.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "hal/abi.h"

namespace hal {

/// Reads `bits` (1..64) at a bit offset, least significant first. [realtime]
inline std::uint64_t read_bits(std::span<const std::uint8_t> data, std::size_t at,
                               unsigned bits) noexcept {
    const std::size_t first = at / 8;
    const auto shift = static_cast<unsigned>(at % 8);
    const unsigned bytes = (shift + bits + 7) / 8;
    std::uint64_t value = 0;
    for (unsigned n = 0; n < std::min(bytes, 8U); ++n) {
        value |= std::uint64_t{data[first + n]} << 8 * n;
    }
    value >>= shift;
    if (bytes > 8) {
        value |= std::uint64_t{data[first + 8]} << (64 - shift);
    }
    return value & (~std::uint64_t{0} >> (64 - bits));
}

/// Writes the low `bits` (1..64) of a value at a bit offset and leaves all other bits. [realtime]
inline void write_bits(std::span<std::uint8_t> data, std::size_t at, unsigned bits,
                       std::uint64_t value) noexcept {
    while (bits > 0) {
        const std::size_t shift = at % 8;
        const unsigned count = std::min<unsigned>(static_cast<unsigned>(8 - shift), bits);
        const unsigned mask = ((1U << count) - 1) << shift;
        std::uint8_t& byte = data[at / 8];
        byte = static_cast<std::uint8_t>((byte & ~mask) | ((value << shift) & mask));
        at += count;
        bits -= count;
        value >>= count;
    }
}

/// How a number is coded in 1 to 64 bits: as an integer, or as a float of IEEE 754. A value outside
/// of the range is limited to it.
class PinCodec {
public:
    enum class Format : std::uint8_t { unsigned_integer, signed_integer, real };

    /// A real has 32 or 64 bits. [any]
    constexpr PinCodec(Format format, unsigned bits) noexcept
        : mask_(~std::uint64_t{0} >> (64 - bits)), max_(mask_), bits_(bits), format_(format) {
        if (format == Format::signed_integer) {
            sign_ = std::uint64_t{1} << (bits - 1);
            max_ = mask_ >> 1;
            min_ = -static_cast<std::int64_t>(max_) - 1;
        }
    }
    constexpr unsigned bits() const noexcept { return bits_; }
    /// Returns the smallest type of a pin that holds all values. [any]
    constexpr hal_type pin_type() const noexcept {
        if (format_ == Format::real) return HAL_TYPE_FLOAT;
        if (bits_ == 1) return HAL_TYPE_BIT;
        const bool wide = bits_ > 32;
        if (sign_ != 0) return wide ? HAL_TYPE_S64 : HAL_TYPE_S32;
        return wide ? HAL_TYPE_U64 : HAL_TYPE_U32;
    }

    /// Returns the bits of a value; those above the code repeat the sign of a negative integer. An
    /// integer code has no NaN: the caller keeps the last value instead. [realtime]
    template <class T>
    std::uint64_t encode(T value) const noexcept {
        if constexpr (std::same_as<T, bool>) {
            return value ? 1 : 0;
        } else if constexpr (std::same_as<T, double>) {
            return encode_real(value);
        } else {
            if (format_ == Format::real) return encode_real(static_cast<double>(value));
            if constexpr (std::signed_integral<T>) {
                if (value < 0) {
                    return static_cast<std::uint64_t>(std::max<std::int64_t>(value, min_));
                }
            }
            return std::min(static_cast<std::uint64_t>(value), max_);
        }
    }
    /// Returns the value of the bits; bits above the code are ignored. The range of an integer `T`
    /// limits a real, whose NaN becomes 0. [realtime]
    template <class T>
    T decode(std::uint64_t raw) const noexcept {
        if constexpr (std::same_as<T, bool>) {
            return (raw & mask_) != 0;
        } else if constexpr (std::same_as<T, double>) {
            return decode_real(raw);
        } else {
            return format_ == Format::real ? limited<T>(decode_real(raw))
                                           : static_cast<T>(integer(raw));
        }
    }

private:
    constexpr std::uint64_t integer(std::uint64_t raw) const noexcept {
        return ((raw & mask_) ^ sign_) - sign_;  // repeats the sign without a branch
    }
    double decode_real(std::uint64_t raw) const noexcept {
        switch (format_) {
        case Format::unsigned_integer: return static_cast<double>(integer(raw));
        case Format::signed_integer:
            return static_cast<double>(static_cast<std::int64_t>(integer(raw)));
        case Format::real: break;
        }
        return bits_ == 32 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))}
                           : std::bit_cast<double>(raw);
    }
    std::uint64_t encode_real(double value) const noexcept {
        if (format_ != Format::real) {
            const double rounded = std::nearbyint(value);
            // 2^63 and 2^64 stand for the largest integers of 64 bits, which are not doubles
            if (rounded >= static_cast<double>(max_)) return max_;
            if (!(rounded > static_cast<double>(min_))) return static_cast<std::uint64_t>(min_);
            return rounded < 0.0 ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded))
                                 : static_cast<std::uint64_t>(rounded);
        }
        if (bits_ != 32) return std::bit_cast<std::uint64_t>(value);
        constexpr double max = std::numeric_limits<float>::max();
        return std::bit_cast<std::uint32_t>(
            static_cast<float>(std::isfinite(value) ? std::clamp(value, -max, max) : value));
    }
    template <std::integral T>
    static T limited(double value) noexcept {
        constexpr T min = std::numeric_limits<T>::min();
        constexpr T max = std::numeric_limits<T>::max();
        if (std::isnan(value)) return 0;
        if (value >= static_cast<double>(max)) return max;
        return value <= static_cast<double>(min) ? min : static_cast<T>(value);
    }

    std::uint64_t mask_ = 0;
    std::uint64_t sign_ = 0;  ///< the highest bit of a signed code
    std::int64_t min_ = 0;
    std::uint64_t max_ = 0;
    unsigned bits_ = 0;
    Format format_ = Format::unsigned_integer;
};

}  // namespace hal
