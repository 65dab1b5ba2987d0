// SPDX-License-Identifier: MIT
// The monotonic clock.
#pragma once

#include <cstdint>
#include <ctime>

namespace hal {

/// Returns CLOCK_MONOTONIC in ns: for durations and deadlines. The kernel's vDSO answers without a system call. [any]
inline std::int64_t monotonic_ns() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace hal
