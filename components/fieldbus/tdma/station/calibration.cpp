// SPDX-License-Identifier: MIT
#include "calibration.hpp"

#include <algorithm>
#include <cmath>

namespace hal::tdma {

namespace {

constexpr Time max_delay = 5'000'000;  // a slower switch is unusable for cyclic traffic
constexpr Time max_round_time = 10'000'000'000;

}  // namespace

void Calibration::begin(std::uint32_t rounds) noexcept {
    rounds_ = std::clamp(rounds, 1U, max_rounds);
    active_ = true;
    waiting_ = false;
    done_ = 0;
    unanswered_row_ = 0;
}

bool Calibration::due(std::uint32_t cycle, std::uint32_t period) noexcept {
    if (!active_) return false;
    if (!waiting_) return true;
    // Cycle numbers wrap: the difference is what counts. RTnet's stations wait forever here. The
    // timeout alternates between two and four periods, so that a periodic disturbance does not hit
    // every request.
    const std::uint32_t limit = (2 + unanswered_ % 3) * period;
    if (static_cast<std::int32_t>(cycle - reply_cycle_) <= static_cast<std::int32_t>(limit)) {
        return false;
    }
    waiting_ = false;
    ++unanswered_;
    ++unanswered_row_;
    return true;
}

void Calibration::sent(std::uint32_t reply_cycle, Time not_before, Time reply_at) noexcept {
    waiting_ = true;
    reply_cycle_ = reply_cycle;
    not_before_ = not_before;
    reply_at_ = reply_at;
}

bool Calibration::accept(const Reply& r, Time arrived, double drift, Time tolerance) noexcept {
    if (!active_ || !waiting_) return false;
    // The driver stamps the request when it leaves. Ignores replies to an earlier request and
    // forged ones.
    if (r.request_stamp < not_before_ - 1'000 || arrived - reply_at_ > tolerance ||
        r.request_stamp >= arrived || arrived - r.request_stamp > max_round_time) {
        return false;
    }
    if (r.stamp < r.received || r.stamp - r.received > max_round_time) return false;
    waiting_ = false;
    unanswered_row_ = 0;
    const auto here = static_cast<double>(arrived - r.request_stamp) * (1.0 + drift);
    const Time delay = std::llround((here - static_cast<double>(r.stamp - r.received)) / 2.0);
    if (delay < -max_delay || delay > max_delay) return false;
    measured_[done_++] = delay;
    if (done_ < rounds_) return false;
    const auto middle = measured_.begin() + rounds_ / 2;
    std::nth_element(measured_.begin(), middle, measured_.begin() + rounds_);
    delay_ = std::max<Time>(*middle, 0);
    active_ = false;
    return true;
}

}  // namespace hal::tdma
