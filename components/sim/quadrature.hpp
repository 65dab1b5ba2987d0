// SPDX-License-Identifier: MIT
// Counts and phases of an incremental encoder.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace sim {

/// The two phases and the index mark at a count. A leads B while the count rises; the index is one
/// count wide.
struct Quadrature {
    Quadrature(std::int64_t count, std::int64_t per_turn) noexcept
        : a(((count + 1) & 2) != 0),
          b((count & 2) != 0),
          z(per_turn > 0 && count % per_turn == 0) {}
    bool a, b, z;
};

/// The count of an encoder with `per_turn` counts (after x4 decoding) at `angle` radians. Edges lie
/// half a count to either side of 0, so that a shaft resting at 0 does not sit on an edge. [any]
inline std::int64_t counts_at(double angle, std::int64_t per_turn) noexcept {
    return static_cast<std::int64_t>(
        std::floor(angle * static_cast<double>(per_turn) / (2.0 * std::numbers::pi) + 0.5));
}

}  // namespace sim
