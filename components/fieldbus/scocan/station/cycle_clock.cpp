// SPDX-License-Identifier: MIT
#include "cycle_clock.hpp"

#include <algorithm>
#include <cmath>

namespace hal::scocan {

namespace {
constexpr double a = 0.3;
constexpr double b = 0.03;
constexpr double max_drift = 1e-3;  // 1000 ppm: no crystal
constexpr std::uint32_t settling = 8;   // SYNCs until deviations are known

// llround is a call
Time rounded(double ns) noexcept { return static_cast<Time>(ns < 0 ? ns - 0.5 : ns + 0.5); }
}  // namespace

void CycleClock::clear() noexcept {
    period_ = nominal_;
    p_ = error_ = square_ = 0;
    accepted_ = lost_ = rejected_ = 0;
    seen_ = false;
}

void CycleClock::lead(Time begin) noexcept {
    clear();
    epoch_ = begin;
    accepted_ = 2;
    seen_ = true;
    ++cycle_;
}

void CycleClock::advance(std::uint32_t cycles) noexcept {
    p_ += period_ * cycles;
    cycle_ += cycles;
    seen_ = false;
}

CycleClock::Accepted CycleClock::accept(Time stamp) noexcept {
    const auto begin = [&] {
        clear();
        epoch_ = stamp;
        accepted_ = 1;
        seen_ = true;
        ++cycle_;
        return Accepted::first;
    };
    if (accepted_ == 0) return begin();
    const double d = static_cast<double>(stamp - epoch_) - p_;
    const double n = std::round(d / period_);
    if (accepted_ == 1) {
        if (n < 1 || n > 8) return begin();
        const double off = d / n / nominal_ - 1;
        if (std::abs(off) > max_drift) {
            off_ = off;
            begin();
            return Accepted::off_rate;
        }
        period_ = d / n;
        cycle_ += static_cast<std::uint64_t>(n);
        p_ += d;
        accepted_ = 2;
        lost_ = 0;
        seen_ = true;
        return Accepted::good;
    }
    const double e = d - n * period_;
    if (n == 0 && seen_) return Accepted::duplicate;
    const double limit = accepted_ < settling ? nominal_ / 4 : std::max(5 * sigma(), floor_);
    if (n < 0 || std::abs(e) > limit) {
        error_ = e;
        if (++rejected_ <= max_rejected) return Accepted::rejected;
        const double kept = period_;
        begin();
        period_ = kept;
        accepted_ = 2;
        return Accepted::jumped;
    }
    advance(static_cast<std::uint32_t>(n));
    p_ += a * e;
    period_ = std::clamp(period_ + b * e / std::max(n, 1.0), nominal_ * (1 - max_drift),
                         nominal_ * (1 + max_drift));
    error_ = e;
    square_ = accepted_ == 2 ? e * e : square_ + (e * e - square_) / 16;
    ++accepted_;
    rejected_ = lost_ = 0;
    seen_ = true;
    return Accepted::good;
}

void CycleClock::own(Time stamp) noexcept {
    const auto n = std::llround((static_cast<double>(stamp - epoch_) - p_) / period_);
    if (n > 0) {
        advance(static_cast<std::uint32_t>(n));
    }
    seen_ = true;
    lost_ = rejected_ = 0;
}

std::uint32_t CycleClock::pass(Time now, Time wait) noexcept {
    if (accepted_ < 2) return 0;
    const double overdue = static_cast<double>(now - epoch_) - p_ - static_cast<double>(wait);
    if (overdue < period_) return 0;
    const auto cycles = static_cast<std::uint32_t>(std::min(overdue / period_, 1e6));
    lost_ += cycles;
    advance(cycles);
    return cycles;
}

Time CycleClock::at(std::uint64_t cycle, Time offset) const noexcept {
    const auto ahead = static_cast<double>(static_cast<std::int64_t>(cycle - cycle_));
    return epoch_ + rounded(p_ + period_ * (ahead + static_cast<double>(offset) * per_nominal_));
}

double CycleClock::sigma() const noexcept { return std::sqrt(square_); }

}  // namespace hal::scocan
