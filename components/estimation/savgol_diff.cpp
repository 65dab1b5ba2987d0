// SPDX-License-Identifier: MIT
#include <cmath>
#include <memory>
#include <vector>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

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

    /// Least squares for a polynomial in t = -age / (window - 1), by orthogonal polynomials on
    /// these points (Gram-Schmidt, twice), and its value and derivatives at age 0 (A. Savitzky, M.
    /// Golay, *Smoothing and Differentiation of Data by Simplified Least Squares Procedures*,
    /// 1964).
    void design() {
        const std::size_t n = size();
        const std::size_t degree = static_cast<std::size_t>(order);
        const double reach = static_cast<double>(n - 1);
        struct Poly {
            std::vector<double> at, c;  // values on the points, coefficients
        };
        std::vector<Poly> basis;
        for (std::size_t k = 0; k <= degree; ++k) {
            Poly p{std::vector<double>(n), std::vector<double>(degree + 1, 0.0)};
            p.c[k] = 1.0;
            for (std::size_t i = 0; i < n; ++i) {
                p.at[i] = std::pow(-static_cast<double>(i) / reach, static_cast<double>(k));
            }
            for (int twice = 0; twice < 2; ++twice) {
                for (const Poly& b : basis) {
                    double dot = 0.0;
                    for (std::size_t i = 0; i < n; ++i) {
                        dot += p.at[i] * b.at[i];
                    }
                    for (std::size_t i = 0; i < n; ++i) {
                        p.at[i] -= dot * b.at[i];
                    }
                    for (std::size_t i = 0; i <= degree; ++i) {
                        p.c[i] -= dot * b.c[i];
                    }
                }
            }
            double norm = 0.0;
            for (const double x : p.at) {
                norm += x * x;
            }
            norm = std::sqrt(norm);
            for (double& x : p.at) {
                x /= norm;
            }
            for (double& x : p.c) {
                x /= norm;
            }
            basis.push_back(std::move(p));
        }
        const double scales[] = {1.0, 1.0 / reach, 2.0 / (reach * reach)};  // d! / reach^d
        for (std::size_t d = 0; d < 3; ++d) {
            weights_[d].assign(n, 0.0);
            const double scale = scales[d];
            for (const Poly& b : basis) {
                for (std::size_t i = 0; d <= degree && i < n; ++i) {
                    weights_[d][i] += scale * b.c[d] * b.at[i];
                }
            }
        }
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
