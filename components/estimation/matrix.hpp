// SPDX-License-Identifier: MIT
// The matrices of a cycle: any size up to a limit, in place, never on the heap.
#pragma once

#include <Eigen/Core>

namespace hal::estimation {

inline constexpr int max = 12;  ///< rows and columns at most

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max, max>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, max, 1>;

/// to = a * b, without temporaries. `to` is neither of them; all three are matrices, not
/// expressions. [realtime]
template <class To, class A, class B>
void multiply(To& to, const A& a, const B& b) noexcept {
    const Eigen::Index rows = a.rows();
    const Eigen::Index columns = b.cols();
    const Eigen::Index inner = a.cols();
    to.resize(rows, columns);
    double* __restrict out = to.data();
    const double *const left = a.data(), *const right = b.data();
    for (Eigen::Index j = 0; j < columns; ++j, out += rows) {
        for (Eigen::Index i = 0; i < rows; ++i) {
            out[i] = 0.0;
        }
        for (Eigen::Index k = 0; k < inner; ++k) {
            const double factor = right[k + j * inner];
            const double* const column = left + k * rows;
            for (Eigen::Index i = 0; i < rows; ++i) {
                out[i] += column[i] * factor;
            }
        }
    }
}

/// True when no element is NaN or infinite. [realtime]
template <class M>
bool finite(const M& m) noexcept {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < m.size(); ++i) {
        sum += m.data()[i] * 0.0;
    }
    return sum == 0.0;
}

}  // namespace hal::estimation
