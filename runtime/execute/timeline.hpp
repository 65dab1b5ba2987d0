// SPDX-License-Identifier: MIT
// The deadline grid of all threads, and how an external clock reference disciplines it.
//
// A thread's deadlines are positions on a grid, epoch + k * period, which never changes; a position
// is due, on the clock, at the position plus the shift. An adjustment changes the shift for all
// positions after that of the cycle that makes it: threads that are due at the same position stay
// aligned, whichever of them has read the shift already, and their relative phase never changes.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "hal/abi.h"

namespace hal {

class Timeline {
public:
    Timeline() noexcept;
    Timeline(const Timeline&) = delete;

    /// Returns when position `grid_ns` is due, on the clock. [any]
    std::int64_t due_ns(std::int64_t grid_ns) const noexcept {
        for (;;) {
            const std::uint32_t newest = newest_.load(std::memory_order_acquire);
            const Step& step = steps_[newest & 1];
            const std::int64_t shift = grid_ns > step.after.load(std::memory_order_acquire)
                                           ? step.shift.load(std::memory_order_acquire)
                                           : step.before.load(std::memory_order_acquire);
            if (newest_.load(std::memory_order_relaxed) == newest) return grid_ns + shift;
        }
    }
    /// Adjusts the clock in the cycle at position `grid_ns`; the sum of the adjustments of a cycle
    /// is clamped to the limit. Only one thread adjusts at a time. [realtime]
    void step(std::int64_t grid_ns, std::int64_t ns) noexcept;

    /// [any]
    std::int64_t shift_ns() const noexcept {
        return __atomic_load_n(&shared.shift_ns, __ATOMIC_RELAXED);
    }
    /// Returns the recent rate of the grid relative to the clock, minus one: +200e-6 follows an
    /// external reference that is 200 ppm slow. 0 during the first second of adjustments. [any]
    double rate() const noexcept { return rate_.load(std::memory_order_relaxed); }
    /// Returns when the newest adjustment was made, on the clock; nullopt: none was. [any]
    std::optional<std::int64_t> adjusted_ns() const noexcept {
        const Step& step = steps_[newest_.load(std::memory_order_acquire) & 1];
        const std::int64_t grid_ns = step.after.load(std::memory_order_acquire);
        if (grid_ns == INT64_MAX) return std::nullopt;
        return grid_ns + step.before.load(std::memory_order_acquire);
    }
    /// Sets the period of the fastest thread; 0: no thread. [setup]
    void bound(std::int64_t fastest_period_ns) noexcept {
        __atomic_store_n(&shared.limit_ns, fastest_period_ns / 10, __ATOMIC_RELAXED);
    }
    /// Enables adjustments: from now on threads must poll for them while they sleep. [setup]
    void lead() noexcept { led_.store(true, std::memory_order_release); }
    bool led() const noexcept { return led_.load(std::memory_order_acquire); }  ///< [any]

    /// given out as extension "hal.clock/1"; written with atomic builtins. The session puts `claim`
    /// in
    hal_clock shared{};

private:
    // Two steps: the newest, and a slot for the next one. No reader waits for a writer that was
    // interrupted:
    //   1. reader sees newest = n        2. writer fills steps[(n + 1) & 1]      3. writer sets newest = n + 1     (release)
    //   4. writer fills steps[n & 1]     (release, so that who sees a part of it sees 3)
    //   5. reader, which has read a part of 4, finds newest changed and looks again. Before 3 nobody writes what it reads.
    struct Step {
        // positions up to this one have the shift `before`
        std::atomic<std::int64_t> after{INT64_MAX};
        std::atomic<std::int64_t> before{0};
        std::atomic<std::int64_t> shift{0};
    };
    Step steps_[2];  // written by the thread that makes steps, read by all
    std::atomic<std::uint32_t> newest_{0};
    std::atomic<bool> led_{false};
    std::atomic<double> rate_{0.0};
    // where the rate is counted from; the stepping thread's
    std::int64_t mark_grid_ns_ = 0;
    std::int64_t mark_shift_ns_ = 0;
    bool marked_ = false;
};

}  // namespace hal
