// SPDX-License-Identifier: MIT
// The mode register of a step generator of an emulated card, and its latch.
#pragma once

#include <cstdint>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

/// Stores the accumulator at an edge of the index or the probe, when that is armed. The event clears
/// the bit that armed it. Firmware that cannot latch does not show the register. [realtime]
class PositionLatch {
public:
    enum class Input : std::uint8_t { index, probe };

    void set_version(std::uint8_t version) noexcept {
        can_latch_ = version == stepgen::version_with_latch;
        can_swap_ = can_latch_ || version == stepgen::version_with_swap;
    }
    bool can_latch() const noexcept { return can_latch_; }
    bool swaps_pins() const noexcept {
        return can_swap_ && (mode_ & stepgen::swap_step_direction) != 0;
    }
    void write(std::uint32_t value) noexcept { mode_ = value & ~stepgen::latch_mask; }
    std::uint32_t read() const noexcept { return can_latch_ ? mode_ | latched_ : 0; }
    void reset() noexcept {
        mode_ = 0;
        latched_ = 0;
    }

    /// Returns whether an edge would be latched, and which: TRUE is the rising one.
    bool is_armed(Input input) const noexcept {
        return can_latch_ && (mode_ & (input == Input::index ? stepgen::latch_on_index
                                                             : stepgen::latch_on_probe)) != 0;
    }
    bool wants_rising(Input input) const noexcept {
        return (mode_ &
                (input == Input::index ? stepgen::index_polarity : stepgen::probe_polarity)) != 0;
    }
    /// Latches; the input is armed.
    void meet(Input input, std::uint32_t accumulator) noexcept {
        latched_ = accumulator & stepgen::latch_mask;
        mode_ &= ~(input == Input::index ? stepgen::latch_on_index : stepgen::latch_on_probe);
    }

private:
    bool can_latch_ = false, can_swap_ = false;
    std::uint32_t mode_ = 0;
    std::uint32_t latched_ = 0;
};

}  // namespace hal::mesa
