// SPDX-License-Identifier: MIT
// The actual times at which a function runs, for components that measure a thread.
#pragma once

#include <cstdint>

#include "hal/clock.hpp"
#include "hal/component.hpp"

namespace measure {

/// Time between the runs of a function. On a virtual clock a cycle runs exactly when it is due. The
/// first cycle detects the kind of clock: a thread on the real clock is not minutes away from its
/// due time.
class RunTime {
public:
    /// Returns the nanoseconds since the last run; negative in the first run. [realtime]
    std::int64_t since_last(hal::Cycle cycle) noexcept {
        const std::int64_t clock = hal::monotonic_ns();
        if (!started_) {
            constexpr std::int64_t minute = 60'000'000'000;
            real_ = clock - cycle.start_ns() < minute && cycle.start_ns() - clock < minute;
        }
        const std::int64_t time = real_ ? clock : cycle.start_ns();

        const std::int64_t since = started_ ? time - last_ : -1;
        started_ = true;
        last_ = time;
        return since;
    }

private:
    std::int64_t last_ = 0;
    bool started_ = false;
    bool real_ = false;
};

/// Limits `value` to the range of s32.
inline std::int32_t to_s32(std::int64_t value) noexcept {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, INT32_MIN, INT32_MAX));
}

/// Running mean and variance of the added values (Welford).
class Statistics {
public:
    void add(double value) noexcept {
        ++count_;
        const double before = value - mean_;
        mean_ += before / static_cast<double>(count_);
        squares_ += before * (value - mean_);
    }
    std::uint64_t count() const noexcept { return count_; }
    double mean() const noexcept { return mean_; }
    double variance() const noexcept {
        return count_ > 1 ? squares_ / static_cast<double>(count_ - 1) : 0.0;
    }

private:
    std::uint64_t count_ = 0;
    double mean_ = 0.0;
    double squares_ = 0.0;
};

}  // namespace measure
