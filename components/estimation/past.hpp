// SPDX-License-Identifier: MIT
// A Kalman filter with a history: a late measurement is applied at its own time, and the later
// steps are repeated.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "estimation/matrix.hpp"
#include "hal/retained.hpp"

namespace hal::estimation {

/// The estimate at one time, and the inputs and measurements of that time.
struct Moment {
    static constexpr bool retainable = true;
    Vector x;                 ///< after the measurements of this moment
    Matrix p;                 ///< covariance of x
    Vector u;                 ///< the input that acted since the moment before
    Vector z;                 ///< measurements of this moment, those that are in `measured`
    std::uint32_t measured = 0;
    std::uint32_t fresh = 0;  ///< those of `measured` that were not counted yet
};

/// What became of a measurement: beyond the gate it is an outlier; it is invalid where the
/// covariance is no longer positive.
enum class Correction { none, used, outlier, invalid };

/// Corrects x and P by a scalar measurement z of c'x with the variance r, by Joseph's form (P.
/// Joseph, in R. Bucy, *Filtering for Stochastic Processes*, 1968), with M = (I - kc')P:
///     innovation = z - c'x,  k = Pc / (c'Pc + r),  x <- x + k innovation,  P <- M + (rk - Mc)k'
/// which remains symmetric and positive where P - kc'P does not; the two halves are symmetrised. An
/// innovation beyond `gate` standard deviations changes nothing; 0 disables the gate. [realtime]
inline Correction correct(Vector& x, Matrix& p, const Vector& c, double innovation, double r,
                          double gate) noexcept {
    const Eigen::Index n = x.size();
    Vector pc, k, mc;
    multiply(pc, p, c);
    double innovation_variance = r;
    for (Eigen::Index i = 0; i < n; ++i) {
        innovation_variance += c(i) * pc(i);
    }
    if (!(innovation_variance > 0.0) || !std::isfinite(innovation_variance)) {
        return Correction::invalid;
    }
    if (gate > 0.0 && innovation * innovation > gate * gate * innovation_variance) {
        return Correction::outlier;
    }
    k = pc / innovation_variance;
    x += k * innovation;
    double* const all = p.data();
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = 0; i < n; ++i) {
            all[i + j * n] -= k.data()[i] * pc.data()[j];
        }
    }
    multiply(mc, p, c);
    mc = r * k - mc;
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = 0; i < n; ++i) {
            all[i + j * n] += mc.data()[i] * k.data()[j];
        }
    }
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = 0; i < j; ++i) {
            p(i, j) = p(j, i) = 0.5 * (p(i, j) + p(j, i));
        }
    }
    return Correction::used;
}

/// to = A P A' + Q for a symmetric P, symmetric to the last bit. [realtime]
inline void propagate_covariance(Matrix& to, const Matrix& a, const Matrix& p,
                                 const Matrix& q) noexcept {
    const Eigen::Index n = a.rows();
    Matrix ap;
    multiply(ap, a, p);
    to = q;
    const double *const left = ap.data(), *const right = a.data();
    double* const all = to.data();
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index k = 0; k < n; ++k) {
            const double factor = right[j + k * n];
            if (factor != 0.0) {
                for (Eigen::Index i = 0; i <= j; ++i) {
                    all[i + j * n] += left[i + k * n] * factor;
                }
            }
        }
    }
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = 0; i < j; ++i) {
            all[j + i * n] = all[i + j * n];
        }
    }
}

/// The filter over its last `history` moments. `Model` has, all [realtime]:
///     void predict(Moment& to, const Moment& from)             x and P a period later, under to.u
///     Correction measure(Moment& at, Eigen::Index channel, double gate)  corrects by one of at.z
template <class Model>
class Past {
public:
    /// Allocates the history. [setup]
    Past(Model& model, std::size_t history, Vector x0, Matrix p0, Eigen::Index inputs,
         Eigen::Index channels)
        : model_(model),
          start_{std::move(x0), std::move(p0), Vector::Zero(inputs), Vector::Zero(channels)},
          moments_(history, start_) {}

