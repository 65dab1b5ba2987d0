// SPDX-License-Identifier: MIT
#include "ethercat/esc/clock.hpp"

namespace hal::ethercat::esc {

/// Rounds down; of numbers that fit.
static std::int64_t whole_below(double value) noexcept {
    const auto towards_zero = static_cast<std::int64_t>(value);
    return towards_zero - static_cast<std::int64_t>(static_cast<double>(towards_zero) > value);
}

std::int64_t Clock::at(std::int64_t now_ns) const noexcept {
    const std::int64_t passed = now_ns - base_now_;
    return base_local_ + passed +
           whole_below(fraction_ + static_cast<double>(passed) * (drift_ + correction_));
}

/// Beyond this many ns a time is never reached: 31 years.
static constexpr std::int64_t never_ns = 1'000'000'000'000'000'000;

std::int64_t Clock::time_of(std::int64_t local_ns) const noexcept {
    const double rate = drift_ + correction_;
    const auto left = static_cast<std::int64_t>(static_cast<std::uint64_t>(local_ns) -
                                                static_cast<std::uint64_t>(base_local_));
    if (left > never_ns || left < -never_ns) return INT64_MAX;
    const double ahead = (static_cast<double>(left) * rate + fraction_) / (1.0 + rate);
    std::int64_t now = base_now_ + left - whole_below(ahead);
    for (int i = 0; i < 4 && at(now) < local_ns; ++i) {
        ++now;
    }
    for (int i = 0; i < 4 && at(now - 1) >= local_ns; ++i) {
        --now;
    }
    return now;
}

void Clock::rebase(std::int64_t now_ns) noexcept {
    const std::int64_t passed = now_ns - base_now_;
    const double exact = fraction_ + static_cast<double>(passed) * (drift_ + correction_);
    const std::int64_t whole = whole_below(exact);
    base_local_ += passed + whole;
    fraction_ = exact - static_cast<double>(whole);
    base_now_ = now_ns;
}

void Clock::shift(double ns, std::int64_t now_ns) noexcept {
    rebase(now_ns);
    const double exact = fraction_ + ns;
    const std::int64_t whole = whole_below(exact);
    base_local_ += whole;
    fraction_ = exact - static_cast<double>(whole);
}

}  // namespace hal::ethercat::esc
