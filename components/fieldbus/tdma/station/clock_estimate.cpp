// SPDX-License-Identifier: MIT
#include "clock_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace hal::tdma {

namespace {

constexpr double alpha_end = 0.05;
constexpr double outlier_sigmas = 5.0;
constexpr double min_outlier_ns = 2'000.0;
// Consecutive outliers after which the clock has jumped. Syncs may be delayed, on a busy computer
// for many cycles, but never arrive early.
constexpr std::uint32_t max_early = 8;
constexpr std::uint32_t max_late = 100;
constexpr double max_drift = 1e-3;  // 1000 ppm: no crystal
constexpr double long_ns = 1e9;         // time constant of the long average
// uncertainty (sigma) of a drift that a master may use
constexpr double certain = 2e-6;
constexpr double min_noise_ns = 100.0;
constexpr std::uint32_t min_accepted = 32;      // syncs for a certain drift
constexpr double decay_per_ns = 20e-6 / 1e9;

/// Gains of a least-squares line through n points, and not less than `alpha_min`, critically
/// damped.
struct Gains {
    double alpha, beta;
    Gains(double n, double alpha_min) noexcept
        : alpha(std::min(1.0, std::max(alpha_min, 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0))))),
          beta(std::min(
              1.0, std::max(alpha_min * alpha_min / (2.0 - alpha_min), 6.0 / (n * (n + 1.0))))) {}
};

}  // namespace

void ClockEstimate::lead(Time local) noexcept {
    if (leading_) return;
    if (is_certain()) {
        held_ = long_drift_;
        holds_ = true;
    }
    const Time at_now = known() ? global(local) : local;
    base_ = at_now - local;
    at_ = local;
    offset_ = long_offset_ = 0.0;

    drift_ = long_drift_ = holds_ ? held_ : 0.0;
    leading_ = true;
}

void ClockEstimate::decay(Time local) noexcept {
    if (!leading_) return;
    const auto dt = static_cast<double>(local - at_);
    if (dt <= 0.0) return;
    offset_ += drift_ * dt;
    at_ = local;  // no step
    const Time whole = std::llround(offset_);
    base_ += whole;
    offset_ -= static_cast<double>(whole);
    const double by = decay_per_ns * dt;
    drift_ = drift_ > 0.0 ? std::max(0.0, drift_ - by) : std::min(0.0, drift_ + by);
    if (holds_) {
        held_ = drift_;
    }
    long_drift_ = drift_;
    long_offset_ = offset_;
}

void ClockEstimate::another_master() noexcept {
    if (is_certain()) {
        held_ = long_drift_;
        holds_ = true;
    }
    long_accepted_ = 0;
}

bool ClockEstimate::is_certain() const noexcept {
    return long_accepted_ >= min_accepted && uncertainty() <= certain;
}

double ClockEstimate::uncertainty() const noexcept {
    if (long_accepted_ < 3 || interval_ <= 0.0) return max_drift;
    // Of the slope of a line through n points; with the final gains n is what they remember.
    const double n = std::min<double>(
        long_accepted_, std::max(static_cast<double>(min_accepted), 2.0 * long_ns / interval_));
    return std::sqrt(12.0) * std::max(jitter(), min_noise_ns) / (interval_ * n * std::sqrt(n));
}

double ClockEstimate::drift() const noexcept {
    if (leading_) return drift_;
    if (is_certain()) return long_drift_;
    if (holds_) return held_;
    return drift_;
}

/// Updates the long average.
void ClockEstimate::accept_long(double measured, double dt) noexcept {
    if (long_accepted_ == 0) {
        long_offset_ = measured;
        long_drift_ = 0.0;
        long_accepted_ = 1;
        return;
    }
    ++long_accepted_;
    const double predicted = long_offset_ + long_drift_ * dt;
    const double e = measured - predicted;
    const Gains gains(long_accepted_, std::min(alpha_end, 2.0 * dt / long_ns));
    long_offset_ = predicted + gains.alpha * e;
    long_drift_ = std::clamp(long_drift_ + gains.beta * e / dt, -max_drift, max_drift);
    if (is_certain()) {
        held_ = long_drift_;
        holds_ = true;
    }
}

bool ClockEstimate::accept(Time sent, Time arrived, Time delay) noexcept {
    if (leading_) {
        leading_ = false;
        long_accepted_ = 0;
    }
    const Time measured = sent + delay - arrived;
    if (accepted_ == 0) {
        base_ = measured;
        at_ = arrived;
        offset_ = long_offset_ = 0.0;
        accepted_ = long_accepted_ = 1;
        return true;
    }
    const auto dt = static_cast<double>(arrived - at_);
    if (dt <= 0.0) return false;
    const double predicted = offset_ + drift_ * dt;
    const double e = static_cast<double>(measured - base_) - predicted;
    if (accepted_ >= 8) {
        const double limit = std::max(outlier_sigmas * std::sqrt(square_), min_outlier_ns);
        if (std::abs(e) > limit) {
            const bool early = e > 0.0;
            outliers_ = early == early_ ? outliers_ + 1 : 1;
            early_ = early;
            if (outliers_ <= (early ? max_early : max_late)) return false;
            clear();
            return accept(sent, arrived, delay);
        }
    } else if (std::abs(e) > max_drift * dt + 1e6) {  // begins with the times of another clock
        clear();
        return accept(sent, arrived, delay);
    }
    outliers_ = 0;
    ++accepted_;
    const double n = accepted_;
    const Gains gains(n, alpha_end);
    offset_ = predicted + gains.alpha * e;
    drift_ = std::clamp(drift_ + gains.beta * e / dt, -max_drift, max_drift);
    at_ = arrived;
    interval_ = interval_ == 0.0 ? dt : interval_ + (dt - interval_) * std::max(0.01, 1.0 / n);
    if (accepted_ > 4) {
        square_ += (e * e - square_) * std::max(0.01, 1.0 / (n - 4.0));
    }
    accept_long(static_cast<double>(measured - base_), dt);
    return true;
}

Time ClockEstimate::global(Time local) const noexcept {
    return local + base_ + std::llround(offset_ + drift_ * static_cast<double>(local - at_));
}

Time ClockEstimate::local(Time global) const noexcept {
    // The drift over the offset itself is below a nanosecond after one step: (1 + d)^-1 = 1 - d +
    // d^2 …
    const Time near = global - base_ - std::llround(offset_);
    const double grown = drift_ * static_cast<double>(near - at_);
    return near - std::llround(grown / (1.0 + drift_));
}

double ClockEstimate::jitter() const noexcept { return std::sqrt(square_); }

}  // namespace hal::tdma
