// SPDX-License-Identifier: MIT
#include "estimation/design/plant.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <cstdio>

namespace hal::estimation {
namespace {

using Complex = std::complex<double>;

bool lasts(Complex mode, Time time) {
    return time == Time::continuous ? mode.real() >= -1e-9 : std::abs(mode) >= 1.0 - 1e-9;
}

/// Powers of two that, as units of the states, bring the rows of `a` to the size of its columns, so
/// that "small" means the same in all.
Eigen::VectorXd balance(const Dense& a) {
    const Eigen::Index n = a.rows();
    Eigen::VectorXd units = Eigen::VectorXd::Ones(n);
    for (int sweep = 0; sweep < 20; ++sweep) {
        for (Eigen::Index i = 0; i < n; ++i) {
            double column = 0.0;
            double row = 0.0;
            for (Eigen::Index j = 0; j < n; ++j) {
                if (j != i) {
                    column += std::fabs(a(j, i)) / units(j) * units(i);

                    row += std::fabs(a(i, j)) / units(i) * units(j);
                }
            }
            if (column > 0.0 && row > 0.0) {
                units(i) *= std::exp2(std::round(0.5 * std::log2(row / column)));
            }
        }
    }
    return units;
}

}  // namespace

Dense exponential(const Dense& a) {
    const double norm = a.cwiseAbs().rowwise().sum().maxCoeff();
    int halvings = 0;
    for (double scaled = norm; scaled > 0.25 && halvings < 200; scaled /= 2) {
        ++halvings;
    }
    const Dense step = a * std::ldexp(1.0, -halvings);
    Dense power = Dense::Identity(a.rows(), a.cols());
    Dense sum = power;
    for (int k = 1; k <= 14; ++k) {  // 0.25^15 / 15! is far below the last bit
        power = product(power, step) / k;
        sum += power;
    }
    for (; halvings > 0; --halvings) {
        sum = product(sum, sum);
    }
    return sum;
}

Discrete hold(const Dense& a, const Dense& b, double period) {
    const Eigen::Index n = a.rows();
    const Eigen::Index m = b.cols();
    Dense both = Dense::Zero(n + m, n + m);
    both.topLeftCorner(n, n) = a * period;
    both.topRightCorner(n, m) = b * period;
    const Dense grown = exponential(both);
    return {grown.topLeftCorner(n, n), grown.topRightCorner(n, m)};
}

Sampled sample(const Dense& a, const Dense& b, const Dense& q, const Dense& r, double period) {
    const Eigen::Index n = a.rows();
    const Eigen::Index m = b.cols();
    const Eigen::Index all = n + m;
    Dense drift = Dense::Zero(all, all);
    Dense cost = Dense::Zero(all, all);

    Dense both = Dense::Zero(2 * all, 2 * all);
    drift.topLeftCorner(n, n) = a;
    drift.topRightCorner(n, m) = b;
    cost.topLeftCorner(n, n) = q;
    cost.bottomRightCorner(m, m) = r;
    both.topLeftCorner(all, all) = -drift.transpose() * period;
    both.topRightCorner(all, all) = cost * period;
    both.bottomRightCorner(all, all) = drift * period;
    const Dense grown = exponential(both);
    const Dense forward = grown.bottomRightCorner(all, all);
    const Dense total = symmetric(product(forward.transpose(), grown.topRightCorner(all, all)));
    return {forward.topLeftCorner(n, n), forward.topRightCorner(n, m), total.topLeftCorner(n, n),
            total.bottomRightCorner(m, m), total.topRightCorner(n, m)};
}

std::optional<Mode> unreachable(const Dense& a, const Dense& b, Time time) {
    const Eigen::Index n = a.rows();
    const Eigen::VectorXd units = balance(a);
    const Dense inverse = units.cwiseInverse().asDiagonal();
    const Dense scaled = product(inverse, a, units.asDiagonal());
    Dense inputs = product(inverse, b);
    for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
        if (const double size = inputs.col(j).norm(); size > 0.0) {
            inputs.col(j) *= std::max(scaled.norm(), 1.0) / size;
        }
    }
    const Eigen::EigenSolver<Dense> modes(scaled, false);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Complex mode = modes.eigenvalues()(i);
        if (!lasts(mode, time)) continue;
        Eigen::MatrixXcd pencil(n, n + b.cols());
        pencil.leftCols(n) = mode * Eigen::MatrixXcd::Identity(n, n) - scaled.cast<Complex>();
        pencil.rightCols(b.cols()) = inputs.cast<Complex>();
        Eigen::FullPivLU<Eigen::MatrixXcd> lu(pencil.adjoint());
        lu.setThreshold(1e-8);  // a double eigenvalue is known to half its digits
        if (lu.rank() == n) continue;
        const Eigen::VectorXcd left = lu.kernel().col(0);
        Eigen::Index strongest = 0;
        left.cwiseAbs().maxCoeff(&strongest);
        return Mode{mode, strongest};
    }
    return {};
}