    const Moment& now() const noexcept { return at(number_); }

    /// Starts a new step; followed by `add` for each measurement, then `settle`. [realtime]
    void advance(const Vector& u) noexcept {
        ++number_;
        Moment& moment = at(number_);
        moment.u = u;
        moment.measured = moment.fresh = 0;
        first_ = number_;
        known_ = known_ < moments_.size() ? known_ + 1 : known_;
    }
    /// Adds measurement `channel`, `cycles` old. False if it is older than the history. [realtime]
    bool add(Eigen::Index channel, double z, std::int64_t cycles) noexcept {
        cycles = std::max<std::int64_t>(cycles, 0);
        // the oldest step cannot be repeated: its predecessor is no longer stored
        const std::size_t repeatable = full() ? known_ - 1 : known_;
        if (cycles >= static_cast<std::int64_t>(repeatable)) return false;
        const std::uint64_t step = number_ - static_cast<std::uint64_t>(cycles);
        Moment& moment = at(step);
        moment.z(channel) = z;
        moment.measured |= std::uint32_t{1} << channel;
        moment.fresh |= std::uint32_t{1} << channel;
        first_ = std::min(first_, step);
        return true;
    }
    /// Repeats all steps from the oldest new measurement on. [realtime]
    void settle(double gate) noexcept {
        for (std::uint64_t step = first_; step <= number_; ++step) {
            Moment& moment = at(step);
            if (step == 1) {
                moment.x = start_.x;
                moment.p = start_.p;
            } else {
                model_.predict(moment, at(step - 1));
            }
            correct_by_measurements(moment, gate);
            if (!finite(moment.x) || !finite(moment.p)) {
                renew(moment);
            }
        }
    }
    /// Back to the start. [realtime]
    void restart() noexcept {
        number_ = 0;
        known_ = 0;
    }
    /// Lets a reload carry the whole history over. [setup]
    void retain(Component& component) {
        // none of it is of use to a model of another size
        const auto size = [](const Vector& v) { return "-" + std::to_string(v.size()); };
        const std::string shape = size(start_.x) + size(start_.u) + size(start_.z);
        Retained(component, {{("moments" + shape).c_str(), moments_},
                             {("number" + shape).c_str(), number_},
                             {("first" + shape).c_str(), first_},
                             {("known" + shape).c_str(), known_},
                             {"used", used},
                             {"outliers", outliers},
                             {"renewals", renewals}});
    }
    /// counted; a measurement that is done again counts once
    std::uint32_t used = 0;
    std::uint32_t outliers = 0;
    std::uint32_t renewals = 0;

private:
    void correct_by_measurements(Moment& moment, double gate) noexcept {
        for (Eigen::Index channel = 0; channel < moment.z.size(); ++channel) {
            const std::uint32_t bit = std::uint32_t{1} << channel;
            if ((moment.measured & bit) == 0) continue;
            const Correction outcome = model_.measure(moment, channel, gate);
            if ((moment.fresh & bit) != 0) {
                used += outcome == Correction::used;
                outliers += outcome == Correction::outlier;
            }
            if (outcome == Correction::invalid) {
                renew(moment);
            }
        }
        moment.fresh = 0;
    }

    Moment& at(std::uint64_t k) noexcept { return moments_[k % moments_.size()]; }
    const Moment& at(std::uint64_t k) const noexcept { return moments_[k % moments_.size()]; }
    bool full() const noexcept { return number_ > moments_.size(); }
    /// Starts again with the initial covariance, and the initial state if there is no other.
    void renew(Moment& moment) noexcept {
        if (!finite(moment.x)) {
            moment.x = start_.x;
        }
        moment.p = start_.p;
        ++renewals;
    }

    Model& model_;
    const Moment start_;
    std::vector<Moment> moments_;
    std::uint64_t number_ = 0;  // of the current step, from 1
    std::uint64_t first_ = 0;  // step with the oldest new measurement
    std::size_t known_ = 0;  // steps in the history
};

}  // namespace hal::estimation
