// SPDX-License-Identifier: MIT
#include "estimation/design/dense.hpp"

#include <Eigen/LU>

namespace hal::estimation {

Dense product(const Dense& a, const Dense& b) { return a * b; }

Dense symmetric(const Dense& a) { return 0.5 * (a + a.transpose()); }

Dense solve(const Dense& a, const Dense& b) { return Eigen::PartialPivLU<Dense>(a).solve(b); }

struct FullPivot::Factors {
    Eigen::FullPivLU<Dense> lu;
};

FullPivot::FullPivot(const Dense& a) : factors_(new Factors{Eigen::FullPivLU<Dense>(a)}) {}
FullPivot::~FullPivot() = default;

double FullPivot::rcond() const { return factors_->lu.rcond(); }
bool FullPivot::invertible() const { return factors_->lu.isInvertible(); }
Dense FullPivot::solve(const Dense& b) const { return factors_->lu.solve(b); }
Dense FullPivot::inverse() const {
    return solve(Dense::Identity(factors_->lu.rows(), factors_->lu.cols()));
}

}  // namespace hal::estimation
