// SPDX-License-Identifier: MIT
#include "estimate.hpp"

#include <algorithm>
#include <cmath>

namespace hal::tdma {

namespace {

constexpr double alpha_end = 0.05, beta_end = alpha_end * alpha_end / (2.0 - alpha_end);  // critically damped
constexpr double outlier_sigmas = 5.0, smallest_outlier_ns = 2'000.0;
// In a row; then the clock itself has jumped. Syncs come late when they are held up, on a busy computer for many cycles, and meanwhile the
// drift is known; none comes early.
constexpr std::uint32_t most_early = 8, most_late = 100;
constexpr double        largest_drift = 1e-3;  // 1000 ppm: no crystal

}  // namespace

void ClockEstimate::lead(Time local) noexcept {
    const Time at_now = known() ? global(local) : local;
    const double drift = known() ? drift_ : 0.0;
    base_ = at_now - local, at_ = local, offset_ = 0.0, drift_ = drift, leading_ = true;
}

bool ClockEstimate::take(Time sent, Time arrived, Time delay) noexcept {
    leading_ = false;
    const Time measured = sent + delay - arrived;
    if (taken_ == 0) {
        base_ = measured, at_ = arrived, offset_ = 0.0, taken_ = 1;
        return true;
    }
    const auto dt = static_cast<double>(arrived - at_);
    if (dt <= 0.0) return false;
    const double predicted = offset_ + drift_ * dt;
    const double e = static_cast<double>(measured - base_) - predicted;
    if (taken_ >= 8) {
        const double limit = std::max(outlier_sigmas * std::sqrt(square_), smallest_outlier_ns);
        if (std::abs(e) > limit) {
            const bool early = e > 0.0;
            outliers_ = early == early_ ? outliers_ + 1 : 1, early_ = early;
            if (outliers_ <= (early ? most_early : most_late)) return false;
            clear();
            return take(sent, arrived, delay);
        }
    } else if (std::abs(e) > largest_drift * dt + 1e6) {  // it begins with another clock's times
        clear();
        return take(sent, arrived, delay);
    }
    outliers_ = 0;
    ++taken_;
    // Gains of a least-squares line through n points.
    const double n = taken_;
    const double alpha = std::max(alpha_end, 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)));
    const double beta = std::max(beta_end, 6.0 / (n * (n + 1.0)));
    offset_ = predicted + std::min(alpha, 1.0) * e;
    drift_ = std::clamp(drift_ + std::min(beta, 1.0) * e / dt, -largest_drift, largest_drift);
    at_ = arrived;
    if (taken_ > 4) square_ += (e * e - square_) * std::max(0.01, 1.0 / (n - 4.0));
    return true;
}

Time ClockEstimate::global(Time local) const noexcept {
    return local + base_ + std::llround(offset_ + drift_ * static_cast<double>(local - at_));
}

Time ClockEstimate::local(Time global) const noexcept {
    // The drift over the offset itself is below a nanosecond after one step: (1 + d)^-1 = 1 - d + d^2 …
    const Time near = global - base_ - std::llround(offset_);
    const double grown = drift_ * static_cast<double>(near - at_);
    return near - std::llround(grown / (1.0 + drift_));
}

double ClockEstimate::jitter() const noexcept { return std::sqrt(square_); }

}  // namespace hal::tdma
