// SPDX-License-Identifier: MIT
// Positions of 64 bits from registers of 16 or 32 bits that wrap.
#pragma once

#include <cstdint>
#include <type_traits>

namespace hal::mesa {

/// Extends a register by its differences. A difference is known modulo the width of the register:
/// of the possible ones the nearest to an expected difference is taken, so a gap in which the
/// register wraps loses nothing as long as the expectation is right by half of its range.
template <class Register>
class PositionCounter {
public:
    static_assert(std::is_signed_v<Register>);

    /// Begins at the value of the register, and keeps the position. [realtime]
    void rebase(Register value) noexcept {
        last_ = value;
        is_known_ = true;
    }
    /// Follows the register; `expected` is the difference that is assumed. Returns the position.
    /// [realtime]
    std::int64_t update(Register value, std::int64_t expected = 0) noexcept {
        using Unsigned = std::make_unsigned_t<Register>;
        if (!is_known_) {
            rebase(value);
            return position_;
        }
        const auto passed =
            static_cast<Unsigned>(static_cast<Unsigned>(value) - static_cast<Unsigned>(last_));
        const auto beyond =
            static_cast<Register>(static_cast<Unsigned>(passed - static_cast<Unsigned>(expected)));
        position_ += expected + beyond;
        last_ = value;
        return position_;
    }
    std::int64_t position() const noexcept { return position_; }
    Register last() const noexcept { return last_; }
    bool is_known() const noexcept { return is_known_; }

private:
    std::int64_t position_ = 0;
    Register last_ = 0;
    bool is_known_ = false;
};

}  // namespace hal::mesa
