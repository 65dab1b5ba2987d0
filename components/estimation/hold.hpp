// SPDX-License-Identifier: MIT
// Sampling a continuous plant inside a cycle: the period is only known there.
#pragma once

#include <cmath>

#include "estimation/matrix.hpp"

namespace hal::estimation {

/// Matrix exponentials in fixed memory. One costs about 20 products of such matrices. [realtime]
class Hold {
public:
    /// Turns x' = Ax + Bu into x(k+1) = Ax + Bu for inputs held over a period: the exponential of
    /// [A B; 0 0].
    void sample(Matrix& a, Matrix& b, double period) noexcept {
        const Eigen::Index n = a.rows();
        const Eigen::Index m = b.cols();
        step_.setZero(n + m, n + m);
        step_.topLeftCorner(n, n) = a * period;
        step_.topRightCorner(n, m) = b * period;
        grow();
        a = sum_.topLeftCorner(n, n);
        b = sum_.topRightCorner(n, m);
    }
    /// What white noise of density `q` on x' = Ax adds to the covariance in a period (C. Van Loan,
    /// *Computing Integrals Involving the Matrix Exponential*, IEEE Trans. AC 23, 1978): the
    /// exponential of [-A Q; 0 A'].
    void sample_noise(const Matrix& a, Matrix& q, double period) noexcept {
        const Eigen::Index n = a.rows();
        step_.setZero(2 * n, 2 * n);
        step_.topLeftCorner(n, n) = a * -period;
        step_.topRightCorner(n, n) = q * period;
        step_.bottomRightCorner(n, n) = a.transpose() * period;
        grow();
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j <= i; ++j) {
                double total = 0.0;
                for (Eigen::Index k = 0; k < n; ++k) {
                    total += sum_(n + k, n + i) * sum_(k, n + j);
                }
                q(i, j) = q(j, i) = total;
            }
        }
    }

private:
    /// sum_ = e^step_, by halving, Taylor's series and squaring.
    void grow() noexcept {
        const Eigen::Index all = step_.rows();
        double norm = 0.0;
        for (Eigen::Index i = 0; i < all; ++i) {
            double row = 0.0;
            for (Eigen::Index j = 0; j < all; ++j) {
                row += std::fabs(step_(i, j));
            }
            norm = std::fmax(norm, row);
        }
        int halvings = 0;
        for (; norm > 0.25 && halvings < 60; norm /= 2) {
            ++halvings;
        }
        step_ *= std::ldexp(1.0, -halvings);
        sum_.setIdentity(all, all);
        power_ = sum_;
        for (int k = 1; k <= 13; ++k) {  // 0.25^14 / 14! is below the last bit
            multiply(next_, power_, step_);
            power_ = next_ / k;
            sum_ += power_;
        }
        for (; halvings > 0; --halvings) {
            multiply(next_, sum_, sum_);
            sum_ = next_;
        }
    }

    using Wide =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 2 * max, 2 * max>;
    Wide step_, power_, sum_, next_;
};

}  // namespace hal::estimation
