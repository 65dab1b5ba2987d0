// SPDX-License-Identifier: MIT
// The conv_* components: conversion between types, with wrap-around or clamping of values out of
// range.
#pragma once

#include <limits>
#include <utility>

#include "hal/component.hpp"

namespace conv {

/// True if every value of `From` is in the range of `To`.
template <class To, class From>
constexpr bool always_fits() {
    if constexpr (std::same_as<To, double> || std::same_as<From, bool>) {
        return true;
    } else if constexpr (std::same_as<From, double> || std::same_as<To, bool>) {
        return false;
    } else {
        return std::in_range<To>(std::numeric_limits<From>::min()) &&
               std::in_range<To>(std::numeric_limits<From>::max());
    }
}

/// Returns true if `value` is in the range of `To`; false for NaN. [any]
template <class To, class From>
constexpr bool fits(From value) noexcept {
    if constexpr (always_fits<To, From>()) {
        return true;
    } else if constexpr (std::same_as<To, bool>) {
        return value == From{0} || value == From{1};
    } else if constexpr (std::same_as<From, double>) {
        // min is 0 or a power of two, so it is exact; max + 1 is a power of two, max itself need
        // not be exact.
        constexpr double min = static_cast<double>(std::numeric_limits<To>::min());
        constexpr double beyond = 2.0 * static_cast<double>(std::numeric_limits<To>::max() / 2 + 1);
        return value >= min && (sizeof(To) == 8 ? value < beyond : value <= beyond - 1.0);
    } else {
        return std::in_range<To>(value);
    }
}

/// Returns `value` truncated to an integer modulo 2^64; 0 for infinity and NaN. [any]
inline std::uint64_t wrapped(double value) noexcept {
    const double rest = std::fmod(std::trunc(std::fabs(value)), 0x1p64);
    const auto bits = std::isfinite(rest) ? static_cast<std::uint64_t>(rest) : 0;
    return value < 0.0 ? 0 - bits : bits;
}

/// Converts `value`. A value out of range wraps around (a bit is TRUE for all but 0), or is set to
/// the nearest limit of the range if `clamp` is set. [any]
template <class To, class From>
constexpr To convert(From value, bool clamp) noexcept {
    if (clamp && !fits<To>(value)) {
        if (value > From{0}) return std::numeric_limits<To>::max();
        if (value < From{0}) return std::numeric_limits<To>::lowest();
        return To{};  // NaN
    }
    if constexpr (std::same_as<To, bool>) {
        return value != From{0};
    } else if constexpr (std::same_as<From, double>) {
        return fits<To>(value) ? static_cast<To>(value) : static_cast<To>(wrapped(value));
    } else {
        return static_cast<To>(value);
    }
}

/// A conversion without loss of range.
template <class From, class To>
struct Widening : hal::Component {
    using Component::Component;
    hal::In<From> in{*this, "in", "value to convert"};
    hal::Out<To> out{*this, "out", "converted value"};
    hal::Function run{*this, "", hal::step<&Widening::update>, "converts"};

    void update(hal::Cycle) noexcept { out = convert<To, From>(in, false); }

    static constexpr const char* manual = R"(
HAL does not convert between types implicitly; link this component between two signals. Every input
value is in the range of the output; a 64-bit integer keeps about 16 digits as a float. For example:

    loadrt conv_s32_float
    addf conv-s32-float.0 servo
    net edges-counted => conv-s32-float.0.in
    net edges         <= conv-s32-float.0.out
)";
};

/// Returns true if `converted` is exactly `value`: in range and without a lost fraction; false for
/// NaN. [any]
template <class To, class From>
constexpr bool exact(From value, To converted) noexcept {
    return fits<To>(value) && static_cast<From>(converted) == value;
}

/// A conversion to a smaller range.
template <class From, class To>
struct Narrowing : hal::Component {
    using Component::Component;
    hal::In<From> in{*this, "in", "value to convert"};
    hal::Out<To> out{*this, "out", "converted value"};
    hal::Out<bool> out_of_range{*this, "out-of-range",
                                "clamp: TRUE while in is outside of the range of out; else: TRUE "
                                "since a value was not converted exactly"};
    hal::Param<bool> clamp{*this, "clamp",
                           "TRUE limits values to the range of out; FALSE wraps them around"};
    hal::Function run{*this, "", hal::step<&Narrowing::update>, "converts"};

    void update(hal::Cycle) noexcept {
        const From value = in;
        const To converted = convert<To>(value, clamp);
        out = converted;
        if (clamp) {
            out_of_range = !fits<To>(value);
        } else if (!exact(value, converted)) {
            out_of_range = true;
        }
    }

    static constexpr const char* manual = R"(
HAL does not convert between types implicitly; link this component between two signals. The fraction
of a float is truncated (1.9 becomes 1, -1.9 becomes -1). A value out of range wraps around (modulo
2^32 or 2^64; a bit is TRUE for all but 0), or, with `clamp`, is set to the nearest limit of the
range. With `clamp`, `out-of-range` is TRUE while the input is outside of the range. Without, it
becomes TRUE with the first input that is not converted exactly, a fraction included. It remains
TRUE, also when `clamp` has become FALSE meanwhile, until a cycle with `clamp` and an input within
the range. A NaN input gives 0 and sets `out-of-range`.

**Differences from LinuxCNC:** an integer that wraps around sets `out-of-range` (LinuxCNC: not
between signed and unsigned integers of the same width). A float wraps around and NaN gives 0
(LinuxCNC: what the processor's conversion gives, on x86 the lowest number). With `clamp`, NaN sets
`out-of-range`.

For example:

    loadrt conv_float_s32
    addf conv-float-s32.0 servo
    setp conv-float-s32.0.clamp TRUE
    net torque-wanted => conv-float-s32.0.in
    net torque-word   <= conv-float-s32.0.out
)";
};

template <class From, class To>
using Converter =
    std::conditional_t<always_fits<To, From>(), Widening<From, To>, Narrowing<From, To>>;

}  // namespace conv
