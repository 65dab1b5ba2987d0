// SPDX-License-Identifier: MIT
// Riccati's equations, solved by the structure-preserving doubling algorithm.
#pragma once

#include <optional>

#include "estimation/design/plant.hpp"

namespace hal::estimation {

struct Riccati {
    Dense x;     ///< the stabilising solution: the cost of a state is x'Xx
    Dense gain;  ///< u = -Kx is what costs least
    int doublings = 0;
};

/// A'XA - X - (A'XB + N)(R + B'XB)^-1 (B'XA + N') + Q = 0 and K = (R + B'XB)^-1 (B'XA + N').
/// Nothing if no stabilising solution exists: check with unreachable() and unseen() before, they
/// name the reason. `r` is positive definite. [setup]
std::optional<Riccati> discrete_riccati(const Dense& a, const Dense& b, const Dense& q,
                                        const Dense& r, const Dense& n);
std::optional<Riccati> discrete_riccati(const Dense& a, const Dense& b, const Dense& q,
                                        const Dense& r);

/// A'X + XA - XBR^-1B'X + Q = 0 and K = R^-1B'X. [setup]
std::optional<Riccati> continuous_riccati(const Dense& a, const Dense& b, const Dense& q,
                                          const Dense& r);

}  // namespace hal::estimation
