// SPDX-License-Identifier: MIT
// The monotonic clock.
#pragma once

#include <cstdint>
#include <ctime>

namespace hal {

/// Returns CLOCK_MONOTONIC in ns: for durations and deadlines. The kernel's vDSO answers without a
/// system call. [any]
inline std::int64_t monotonic_ns() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// Converts a time in ns for calls of the operating system. `long` has 32 bits on 32-bit machines,
/// which the ns of a second fit into. [any]
constexpr timespec to_timespec(std::int64_t ns) noexcept {
    timespec time{};
    time.tv_sec = static_cast<std::time_t>(ns / 1'000'000'000);
    time.tv_nsec = static_cast<long>(ns % 1'000'000'000);
    return time;
}

}  // namespace hal
