// SPDX-License-Identifier: MIT
// Conversion between drive units and user units.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace hal::cia402 {

/// Drive units per user unit as a fraction, because a ratio such as 7:3 has no exact decimal.
/// Negative: reversed direction.
struct Factor {
    double numerator = 1.0;
    double denominator = 1.0;

    /// Returns true when the ratio is usable: not 0, not NaN, 1e-15..1e15. [any]
    bool sound() const noexcept {
        return std::fabs(ratio()) >= 1e-15 && std::fabs(ratio()) <= 1e15;
    }
    double ratio() const noexcept { return numerator / denominator; }
    double to_user(double drive) const noexcept { return drive / ratio(); }
    /// Converts, rounds and clamps to the range of T; NaN becomes 0. [any]
    template <class T>
    T to_drive(double user) const noexcept {
        using Limits = std::numeric_limits<T>;
        constexpr double low = static_cast<double>(Limits::min());

        constexpr double high = static_cast<double>(Limits::max());
        const double exact = std::nearbyint(user * ratio());
        if (std::isnan(exact)) {
            return T{};
        }
        if (exact >= high) return Limits::max();
        if (exact > low) return static_cast<T>(exact);
        return Limits::min();
    }
    /// Converts like to_drive(), without sign. [any]
    std::uint32_t amount(double user) const noexcept {
        return Factor{std::fabs(ratio()), 1.0}.to_drive<std::uint32_t>(std::fabs(user));
    }
};

/// Extends a position counter of the drive that wraps.
class Counter {
public:
    /// Takes the reading `raw`, of which `bits` (1..32) are valid. It must have moved by less than
    /// half its range since the last call. [realtime]
    void follow(std::int32_t raw, unsigned bits) noexcept {
        if (!known_) return put(raw);
        count_ = count_of(raw, bits);
    }
    /// Returns the count of a reading that is less than half the range away from the last one.
    /// [any]
    std::int64_t count_of(std::int32_t raw, unsigned bits) const noexcept {
        return count_ +
               low_bits(static_cast<std::uint32_t>(raw) - static_cast<std::uint32_t>(count_), bits);
    }
    /// Restarts at a reading. [realtime]
    void put(std::int32_t raw) noexcept {
        count_ = raw;
        known_ = true;
    }
    std::int64_t count() const noexcept { return count_; }
    bool known() const noexcept { return known_; }

    /// Returns a count as the drive's counter shows it. [any]
    static std::int32_t low_bits(std::uint32_t count, unsigned bits) noexcept {
        const unsigned unused = bits == 0 || bits > 32 ? 0 : 32 - bits;
        return static_cast<std::int32_t>(count << unused) >> unused;
    }

private:
    std::int64_t count_ = 0;
    bool known_ = false;
};

}  // namespace hal::cia402
