// SPDX-License-Identifier: MIT
// Frames that have waited too long to be passed on: while the thread of a bridge was stopped, or
// behind others that it did not manage to read.
#pragma once

#include <algorithm>
#include <cstdint>

#include "link/can.hpp"

namespace hal::can {

/// Returns true when a received frame has waited for more than 100 ms and two cycles. Receivers
/// would count its age from the moment at which it is sent again. How long a frame without a time
/// stamp has waited is unknown: it is not stale. [any]
inline bool is_stale(const Frame& frame, std::int64_t now_ns, std::int64_t period_ns) noexcept {
    constexpr std::int64_t max_wait_ns = 100'000'000;
    if (frame.time_ns == 0) return false;
    return now_ns - frame.time_ns > std::max(max_wait_ns, 2 * period_ns);
}

}  // namespace hal::can
