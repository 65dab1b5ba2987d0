// SPDX-License-Identifier: MIT
// Edges of a bit that a function reads once per cycle.
#pragma once

namespace hal {

/// Detects the rising edges of a bit. An instance lists it in hal::Retained like a `bool`, so that
/// `reload` causes no edge.
class RisingEdge {
public:
    /// `level` is the level before the first cycle: with `true`, a bit that is TRUE from the first
    /// cycle on is not a rising edge.
    constexpr explicit RisingEdge(bool level = false) noexcept : level_(level) {}

    /// Returns whether `level` is TRUE and was FALSE at the previous call. Call it in every cycle.
    /// [realtime]
    constexpr bool rises(bool level) noexcept {
        const bool was = level_;
        level_ = level;
        return level && !was;
    }

private:
    bool level_;
};

}  // namespace hal
