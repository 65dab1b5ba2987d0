// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

namespace hal {

/// How a real thread waits for its deadline: asleep until `spin_ns` before it, then spinning.
/// Sleeping alone is 20 to 65 us late on an ordinary machine, spinning alone starves it; the spin
/// window is bounded by the caller.
struct Wait {
    std::int64_t spin_ns = 0;
    /// Threads slower than this sleep on a futex instead, so that the session can call them between
    /// two cycles.
    static constexpr std::int64_t callable_period_ns = 5'000'000;

    /// Sleeps until `spin_ns` before the deadline. [realtime]
    void sleep(std::int64_t deadline_ns) const noexcept;
    /// Does the same; returns false if the sleep ended early because `bell` no longer has the value
    /// `heard`.
    bool sleep(std::int64_t deadline_ns, const std::atomic<std::uint32_t>& bell,
               std::uint32_t heard) const noexcept;
    /// Spins until the deadline. Returns the time at the end. [realtime]
    static std::int64_t spin(std::int64_t deadline_ns) noexcept;
    /// Wakes a thread that waits on `bell`. [any]
    static void ring(std::atomic<std::uint32_t>& bell) noexcept;

    /// Returns the default spin window of a period, for a thread with a real-time policy: two
    /// fifths of the period, at most 150 us.
    static std::int64_t default_spin_ns(std::int64_t period_ns) noexcept;
};

}  // namespace hal