std::optional<Mode> unseen(const Dense& a, const Dense& c, Time time) {
    return unreachable(a.transpose(), c.transpose(), time);
}

std::string text(Complex value) {
    char words[64];
    if (std::fabs(value.imag()) <= 1e-12 * std::abs(value)) {
        std::snprintf(words, sizeof words, "%.4g",
                      std::fabs(value.real()) < 1e-9 ? 0.0 : value.real());
    } else {
        std::snprintf(words, sizeof words, "%.4g %c %.4gi", value.real(),
                      value.imag() < 0.0 ? '-' : '+', std::fabs(value.imag()));
    }
    return words;
}

double spectral_radius(const Dense& a) {
    return a.size() == 0 ? 0.0 : a.eigenvalues().cwiseAbs().maxCoeff();
}

std::optional<Dense> place_observer(const Dense& a, const Dense& c, const Eigen::VectorXcd& poles) {
    const Eigen::Index n = a.rows();
    Dense wanted = Dense::Zero(n, n);  // real, with a block per conjugate pair
    for (Eigen::Index i = 0; i < n; ++i) {
        wanted(i, i) = poles(i).real();
        if (poles(i).imag() == 0.0) continue;
        if (i + 1 >= n || poles(i + 1) != std::conj(poles(i))) {
            return {};
        }
        wanted(i, i + 1) = poles(i).imag();
        wanted(i + 1, i) = -poles(i).imag();
        wanted(i + 1, i + 1) = poles(i).real();
        ++i;
    }
    Dense weights(c.rows(), n);
    for (Eigen::Index i = 0; i < c.rows(); ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
            weights(i, j) = std::cos(1.0 + 3.0 * static_cast<double>(i) +
                                     0.7 * static_cast<double>(j * (i + 1)));
        }
    }
    Dense equations = Dense::Zero(n * n, n * n);  // of the columns of X, one below the other
    for (Eigen::Index j = 0; j < n; ++j) {
        equations.block(j * n, j * n, n, n) += a.transpose();
        for (Eigen::Index k = 0; k < n; ++k) {
            equations.block(j * n, k * n, n, n) -= wanted(k, j) * Dense::Identity(n, n);
        }
    }
    const Dense right = product(c.transpose(), weights);
    const FullPivot solver(equations);
    if (!solver.invertible()) {
        return {};
    }
    const FullPivot x(solver.solve(right.reshaped()).reshaped(n, n));
    if (!x.invertible() || x.rcond() < 1e-13) {
        return {};
    }
    return Dense(product(weights, x.inverse()).transpose());
}

bool is_positive_definite(const Dense& a) {
    const Eigen::SelfAdjointEigenSolver<Dense> solver(symmetric(a), Eigen::EigenvaluesOnly);
    const double min = solver.eigenvalues().minCoeff();
    const double max_magnitude = solver.eigenvalues().cwiseAbs().maxCoeff();
    return min > 0.0 && min > 1e-14 * max_magnitude;
}

bool is_positive_semidefinite(const Dense& a) {
    const Eigen::SelfAdjointEigenSolver<Dense> solver(symmetric(a), Eigen::EigenvaluesOnly);
    const double min = solver.eigenvalues().minCoeff();
    const double max_magnitude = solver.eigenvalues().cwiseAbs().maxCoeff();
    return min >= -1e-12 * max_magnitude;
}

}  // namespace hal::estimation
