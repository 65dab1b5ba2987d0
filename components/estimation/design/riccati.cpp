// SPDX-License-Identifier: MIT
#include "estimation/design/riccati.hpp"

#include <algorithm>
#include <cmath>

namespace hal::estimation {
namespace {

/// E. Chu, H. Fan, W. Lin, C. Wang, *Structure-Preserving Algorithms for Periodic Discrete-Time
/// Algebraic Riccati Equations*, International Journal of Control 77, 2004: with W = I + GH
///     A <- A W^-1 A,   G <- G + A W^-1 G A',   H <- H + A' H W^-1 A
/// H tends to X, squaring the remaining error each time.
struct Doubling {
    Dense a, g, h;

    /// How many doublings it took; -1: it does not settle.
    int run() {
        for (int k = 1; k <= 80; ++k) {
            const Eigen::Index n = a.rows();
            Dense both(n, 2 * n);
            both.leftCols(n) = a;
            both.rightCols(n) = g;
            both = solve(Dense::Identity(n, n) + product(g, h), both);
            const Dense wa = both.leftCols(n);
            const Dense wg = both.rightCols(n);
            const Dense transposed = a.transpose();
            const Dense more_h = product(transposed, h, wa);
            const Dense more_g = product(a, wg, transposed);
            a = product(a, wa);
            g += symmetric(more_g);
            h += symmetric(more_h);
            if (!a.allFinite() || !g.allFinite() || !h.allFinite()) return -1;
            if (more_h.norm() <= 1e-16 * h.norm() || h.norm() == 0.0) return k;
        }
        return -1;
    }
};

}  // namespace

std::optional<Riccati> discrete_riccati(const Dense& a, const Dense& b, const Dense& q,
                                        const Dense& r, const Dense& n) {
    // u = v - R^-1 N'x takes the mixed cost away
    const Dense transposed = b.transpose();
    const Dense across = solve(r, n.transpose());
    Doubling doubling{a - product(b, across), product(b, solve(r, transposed)),
                      symmetric(q - product(n, across))};
    const int doublings = doubling.run();
    if (doublings < 0) {
        return {};
    }
    Riccati result{doubling.h, {}, doublings};
    result.gain = solve(r + product(transposed, result.x, b),
                        product(transposed, result.x, a) + n.transpose());
    if (!result.gain.allFinite() || !(spectral_radius(a - product(b, result.gain)) < 1.0)) {
        return {};
    }
    return result;
}

std::optional<Riccati> discrete_riccati(const Dense& a, const Dense& b, const Dense& q,
                                        const Dense& r) {
    return discrete_riccati(a, b, q, r, Dense::Zero(a.rows(), b.cols()));
}

// E. Chu, H. Fan, W. Lin, *A structure-preserving doubling algorithm for continuous-time algebraic
// Riccati equations*, Linear Algebra and its Applications 396, 2005: Cayley's transform with a
// shift s makes it a discrete one. With S = A - sI and W = S' + HS^-1G:
//     A0 = I + 2s W^-T,   G0 = 2s S^-1 G W^-1,   H0 = 2s W^-1 H S^-1
std::optional<Riccati> continuous_riccati(const Dense& a, const Dense& b, const Dense& q,
                                          const Dense& r) {
    const Eigen::Index n = a.rows();
    const Dense unit = Dense::Identity(n, n);
    const Dense transposed = b.transpose();

    const Dense g = product(b, solve(r, transposed));
    const Dense h = symmetric(q);
    const double size = std::max({a.norm(), std::sqrt(g.norm() * h.norm()), 1e-3});
    // a shift that is an eigenvalue makes S or W singular: then another
    for (const double part : {0.3, 1.0, 3.0, 0.05, 10.0}) {
        const double shift = part * size;
        const Dense shifted = a - shift * unit;
        const FullPivot s(shifted);
        if (s.rcond() < 1e-14) continue;
        const Dense sg = s.solve(g);
        const Dense s_inverse = s.inverse();
        const FullPivot w(shifted.transpose() + product(h, sg));
        if (w.rcond() < 1e-14) continue;
        const Dense w_inverse = w.inverse();
        Doubling doubling{unit + 2.0 * shift * w_inverse.transpose(),
                          2.0 * shift * symmetric(product(sg, w_inverse)),
                          2.0 * shift * symmetric(product(w_inverse, h, s_inverse))};
        const int doublings = doubling.run();
        if (doublings < 0) continue;
        Riccati result{doubling.h, solve(r, product(transposed, doubling.h)), doublings};
        if (!result.gain.allFinite()) continue;
        const Dense closed = a - product(b, result.gain);
        // |e^z| < 1 where Re z < 0
        if (spectral_radius(exponential(closed / std::max(closed.norm(), 1e-300))) < 1.0) {
            return result;
        }
    }
    return {};
}

}  // namespace hal::estimation
