// SPDX-License-Identifier: MIT
// A linear plant x' = A x + B u with inputs that stay constant over a step, moved on exactly:
//     x(t + h) = F x(t) + G u,   [F G; 0 1] = exp(h [A B; 0 0])
// (G. Franklin, J. D. Powell, M. Workman, *Digital Control of Dynamic Systems*, 4.3.3.) The
// exponential is found by scaling and squaring (C. Moler, C. Van Loan, *Nineteen Dubious Ways to
// Compute the Exponential of a Matrix*, SIAM Review 45, 2003, method 3), so a step may be of any
// length; where h A is so large that squaring would lose all digits, by an implicit Euler step, F =
// (1 - h A)^-1, G = F h B, which is at rest where the plant is.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace sim {

template <std::size_t N, std::size_t M>
class Linear {
public:
    using States = std::array<double, N>;
    using Inputs = std::array<double, M>;
    struct Equations {
        std::array<std::array<double, N>, N> a{};
        std::array<std::array<double, M>, N> b{};
        bool operator==(const Equations&) const = default;
    };

    States state{};

    /// Moves on by `h` seconds. Makes the matrices anew when the equations or h have changed.
    /// [realtime]
    void step(const Equations& equations, const Inputs& u, double h) noexcept {
        if (h != h_ || equations != equations_) {
            equations_ = equations;
            h_ = h;
            discretise();
        }
        States next{};
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) {
                next[i] += f_[i][j] * state[j];
            }
            for (std::size_t j = 0; j < M; ++j) {
                next[i] += g_[i][j] * u[j];
            }
        }
        double sum = 0.0;
        for (const double x : next) {
            sum += std::fabs(x);
        }
        state = sum <= 1e100 ? next : States{};
    }

private:
    static constexpr std::size_t all = N + M;
    using Square = std::array<std::array<double, all>, all>;

    static Square times(const Square& p, const Square& q) noexcept {
        Square r{};
        for (std::size_t i = 0; i < all; ++i) {
            for (std::size_t k = 0; k < all; ++k) {
                if (p[i][k] != 0.0) {
                    for (std::size_t j = 0; j < all; ++j) {
                        r[i][j] += p[i][k] * q[k][j];
                    }
                }
            }
        }
        return r;
    }

    /// Powers of two that, as units of the states, bring the columns of `a` to the size of its rows
    /// (B. Parlett, C. Reinsch,
    /// *Balancing a matrix*, Numerische Mathematik 13, 1969), and `a` in these units. A stiff
    /// spring on a small mass then needs as many squarings as it swings in a step, and not their
    /// square.
    static States balance(std::array<std::array<double, N>, N>& a) noexcept {
        States units;
        units.fill(1.0);
        for (int sweep = 0; sweep < 20; ++sweep) {
            for (std::size_t i = 0; i < N; ++i) {
                double column = 0.0;
                double row = 0.0;
                for (std::size_t j = 0; j < N; ++j) {
                    if (j != i) {
                        column += std::fabs(a[j][i]);
                        row += std::fabs(a[i][j]);
                    }
                }
                if (!(column > 0.0 && row > 0.0)) continue;
                const double unit = std::exp2(std::round(0.5 * std::log2(row / column)));
                units[i] *= unit;
                for (std::size_t j = 0; j < N; ++j) {
                    a[j][i] *= unit;
                    a[i][j] /= unit;
                }
            }
        }
        return units;
    }

    /// Computes x(k+1) = F x(k) + G u(k) of dx/dt = A x + B u for a period h: F and G are blocks of
    /// exp([A B; 0 0] h), by a Taylor series of 12 terms of the matrix scaled below a norm of 1/4,
    /// squared as often as it was halved. A matrix too stiff for that is integrated implicitly.
    void discretise() noexcept {
        auto a = equations_.a;
        const States units = balance(a);
        double norm = 0.0;
        for (std::size_t i = 0; i < N; ++i) {
            double sum = 0.0;
            for (const double x : a[i]) {
                sum += std::fabs(x) * h_;
            }
            norm = std::fmax(norm, sum);
        }
        if (!(norm < 1e6)) return implicit();
        int halvings = 0;
        for (double scaled = norm; scaled > 0.25; scaled /= 2) {
            ++halvings;
        }
        Square step{};
        Square power{};
        Square sum{};
        const double h = std::ldexp(h_, -halvings);
        for (std::size_t i = 0; i < all; ++i) {
            power[i][i] = sum[i][i] = 1.0;
        }
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) {
                step[i][j] = h * a[i][j];
            }
            for (std::size_t j = 0; j < M; ++j) {
                step[i][N + j] = h * equations_.b[i][j] / units[i];
            }
        }
        for (int k = 1; k <= 12; ++k) {  // 0.25^13 / 13! is below the last bit
            power = times(power, step);
            for (std::size_t i = 0; i < all; ++i) {
                for (std::size_t j = 0; j < all; ++j) {
                    sum[i][j] += (power[i][j] /= k);
                }
            }
        }
        for (; halvings > 0; --halvings) {
            sum = times(sum, sum);
        }
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) {
                f_[i][j] = sum[i][j] * units[i] / units[j];
            }
            for (std::size_t j = 0; j < M; ++j) {
                g_[i][j] = sum[i][N + j] * units[i];
            }
        }
    }

    /// Gauss-Jordan with the rows in the order of their largest elements.
    void implicit() noexcept {
        std::array<std::array<double, 2 * N + M>, N> rows{};
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) {
                rows[i][j] = (i == j ? 1.0 : 0.0) - h_ * equations_.a[i][j];
            }
            rows[i][N + i] = 1.0;
            for (std::size_t j = 0; j < M; ++j) {
                rows[i][2 * N + j] = h_ * equations_.b[i][j];
            }
        }
        for (std::size_t column = 0; column < N; ++column) {
            std::size_t best = column;
            for (std::size_t i = column + 1; i < N; ++i) {
                if (std::fabs(rows[i][column]) > std::fabs(rows[best][column])) {
                    best = i;
                }
            }
            std::swap(rows[column], rows[best]);
            const double pivot = rows[column][column];
            if (pivot == 0.0 || !std::isfinite(pivot)) return stand_still();
            for (double& x : rows[column]) {
                x /= pivot;
            }
            for (std::size_t i = 0; i < N; ++i) {
                if (i == column) continue;
                const double share = rows[i][column];
                for (std::size_t j = 0; j < 2 * N + M; ++j) {
                    rows[i][j] -= share * rows[column][j];
                }
            }
        }
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) {
                f_[i][j] = rows[i][N + j];
            }
            for (std::size_t j = 0; j < M; ++j) {
                g_[i][j] = rows[i][2 * N + j];
            }
        }
    }
    void stand_still() noexcept {
        f_ = {};
        g_ = {};
        for (std::size_t i = 0; i < N; ++i) {
            f_[i][i] = 1.0;
        }
    }

    Equations equations_{};
    double h_ = -1.0;
    std::array<std::array<double, N>, N> f_{};
    std::array<std::array<double, M>, N> g_{};
};

/// A parameter of a plant in a range that keeps the equations finite; what is not a number counts
/// as `least`. [any]
inline double sane(double value, double min) noexcept {
    if (!(value > min)) return min;
    return value < 1e15 ? value : 1e15;
}

/// An input of a plant: what is not a number counts as 0. [any]
inline double force(double value) noexcept {
    if (std::fabs(value) < 1e15) return value;
    if (value > 0.0) return 1e15;
    if (value < 0.0) return -1e15;
    return 0.0;
}

}  // namespace sim
