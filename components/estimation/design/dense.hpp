// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <memory>

/// What is computed with dense matrices outside of the cycle. Eigen's templates take long to
/// compile, once for each kind of expression: here they get plain matrices, and are instantiated in
/// one source. All functions may allocate.
namespace hal::estimation {

using Dense = Eigen::MatrixXd;

/// Returns a * b.
Dense product(const Dense& a, const Dense& b);

/// Returns a * b * c.
inline Dense product(const Dense& a, const Dense& b, const Dense& c) {
    return product(product(a, b), c);
}

/// Returns (a + a') / 2.
Dense symmetric(const Dense& a);

/// Returns x of a * x = b. `a` must be invertible.
Dense solve(const Dense& a, const Dense& b);

/// LU decomposition with complete pivoting, which measures how far a matrix is from singular.
class FullPivot {
public:
    explicit FullPivot(const Dense& a);
    ~FullPivot();

    double rcond() const;  ///< reciprocal condition number; 0 of a singular matrix
    bool invertible() const;
    Dense solve(const Dense& b) const;
    Dense inverse() const;

private:
    struct Factors;
    std::unique_ptr<Factors> factors_;
};

}  // namespace hal::estimation
