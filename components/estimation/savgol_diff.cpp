// SPDX-License-Identifier: MIT
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

// The polynomial of the least squares fit is sum_k <y, p_k> p_k for an orthonormal basis p_k on the
// points t = -age / (window - 1) (A. Savitzky, M. Golay, *Smoothing and Differentiation of Data by
// Simplified Least Squares Procedures*, 1964). Its derivative d at t = 0 is d! times the
// coefficient of t^d, so the weight of the sample y_i in it is d! sum_k c_kd p_k(t_i).

struct Polynomial {
    std::vector<double> values;  ///< on the points, by age
    std::vector<double> coefficients;  ///< of 1, t, t^2 …
};

/// Returns t^k on `points` points, as a polynomial of at most `degree`.
Polynomial power(std::size_t k, std::size_t points, std::size_t degree) {
    Polynomial p{std::vector<double>(points), std::vector<double>(degree + 1, 0.0)};
    p.coefficients[k] = 1.0;
    for (std::size_t age = 0; age < points; ++age) {
        const double t = -static_cast<double>(age) / static_cast<double>(points - 1);
        p.values[age] = std::pow(t, static_cast<double>(k));
    }
    return p;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// y += factor * x
void add(std::vector<double>& y, double factor, const std::vector<double>& x) {
    for (std::size_t i = 0; i < y.size(); ++i) {
        y[i] += factor * x[i];
    }
}

void normalise(Polynomial& p) {
    const double norm = std::sqrt(dot(p.values, p.values));
    for (double& value : p.values) {
        value /= norm;
    }
    for (double& coefficient : p.coefficients) {
        coefficient /= norm;
    }
}

/// Returns a basis of the polynomials of at most `degree` that is orthonormal on the points, by
/// Gram-Schmidt. A second pass removes what rounding left of the first.
std::vector<Polynomial> orthonormal_basis(std::size_t points, std::size_t degree) {
    constexpr int passes = 2;
    std::vector<Polynomial> basis;
    for (std::size_t k = 0; k <= degree; ++k) {
        Polynomial p = power(k, points, degree);
        for (int pass = 0; pass < passes; ++pass) {
            for (const Polynomial& b : basis) {
                const double projection = dot(p.values, b.values);
                add(p.values, -projection, b.values);
                add(p.coefficients, -projection, b.coefficients);
            }
        }
        normalise(p);
        basis.push_back(std::move(p));
    }
    return basis;
}

/// Returns the weights of the samples in `scale` times the coefficient of t^power of the fitted
/// polynomial; all are 0 for a power above its degree.
std::vector<double> weights_of(const std::vector<Polynomial>& basis, std::size_t power,
                               double scale) {
    std::vector<double> weights(basis.front().values.size(), 0.0);
    if (power >= basis.size()) return weights;
    for (const Polynomial& p : basis) {
        add(weights, scale * p.coefficients[power], p.values);
    }
    return weights;
}

struct SavgolDiff : hal::Component {
    explicit SavgolDiff(const hal_host* host)
        : Component(host),
          window(*this, "window", 9, "number of samples for the polynomial; odd",
                 {.min = 3, .max = 255}),
          order(*this, "order", 2, "degree of the polynomial", {.min = 1, .max = 6}) {
        if (window % 2 == 0) {
            throw hal::ArgumentError("window", "window=" + std::to_string(window) +
                                                   " is even; use " + std::to_string(window + 1));
        }
        if (order >= window) {
            throw hal::ArgumentError("order", "order=" + std::to_string(order) +
                                                  " needs a window of at least " +
                                                  std::to_string((order + 1) | 1));
        }
        design();
        past_.assign(size(), 0.0);
        hal::Retained(
            *this, {{"past", past_}, {"newest", newest_}, {"last", last_}, {"started", started_}});
    }

    hal::Argument window, order;
    hal::In<double> in{*this, "in", "input"};
    hal::Out<double> smooth{*this, "smooth", "value of the polynomial", {.finite = true}};
    hal::Out<double> slope{*this, "slope", "first derivative of the polynomial", {.finite = true}};
    hal::Out<double> curvature{*this,
                               "curvature",
                               "second derivative of the polynomial; 0 with order 1",
                               {.finite = true}};
    hal::In<bool> reset{*this, "reset", "TRUE fills the history with the current input"};
    hal::Out<std::uint32_t> bad_inputs{
        *this, "bad-inputs", "number of NaN or infinite inputs; the previous input is used"};
    hal::Function run{*this, "", &SavgolDiff::update, "smooths and differentiates"};

    void update(hal::Cycle cycle) noexcept {
        const double now = in;
        if (!std::isfinite(now) || std::fabs(now) > 1e150) {
            bad_inputs = bad_inputs + 1;
        } else {
            last_ = now;
        }
        if (!started_ || reset) {
            for (double& x : past_) {
                x = last_;
            }
            started_ = std::isfinite(now);
        }
        newest_ = (newest_ + 1) % size();
        past_[newest_] = last_;
        double sums[3] = {0.0, 0.0, 0.0};
        for (std::size_t age = 0, at = newest_; age < size();
             ++age, at = at == 0 ? size() - 1 : at - 1) {
            for (std::size_t d = 0; d < 3; ++d) {
                // small differences avoid cancellation
                sums[d] += weights_[d][age] * (past_[at] - last_);
            }
        }
        const double dt = cycle.seconds();
        smooth = sums[0] + last_;
        slope = sums[1] / dt;
        curvature = sums[2] / (dt * dt);
    }

private:
    std::size_t size() const noexcept { return static_cast<std::size_t>(window); }

    /// Computes the weights that give the value and the derivatives of the fitted polynomial at
    /// age 0.
    void design() {
        const double span = static_cast<double>(window - 1);  // of the points, in samples
        const std::vector<Polynomial> basis =
            orthonormal_basis(size(), static_cast<std::size_t>(order));
        weights_[0] = weights_of(basis, 0, 1.0);
        weights_[1] = weights_of(basis, 1, 1.0 / span);
        weights_[2] = weights_of(basis, 2, 2.0 / (span * span));  // d! / span^d
    }

    std::vector<double> weights_[3];  // of the value and its derivatives, by age
    std::vector<double> past_;
    std::size_t newest_ = 0;
    double last_ = 0.0;
    bool started_ = false;
};

}  // namespace

HAL_COMPONENT(SavgolDiff, "savgol_diff",
              "Speed and acceleration from a position (Savitzky-Golay filter)", R"(
A polynomial of degree `order` is fitted to the last `window` samples by least squares and evaluated
at the newest: there is no delay for signals that such a polynomial describes exactly (A. Savitzky,
M. Golay, 1964; evaluated at the end of the window as in P. Gorry, 1990). More samples reduce noise;
a higher order reduces lag. For an encoder position use 15 to 31 samples and order 2 or 3. A NaN or
infinite input is replaced by the previous one.

    loadrt savgol_diff names=speed window=21 order=2
    addf speed servo
    net place => speed.in
    net rate  <= speed.slope
)")
