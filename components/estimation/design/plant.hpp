// SPDX-License-Identifier: MIT
// Linear plants outside of the cycle: sampling, controllability and observability.
#pragma once

#include <complex>
#include <optional>
#include <string>

#include "estimation/design/dense.hpp"

namespace hal::estimation {

/// Returns the exponential of a square matrix: scaled to a norm below 1/4, Taylor series, squared
/// back (N. Higham, *Functions of Matrices*, 10.3). [setup]
Dense exponential(const Dense& a);

struct Discrete {
    Dense a, b;
};

/// Returns the discrete equivalent of x' = Ax + Bu over `period` seconds with u held. [setup]
Discrete hold(const Dense& a, const Dense& b, double period);

/// Returns the discrete equivalent of x' = Ax + Bu with the cost integral of x'Qx + u'Ru, with u
/// held: per sample x'Qx + 2x'Nu + u'Ru (C. Van Loan, *Computing Integrals Involving the Matrix
/// Exponential*, IEEE Trans. AC 23, 1978). [setup]
struct Sampled {
    Dense a, b, q, r, n;
};
Sampled sample(const Dense& a, const Dense& b, const Dense& q, const Dense& r, double period);

enum class Time { continuous, discrete };

/// A mode of a plant, and the state in which it is strongest.
struct Mode {
    std::complex<double> value;
    Eigen::Index state;
};

/// Returns an unstable mode that no column of `b` controls, if any (the test of Popov, Belevitch
/// and Hautus). [setup]
std::optional<Mode> unreachable(const Dense& a, const Dense& b, Time time);

/// Returns an unstable mode that no row of `c` observes, if any. [setup]
std::optional<Mode> unseen(const Dense& a, const Dense& c, Time time);

/// "0.5", "-1 + 2i". [setup]
std::string text(std::complex<double> value);

/// Returns the largest |eigenvalue|. [setup]
double spectral_radius(const Dense& a);

/// Returns L such that A - LC has these eigenvalues: with a vector per pole, A'X - XP = C'G for a
/// full G, and L' = G X^-1 (S. Bhattacharyya, E. de Souza, *Pole assignment via Sylvester's
/// equation*, Systems & Control Letters 1, 1982). None: the plant is not observable, a pole is A's
/// own, or one without its conjugate. [setup]
std::optional<Dense> place_observer(const Dense& a, const Dense& c, const Eigen::VectorXcd& poles);

/// Returns whether all eigenvalues of a symmetric matrix are above 0. [setup]
bool is_positive_definite(const Dense& a);

/// Returns whether no eigenvalue of a symmetric matrix is below 0. [setup]
bool is_positive_semidefinite(const Dense& a);

}  // namespace hal::estimation
