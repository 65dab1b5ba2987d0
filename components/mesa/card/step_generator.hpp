// SPDX-License-Identifier: MIT
// A step generator of an emulated card.
#pragma once

#include <cstdint>

namespace hal::mesa {

/// An accumulator that the rate is added to in each clock. A step leaves at each whole number. The
/// accumulator stands when a step is due while the pulse or the space of the step before it, or a
/// time of a change of direction, has not passed: at more than 1 / (length + space) no step is
/// lost, but the accumulator falls behind. Reset state: rate 0, everything else 0. [realtime]
class StepGenerator {
public:
    /// The longest time of each kind in clocks, to which the chip adds one.
    struct Times {
        std::uint32_t length = 0, space = 0, setup = 0, hold = 0;
    };

    void set_rate(std::int32_t rate) noexcept;
    std::int32_t rate() const noexcept { return rate_; }
    void set_accumulator(std::uint32_t value) noexcept;
    /// The upper 32 bits of the 48: 16 of whole steps, 16 of the fraction. [any]
    std::uint32_t accumulator() const noexcept {
        return static_cast<std::uint32_t>(position_ >> 16);
    }
    Times& times() noexcept { return times_; }

    /// Lets clocks pass. Returns the steps that left, with their direction.
    std::int64_t advance(std::int64_t clocks) noexcept;

private:
    std::int64_t pulse_clocks() const noexcept;
    std::int64_t clocks_to_step() const noexcept;
    void pass(std::int64_t clocks) noexcept;
    std::uint64_t beyond() const noexcept;
    std::int64_t run_waiting(std::int64_t clocks, std::int64_t pulse) noexcept;
    std::int64_t run(std::int64_t clocks) noexcept;

    std::uint64_t position_ = 0;  ///< steps in units of 2^-32; only 48 bits are visible
    std::int32_t rate_ = 0;       ///< added in each clock
    int direction_ = 1;           ///< of the last step
    std::int64_t busy_ = 0;       ///< clocks until a step may leave
    Times times_;
};

}  // namespace hal::mesa
